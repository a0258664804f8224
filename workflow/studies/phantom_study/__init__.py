"""Studies of the phantom: calibration, comparison with the paper, figures of the documentation."""
