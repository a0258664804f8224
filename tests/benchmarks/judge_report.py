"""Write the measured rates of the detectors as Markdown."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from judge_rates import error_row, mean_row


@dataclass(frozen=True)
class Measured:
    """Measurements as rows of plain numbers, one row per archive unless said otherwise.

    Attributes
    ----------
    seeds
        Of the archives.
    detectors
        Rows on the bench as configured, by detector.
    effort
        Number of particles and of iterations of the paper's fits.
    conditions, heights
        The diagonal detector's rows on changed benches, by bench.
    retests, retest_archives
        A row for each number of passes, and how many archives they come from.
    peers
        Rows of what others would use, by its name.
    """

    seeds: Sequence[int]
    detectors: Mapping[str, Sequence[Mapping]]
    effort: int
    conditions: Mapping[str, Sequence[Mapping]]
    heights: Mapping[str, Sequence[Mapping]]
    retests: Sequence[Mapping]
    retest_archives: int
    peers: Mapping[str, Sequence[Mapping]] = field(default_factory=dict)


def report(measured: Measured) -> str:
    """Return all tables, each under its heading."""
    sections = [
        _head(measured),
        _conditions(measured),
        _heights(measured),
        _detectors(measured),
        _retests(measured),
    ]
    return "\n".join(sections)


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


def _head(measured: Measured) -> str:
    seeds = measured.seeds
    return (
        "# What the detectors reach on simulated recordings\n\n"
        "Made by `tests/benchmarks/judge_detectors.py`; studies/detection.md tells why. Means over "
        f"{len(seeds)} simulated archives of 120 recordings, seeds {seeds[0]} to {seeds[-1]}, "
        "leave-one-out.\n"
    )


def _conditions(measured: Measured) -> str:
    rows = [mean_row({"condition": label}, each) for label, each in measured.conditions.items()]
    label = {"condition": "standard error, as configured"}
    rows.append(error_row(label, measured.detectors["diagonal"]))
    return f"## The diagonal detector on changed benches\n\n{table(rows)}"


def _heights(measured: Measured) -> str:
    rows = [mean_row({"heights": label}, each) for label, each in measured.heights.items()]
    return (
        "## How well nodule and capsule are set up\n\n"
        "The diagonal detector. The spreads of the nodule's height against the capsule, times the "
        "calibrated ones: a nodule that the capsule passes by leaves no trace.\n\n" + table(rows)
    )


def _detectors(measured: Measured) -> str:
    by_name = {**measured.detectors, **measured.peers}
    rows = [mean_row({"detector": name}, each) for name, each in by_name.items()]
    margins = [row["AUC of 1 mm"] for row in measured.detectors["template"]]
    diagonals = [row["AUC of 1 mm"] for row in measured.detectors["diagonal"]]
    wins = sum(ours > margin for ours, margin in zip(diagonals, margins, strict=False))
    peers = "".join(f" {name}: {len(each)} archives." for name, each in measured.peers.items())
    return (
        "## The detectors on the bench as configured\n\n"
        f"The paper's with {measured.effort} particles and iterations, on {len(margins)} archives. "
        "The diagonal's AUC of 1 mm is above the paper's margin's on "
        f"{wins} of {len(margins)}.{peers}\n\n" + table(rows)
    )


def _retests(measured: Measured) -> str:
    return (
        "## Several passes over one place, judged together\n\n"
        f"The diagonal detector on {measured.retest_archives} archives.\n\n"
        + table(measured.retests)
    )
