"""The paper's printed numbers as cells, and how a simulated archive compares with them."""

from collections.abc import Mapping, Sequence

import numpy as np

SIZES_MM = (0, 1, 2, 3, 4, 5)
# Of each size.
RUNS = 20

# In percent. Precision and recall for 1..5 mm, exact and within-1-mm rates for 2..5 mm, the
# specificity 6/20 that follows from the printed pie, and that pie: how the 20 runs without a
# nodule were classified.
PAPER = {
    "precision 1 mm": 100 * 15 / 26,
    "precision 2 mm": 85.0,
    "precision 3 mm": 100.0,
    "precision 4 mm": 100.0,
    "precision 5 mm": 100.0,
    "recall 1 mm": 75.0,
    "recall 2 mm": 85.0,
    "recall 3 mm": 100.0,
    "recall 4 mm": 100.0,
    "recall 5 mm": 100.0,
    "exact 2 mm": 30.0,
    "exact 3 mm": 55.0,
    "exact 4 mm": 70.0,
    "exact 5 mm": 15.0,
    "within 1 mm of 2 mm": 85.0,
    "within 1 mm of 3 mm": 85.0,
    "within 1 mm of 4 mm": 85.0,
    "within 1 mm of 5 mm": 70.0,
    "specificity": 30.0,
    "no nodule as none": 30.0,
    "no nodule as 1 mm": 55.0,
    "no nodule as 2 mm": 15.0,
}

# In percent of the runs, from the paper's words: a recording ends when the capsule has reached the
# far side, and Delta mu, here a run's mean time from sensor to sensor, is 100 to 250 samples.
PASSING_SAMPLES = (100, 250)
MOTION = {"reaches the far side": 100.0, "Delta mu 100 to 250": 100.0}


def cells(confusion: np.ndarray) -> dict[str, float]:
    """Return the paper's cells of one archive, in percent.

    Parameters
    ----------
    confusion : (6, 6) array
        Runs of true size (row) classified as size (column), 0..5 mm.

    Returns
    -------
    dict of str to float
        The keys of `PAPER`; NaN for a precision of nothing found.
    """
    runs = confusion.sum(axis=1)
    nodules = range(1, len(SIZES_MM))
    found = confusion[:, 1:].sum(axis=1)
    result = {}
    for size in nodules:
        claimed = found[size] + confusion[0, size]
        result[f"precision {size} mm"] = 100 * found[size] / claimed if claimed else np.nan
    result |= {f"recall {size} mm": 100 * found[size] / runs[size] for size in nodules}
    result |= {f"exact {size} mm": 100 * confusion[size, size] / runs[size] for size in nodules[1:]}
    for size in nodules[1:]:
        near = confusion[size, max(size - 1, 1) : size + 2].sum()
        result[f"within 1 mm of {size} mm"] = 100 * near / runs[size]
    result["specificity"] = 100 * confusion[0, 0] / runs[0]
    for size, label in enumerate(("none", "1 mm", "2 mm")):
        result[f"no nodule as {label}"] = 100 * confusion[0, size] / runs[0]
    return {name: float(value) for name, value in result.items()}


def motion(arrived: np.ndarray, passing_samples: np.ndarray) -> dict[str, float]:
    """Return in how many runs the capsule moves as the paper says, in percent.

    Parameters
    ----------
    arrived : (n,) array of bool
        Whether each run ended at the far side.
    passing_samples : (n,) array
        Mean time from sensor to sensor over the nodule of each run, in samples.

    Returns
    -------
    dict of str to float
        The keys of `MOTION`.
    """
    low, high = PASSING_SAMPLES
    usual = (passing_samples >= low) & (passing_samples <= high)
    return dict(zip(MOTION, (100 * float(arrived.mean()), 100 * float(usual.mean())), strict=True))


def distance(found: Mapping[str, float]) -> float:
    """Return the root mean square difference from the paper, in spreads of a rate of 20 runs.

    A rate near 0 or 100 % hardly varies from archive to archive, one of 50 % by 11 points; so a
    mean recall of 100 % where the paper has 85 is farther off than an exact rate of 65 % where it
    has 50.

    Parameters
    ----------
    found
        Means over archives of the cells of `PAPER` (from `cells`) and of `MOTION` (from `motion`).
    """
    wanted = PAPER | MOTION
    # A precision of nothing found is as far off as can be.
    rates = np.nan_to_num([found[name] for name in wanted]) / 100
    # Laplace's rule: no rate is known to be exactly 0 or 1.
    likely = (RUNS * rates + 1) / (RUNS + 2)
    spreads = np.sqrt(likely * (1 - likely) / RUNS)
    return float(np.sqrt(np.mean(((rates - np.array(list(wanted.values())) / 100) / spreads) ** 2)))


def summary(archives: Sequence[Mapping[str, float]]) -> list[dict]:
    """Return each cell's paper value beside the mean and the central 95 % of the archives.

    Returns
    -------
    list of dict
        ``cell``, ``paper``, ``mean``, ``low``, ``high``, in percent, and ``inside``: whether the
        paper's value lies in the range.
    """
    rows = []
    for name, paper in PAPER.items():
        values = np.array([archive[name] for archive in archives])
        low, high = np.nanpercentile(values, [2.5, 97.5])
        rows.append(
            {
                "cell": name,
                "paper": paper,
                "mean": float(np.nanmean(values)),
                "low": float(low),
                "high": float(high),
                "inside": bool(low - 1e-9 <= paper <= high + 1e-9),
            }
        )
    return rows


def mean_difference(rows: Sequence[Mapping]) -> float:
    """Return the mean absolute difference of the cells' means from the paper, in points."""
    return float(np.mean([abs(row["mean"] - row["paper"]) for row in rows]))
