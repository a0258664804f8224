"""What the tables of the benchmark show of one archive, the same for every detector."""

import numpy as np


def rates(sizes: np.ndarray, predicted: np.ndarray) -> dict[str, float]:
    """Give what a table shows of one archive, detection and size apart."""
    detected, large = predicted > 0, sizes >= 2
    error = np.abs(predicted - sizes)
    specificity = float(np.mean(~detected[sizes == 0]))
    return {
        "specificity": specificity,
        "recall at 1 mm": float(np.mean(detected[sizes == 1])),
        "recall from 2 mm": float(np.mean(detected[large])),
        "within 1 mm, from 2 mm": float(np.mean((error[large] <= 1) & detected[large])),
        "balanced accuracy": (specificity + float(np.mean(detected[sizes > 0]))) / 2,
        "size error, from 2 mm (mm)": float(np.mean(error[large])),
    }
