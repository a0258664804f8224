"""What the tests share: projects to run, recordings, boards, a browser."""
