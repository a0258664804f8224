"""Rates of archives, the same for every detector, and tables of the benchmarks."""

import math
from collections.abc import Mapping, Sequence

import numpy as np


def rates(sizes: np.ndarray, predicted: np.ndarray) -> dict[str, float]:
    """Return what a table shows of one archive, detection and size apart.

    Parameters
    ----------
    sizes, predicted : (n,) array
        True and predicted sizes of the recordings in mm, 0 for no nodule. A recording without a
        verdict has a prediction of NaN. It counts as a failure: a nodule is missed, and a healthy
        recording is not recognised.
    """
    detected, healthy, large = predicted > 0, predicted == 0, sizes >= 2
    error = np.abs(predicted - sizes)
    specificity = float(np.mean(healthy[sizes == 0]))
    return {
        "specificity": specificity,
        "recall at 1 mm": float(np.mean(detected[sizes == 1])),
        "recall from 2 mm": float(np.mean(detected[large])),
        "within 1 mm, from 2 mm": float(np.mean((error[large] <= 1) & detected[large])),
        "balanced accuracy": (specificity + float(np.mean(detected[sizes > 0]))) / 2,
        "size error, from 2 mm (mm)": mean_or_unknown(error[large]),
    }


def mean_or_unknown(values: np.ndarray) -> float:
    """Return the mean of what is known; NaN where nothing is."""
    known = values[~np.isnan(values)]
    return float(known.mean()) if known.size else float("nan")


def mean_row(label: Mapping, rows: Sequence[Mapping]) -> dict:
    """Return the mean of the rows of several archives, behind its label."""
    means = {key: mean_or_unknown(np.array([row[key] for row in rows])) for key in rows[0]}
    return {**label, **means}


def error_row(label: Mapping, rows: Sequence[Mapping]) -> dict:
    """Return the standard error of what `mean_row` gives: how much is the luck of the archives."""
    errors = {
        key: float(np.nanstd([row[key] for row in rows], ddof=1)) / len(rows) ** 0.5
        for key in rows[0]
        if key != "seconds"
    }
    return {**label, **errors}


def table(rows: Sequence[Mapping]) -> str:
    """Return rows as a Markdown table; shares in per cent."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    lines += ["| " + " | ".join(_cell(key, row.get(key)) for key in columns) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def _cell(column: str, value: float | str | None) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    if math.isnan(value):
        return ""
    plain = "mm)" in column or "seconds" in column or "AUC" in column
    return f"{value:.3f}" if plain else f"{100 * value:.1f} %"
