"""A confusion table of 120 runs that gives every printed number of the paper."""

import numpy as np

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
