"""What the paper gives: its parameters' ranges, and a table with all its printed numbers."""

import numpy as np

from capsule.method.particle import ParameterSpace

# The ranges and steps of the particle's parameters.
PAPER = ParameterSpace(
    amplitude_range=(0.001, 1.5),
    vertical_spread_range=(0.001, 1.0),
    peak_spacing_range=(100, 250),
    horizontal_spread_range=(1, 60),
    continuous_step=0.1,
    integer_step=1,
)

# A confusion table of 120 runs that gives every printed number.
# Runs of true size (row) classified as size (column), 0..5 mm.
LIKE_THE_PAPER = np.array(
    [
        [6, 11, 3, 0, 0, 0],
        [5, 9, 4, 2, 0, 0],
        [3, 6, 6, 5, 0, 0],
        [0, 3, 3, 11, 3, 0],
        [0, 1, 2, 2, 14, 1],
        [0, 0, 3, 3, 11, 3],
    ]
)
