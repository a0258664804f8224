"""Compare simulated archives with the paper's printed numbers, cell by cell."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import yaml

from capsule.engine.project import CONFIG
from capsule.evaluation.paper import printed_tables
from capsule.evaluation.rates import is_within

PRINTED = CONFIG.parent / "workflow" / "report" / "paper.yaml"
# Confidence level of the intervals in the tables of rates; no cell uses them.
_CONFIDENCE = 0.95


@dataclass(frozen=True)
class PaperTable:
    """The numbers that the paper prints for its 120 runs."""

    # Values in percent, by name: precision and recall of every size; exact and within-tolerance
    # rates of the sizes that the paper estimates; specificity; shares of the paper's pie chart. The
    # pie chart shows the classes of the runs without a nodule; the specificity follows from it.
    cells: Mapping[str, float]
    runs: int  # of each size
    tolerance_mm: float  # of the within-tolerance rates
    passing_samples: tuple[float, float]  # smallest and largest Delta mu, from sensor to sensor

    @classmethod
    def from_printed(cls, printed: Mapping) -> "PaperTable":
        """Return the table, computed from the content of ``paper.yaml``."""
        tables, tolerance_mm = printed_tables(printed, _CONFIDENCE), printed["sizing_tolerance_mm"]
        # The printed pie chart has no slice for a size that no run was classified as.
        tables["confusion"] = tables["confusion"].query("count > 0")
        tables["detection"] = tables["detection"].query("size_mm > 0")
        return cls(
            _cells(tables, tolerance_mm),
            printed["recordings_per_size"],
            tolerance_mm,
            tuple(printed["settings"]["fit.peak_spacing_range"]["value"]),
        )

    @property
    def motion(self) -> dict[str, float]:
        """Return the motion according to the paper's text, in percent of the runs.

        In all runs, the capsule reaches the far side, and Delta mu lies in its range. Here, Delta
        mu is a run's mean time from sensor to sensor.
        """
        low, high = self.passing_samples
        return {"reaches the far side": 100.0, f"Delta mu {low:g} to {high:g}": 100.0}


def read_paper_table() -> PaperTable:
    """Read the numbers that the paper prints."""
    return PaperTable.from_printed(yaml.safe_load(PRINTED.read_text(encoding="utf-8")))


def cells(confusion: np.ndarray, paper: PaperTable) -> dict[str, float]:
    """Return the paper's cells for one archive, in percent.

    Parameters
    ----------
    confusion : (B, B) array of int
        Runs of true size (row) classified as size (column), 0, 1, 2, ... mm.
    paper
        Names of the cells, and the tolerance.

    Returns
    -------
    dict of str to float
        Rates by the names of `PaperTable.cells`; a precision is NaN if no run was classified as
        this size.
    """
    sizes_mm, healthy = np.arange(len(confusion)), confusion[0]
    near = is_within(sizes_mm, sizes_mm[:, np.newaxis], paper.tolerance_mm)
    counts = {
        "size_mm": sizes_mm,
        "recordings": confusion.sum(axis=1),
        "tp": confusion[:, 1:].sum(axis=1),
        "fp": healthy,
        "fn": confusion[:, 0],
        "exact": np.diag(confusion),
        "within": (confusion * near).sum(axis=1),
    }
    of_nodules = {name: column[1:] for name, column in counts.items()}
    pie = {"predicted_mm": sizes_mm, "count": healthy}
    tables = {"detection": of_nodules, "sizing": of_nodules, "confusion": pie}
    values = _cells(tables, paper.tolerance_mm)
    return {name: values[name] for name in paper.cells}


def distance(means: Mapping[str, float], paper: PaperTable) -> float:
    """Return the root mean square difference from the paper, in spreads of a rate.

    The spread belongs to a rate over as many runs as the paper has of a size. A rate near 0 or
    100 % hardly varies from archive to archive; a rate of 50 % over 20 runs varies by 11 points.
    So a mean recall of 100 % instead of 85 % counts more than an exact rate of 65 % instead of
    50 %.

    Parameters
    ----------
    means
        Means over archives of the cells (from `cells`) and of the motion.
    paper
        The paper's values.
    """
    printed = {**paper.cells, **paper.motion}
    wanted = np.array(list(printed.values())) / 100
    # A precision is unknown if no run was classified as this size. It counts as 0.
    rates = np.nan_to_num([means[name] for name in printed]) / 100
    # Laplace's rule keeps each rate away from 0 and 1, so no spread is 0.
    likely = (paper.runs * rates + 1) / (paper.runs + 2)
    spreads = np.sqrt(likely * (1 - likely) / paper.runs)
    return float(np.sqrt(np.mean(((rates - wanted) / spreads) ** 2)))


def summary(archives: Sequence[Mapping[str, float]], paper: PaperTable) -> list[dict]:
    """Return for each cell the paper's value, and the mean and central 95 % of the archives.

    Parameters
    ----------
    archives
        The cells of each archive.
    paper
        The paper's table.

    Returns
    -------
    list of dict
        ``cell``, ``paper``, ``mean``, ``low``, ``high``, in percent, and ``inside``: whether the
        paper's value lies in the range.
    """
    rows = []
    for name, printed in paper.cells.items():
        values = np.array([archive[name] for archive in archives])
        low, high = np.nanpercentile(values, [2.5, 97.5])
        rows.append(
            {
                "cell": name,
                "paper": printed,
                "mean": float(np.nanmean(values)),
                "low": float(low),
                "high": float(high),
                "inside": bool(low - 1e-9 <= printed <= high + 1e-9),
            }
        )
    return rows


def mean_difference(rows: Sequence[Mapping]) -> float:
    """Return the mean absolute difference of the cells' means from the paper, in points."""
    return float(np.mean([abs(row["mean"] - row["paper"]) for row in rows]))


def _cells(tables: Mapping[str, Mapping], tolerance_mm: float) -> dict[str, float]:
    """Return the cells in percent from the columns of tables, of the paper or of an archive."""
    detection, sizing, pie = tables["detection"], tables["sizing"], tables["confusion"]
    hits, runs, predicted = detection["tp"], sum(pie["count"]), pie["predicted_mm"]
    quiet = pie["count"][predicted == 0]
    within = f"within {tolerance_mm:g} mm of "
    named = {}
    for words, sizes_mm, counts, of in (
        ("precision ", detection["size_mm"], hits, hits + detection["fp"]),
        ("recall ", detection["size_mm"], hits, hits + detection["fn"]),
        ("exact ", sizing["size_mm"], sizing["exact"], sizing["recordings"]),
        (within, sizing["size_mm"], sizing["within"], sizing["recordings"]),
        ("specificity", [None], quiet, runs),
        ("no nodule as ", predicted, pie["count"], runs),
    ):
        percent = 100 * np.asarray(counts) / np.where(of, of, np.nan)
        named |= {
            words + _label(size): value
            for size, value in zip(sizes_mm, percent.tolist(), strict=True)
        }
    return named


def _label(size_mm: float | None) -> str:
    return "" if size_mm is None else f"{size_mm:g} mm" if size_mm > 0 else "none"
