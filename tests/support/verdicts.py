"""Make verdicts and rows of the table of recordings, for tests of the evaluation."""

import numpy as np
import pandas as pd

OF_SCORES = ("score", "threshold", "probability", "estimate_mm", "location_mm")
OF_SCORES += ("estimate_low_mm", "estimate_high_mm")


def verdicts(pairs, detector="one", scheme="leave_one_out", **columns):
    """Return the verdicts of one detector on pairs of true and predicted size.

    The score is the predicted size, and what is not given is not known.
    """
    true_mm, predicted_mm = np.array(list(pairs), dtype=float).reshape(-1, 2).T
    made = pd.DataFrame({"size_mm": true_mm, "predicted_mm": predicted_mm})
    names = [f"{size:g}mm/r{number}" for number, size in enumerate(true_mm)]
    made = made.assign(recording=names, detector=detector, scheme=scheme)
    made = made.assign(**dict.fromkeys(OF_SCORES, np.nan))
    return made.assign(**{"score": made["predicted_mm"], **columns})


def index_of(made, **columns):
    """Return the rows of the recordings of verdicts; what is not given is an empty text."""
    names = list(dict.fromkeys(made["recording"]))
    blank = {"site": "", "session": "", "setup": "", "near_copies": "", "nodule_at_mm": ""}
    rows = {name: dict(blank) for name in names}
    for column, values in columns.items():
        for name, value in zip(names, values, strict=True):
            rows[name][column] = str(value)
    return rows
