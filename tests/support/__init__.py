"""Helpers of the tests: projects to run, recordings, boards, a browser."""
