"""Studies of the phantom: its calibration, its judgement, the pictures of its documentation."""
