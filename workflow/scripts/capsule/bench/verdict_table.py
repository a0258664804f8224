"""The verdicts of all detectors on one recording as a table of plain text."""

from collections.abc import Mapping, Sequence

from capsule import words
from capsule.detectors.base import Verdict, why_unknown
from capsule.detectors.familiar import Familiarity
from capsule.kinds import Settings

_GAP = "  "


def verdict_table(
    verdicts: Mapping[str, Verdict], settings: Settings, familiarity: Familiarity
) -> list[str]:
    """Return a table with one line per detector.

    Parameters
    ----------
    verdicts : mapping of str to Verdict
        Verdicts by the detector's name.
    settings : mapping
        Sections ``recording`` and ``evaluation`` of the configuration.
    familiarity : Familiarity
        Whether the recording is familiar. If it is not, no probability is stated.

    Returns
    -------
    list of str
        A line about a recording that is not familiar, and the lines of the table; the first of
        these names the columns.
    """
    confidence = words.percent(settings["evaluation"]["size_confidence"])
    head = ["detector", "verdict", f"size ({confidence} interval)", "probability", "place"]
    rate_hz = settings["recording"]["rate_hz"]
    rows = [_cells(name, each, rate_hz, familiarity) for name, each in verdicts.items()]
    return [*filter(None, [familiarity.sentence]), *_aligned([head, *rows])]


def _cells(detector: str, verdict: Verdict, rate_hz: float, familiarity: Familiarity) -> list[str]:
    probability = words.probability(familiarity.stated(verdict.probability))
    if not words.is_known(verdict.predicted_mm):
        return [detector, f"none: {why_unknown(verdict)}"]
    if verdict.predicted_mm == 0:
        return [detector, "no nodule", "", probability]
    return [
        detector,
        "nodule",
        words.estimated_size(vars(verdict)),
        probability,
        words.place(verdict.location_samples / rate_hz, verdict.location_mm),
    ]


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows as lines with aligned columns.

    The last cell of a row may be longer than its column.
    """
    columns = max(map(len, rows))
    widths = [
        max((len(row[column]) for row in rows if column < len(row) - 1), default=0)
        for column in range(columns)
    ]
    return [
        _GAP.join(cell.ljust(width) for cell, width in zip(row, widths, strict=False)).rstrip()
        for row in rows
    ]
