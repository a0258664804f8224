"""Detectors beside the paper's: its margin with a threshold, and the diagonal of beats."""
