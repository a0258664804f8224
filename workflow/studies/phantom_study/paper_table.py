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
    """The numbers that the paper prints for its 120 runs.

    Attributes
    ----------
    cells
        Values in percent, by name: precision and recall of every size; exact and within-tolerance
        rates of the sizes that the paper estimates; specificity; shares of the paper's pie chart.
        The pie chart shows the classes of the runs without a nodule, and the specificity follows
        from it.
    runs
        Number of runs of each size.
    tolerance_mm
        Tolerance of the within-tolerance rates, in mm.
    passing_samples
        Smallest and largest Delta mu: the time from sensor to sensor, in samples.
    """

    cells: Mapping[str, float]
    runs: int
    tolerance_mm: float
    passing_samples: tuple[float, float]

    @classmethod
    def from_printed(cls, printed: Mapping) -> "PaperTable":
        """Return the table, computed from the content of ``paper.yaml``."""
        tables = printed_tables(printed, _CONFIDENCE)
        paper = {name: table.to_dict("records") for name, table in tables.items()}
        # The printed pie chart has no slice for a size that no run was classified as.
        paper["confusion"] = [row for row in paper["confusion"] if row["count"] > 0]
        tolerance_mm = printed["sizing_tolerance_mm"]
        return cls(
            _cells(paper, tolerance_mm),
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
    rows = confusion.tolist()
    healthy, missed = rows[0], [row[0] for row in rows[1:]]
    quiet = {"size_mm": 0, "tp": healthy[0], "fp": sum(missed), "fn": sum(healthy[1:])}
    tables = {"detection": [quiet], "sizing": []}
    for size_mm, row in enumerate(rows[1:], start=1):
        hits = {"tp": sum(row[1:]), "fp": healthy[size_mm], "fn": row[0]}
        tables["detection"].append({"size_mm": size_mm} | hits)
        near = is_within(np.arange(len(row)), size_mm, paper.tolerance_mm)
        within = int(confusion[size_mm, near].sum())
        sizes = {"recordings": sum(row), "exact": row[size_mm], "within": within}
        tables["sizing"].append({"size_mm": size_mm} | sizes)
    tables["confusion"] = [
        {"size_mm": 0, "predicted_mm": size_mm, "count": count}
        for size_mm, count in enumerate(healthy)
    ]
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


def _cells(rates: Mapping[str, Sequence[Mapping]], tolerance_mm: float) -> dict[str, float]:
    """Return the cells in percent from tables of rates, of the paper or of an archive."""
    (healthy, *detection), sizing = rates["detection"], rates["sizing"]
    healthy_runs = healthy["tp"] + healthy["fn"]
    named = {}
    for row in detection:
        named[f"precision {_label(row)}"] = _percent(row["tp"], row["tp"] + row["fp"])
    for row in detection:
        named[f"recall {_label(row)}"] = _percent(row["tp"], row["tp"] + row["fn"])
    for row in sizing:
        named[f"exact {_label(row)}"] = _percent(row["exact"], row["recordings"])
    for row in sizing:
        name = f"within {tolerance_mm:g} mm of {_label(row)}"
        named[name] = _percent(row["within"], row["recordings"])
    named["specificity"] = _percent(healthy["tp"], healthy_runs)
    for row in rates["confusion"]:
        if row["size_mm"] == 0:
            label = f"{row['predicted_mm']:g} mm" if row["predicted_mm"] > 0 else "none"
            named[f"no nodule as {label}"] = _percent(row["count"], healthy_runs)
    return named


def _label(row: Mapping) -> str:
    return f"{row['size_mm']:g} mm"


def _percent(hits: int, count: int) -> float:
    return 100 * hits / count if count else float("nan")
