"""Make the table of all recordings: the true size, the verdict, and whether it is right."""

import math
from collections.abc import Mapping, Sequence

import pandas as pd

from capsule import words
from capsule.detectors.registry import detector_row
from capsule.evaluation.rates import is_within
from capsule.evaluation.sites import number
from capsule.kinds import Cells, Row, Settings
from capsule.page.schemes import standing_in

OUTCOMES = (
    "exact",
    "within tolerance",
    "off",
    "missed",
    "rightly none",
    "false alarm",
    "unlabelled",
    "not judged",
    "rejected",
)
# The table of an archive above MAX_ROWS begins with FIRST_ROWS; the reader can list more.
MAX_ROWS, FIRST_ROWS = 2000, 500
# The columns with the evidence for a verdict.
EVIDENCE = ("score", "threshold", "location_mm")


def page_values(
    index: pd.DataFrame,
    verdicts: Mapping[str, list[Cells]],
    detector: str,
    schemes: Sequence[str],
    settings: Settings,
) -> Cells:
    """Return the page's values that list the recordings.

    Parameters
    ----------
    index : DataFrame
        results/recordings.csv.
    verdicts : mapping of str to list of dict
        From `verdicts_by_recording`.
    detector : str
        The detector whose verdicts are shown.
    schemes : sequence of str
        The schemes of the page; the first is shown.
    settings : mapping
        Section ``evaluation`` of the configuration.

    Returns
    -------
    dict
        ``recordings`` (from `recording_rows`), ``rows_listed`` (how many of them the table holds
        before the page's script runs), ``recording_sizes`` and ``outcomes`` for the filters,
        ``first_shown`` and ``tolerance``.
    """
    tolerance_mm = settings["tolerance_mm"]
    rows = recording_rows(index, verdicts, detector, schemes, tolerance_mm)
    accepted = [row for row in rows if row["accepted"]]
    # A recording with a nodule shows more at first sight than one without.
    first = next((row for row in accepted if row["size_mm"]), accepted[0] if accepted else None)
    present = {row["outcome"] for row in rows}
    return {
        "recordings": rows,
        "rows_listed": len(rows) if len(rows) <= MAX_ROWS else FIRST_ROWS,
        "recording_sizes": list(dict.fromkeys(row["size"] for row in rows)),
        "outcomes": [name for name in OUTCOMES if name in present],
        "first_shown": first["recording"] if first else "",
        "tolerance": f"{tolerance_mm:g} mm",
    }


def outcome(size_mm: float | None, predicted_mm: float | None, tolerance_mm: float) -> str:
    """Return the outcome of a verdict on an accepted recording.

    Parameters
    ----------
    size_mm : float or None
        True size, 0 for no nodule; None or NaN for an unlabelled recording.
    predicted_mm : float or None
        Predicted size, 0 for no nodule; None or NaN without a verdict.
    tolerance_mm : float
        Allowed error of the size.

    Returns
    -------
    str
        One of `OUTCOMES`.
    """
    if not words.is_known(size_mm):
        return "unlabelled"
    if not words.is_known(predicted_mm):
        return "not judged"
    if size_mm == 0:
        return "rightly none" if predicted_mm == 0 else "false alarm"
    if predicted_mm == 0:
        return "missed"
    if predicted_mm == size_mm:
        return "exact"
    return "within tolerance" if is_within(predicted_mm, size_mm, tolerance_mm) else "off"


def verdicts_by_recording(
    predictions: pd.DataFrame, detections: pd.DataFrame
) -> dict[str, list[Cells]]:
    """Return every verdict on every recording, in the order of the tables.

    Returns
    -------
    dict of str to list of dict
        The rows of the tables; an unknown number is NaN. Unlabelled recordings have the scheme
        ``all``.
    """
    verdicts: dict[str, list[Cells]] = {}
    for table in (predictions, detections):
        for row in table.to_dict("records"):
            row.setdefault("scheme", "all")
            verdicts.setdefault(row["recording"], []).append(row)
    return verdicts


def verdict_of(
    verdicts: Sequence[Row], detector: str, scheme: str, schemes: Sequence[str]
) -> Row | None:
    """Return a detector's verdict on a recording under a scheme, or the one that stands in.

    Parameters
    ----------
    verdicts : sequence of mapping
        The recording's verdicts, from `verdicts_by_recording`.
    detector, scheme : str
        Their names.
    schemes : sequence of str
        The schemes of the page, for `capsule.page.schemes.standing_in`.
    """
    by_scheme = {each["scheme"]: each for each in verdicts if each["detector"] == detector}
    wanted = (name for name in standing_in(scheme, schemes) if name in by_scheme)
    return by_scheme.get(next(wanted, ""))


def in_words(verdict: Row, largest_mm: float | None = None) -> Cells:
    """Return what the page shows of a verdict from `verdicts_by_recording`.

    Parameters
    ----------
    verdict : mapping
        The verdict.
    largest_mm : float, optional
        The largest size that the archive holds.

    Returns
    -------
    dict
        ``detector``, ``scheme``, ``predicted_mm``, ``details`` (size, probability and place in
        words), ``distances`` to every template, ``location_s`` and `EVIDENCE`. A value that is not
        known is None. A detector that does not use distances has none.
    """
    by_distance = detector_row(verdict["detector"]).by_distance
    labels = [name for name in verdict if name.startswith("rmse_")] if by_distance else []
    return {
        "detector": verdict["detector"],
        "scheme": verdict["scheme"],
        "predicted_mm": known_or_none(verdict["predicted_mm"]),
        "details": _details(verdict, largest_mm),
        "distances": [known_or_none(verdict[name]) for name in labels],
        "location_s": known_or_none(verdict.get("location_s")),
        **{key: seven_digits(verdict.get(key)) for key in EVIDENCE},
    }


def _details(row: Row, largest_mm: float | None) -> str:
    """Return the size, probability and place of a verdict in words; or why there is none."""
    if not words.is_known(row["predicted_mm"]):
        reason = row.get("no_verdict")
        return str(reason) if words.is_known(reason) else ""
    unlike = words.unlike(row)
    parts, location_s = [unlike] if unlike else [], row.get("location_s")
    if words.is_known(row.get("estimate_mm")):
        parts.append(f"estimated {words.estimated_size(row, largest_mm)}")
    probability = words.stated_probability(row)
    if words.is_known(probability):
        parts.append(f"probability {words.probability(probability)}")
    if words.is_known(location_s):
        parts.append(f"place {words.place(location_s, row.get('location_mm'))}")
    return "; ".join(parts) if unlike else ", ".join(parts)


def seven_digits(value: float | None) -> float | None:
    """Return a number to seven digits, more than a drawing shows; None if it is not finite."""
    return float(f"{value:.7g}") if words.is_known(value) and math.isfinite(value) else None


def known_or_none(value: float | None) -> float | None:
    """Return a number; None if it is not known."""
    return float(value) if words.is_known(value) else None


def recording_rows(
    index: pd.DataFrame,
    verdicts: Mapping[str, list[Cells]],
    detector: str,
    schemes: Sequence[str],
    tolerance_mm: float,
) -> list[Cells]:
    """Return one row per recording, including rejected recordings.

    Parameters
    ----------
    index : DataFrame
        results/recordings.csv.
    verdicts : mapping of str to list of dict
        From `verdicts_by_recording`.
    detector : str
        The detector whose verdicts are shown.
    schemes : sequence of str
        The schemes of the page; the first is shown.
    tolerance_mm : float
        Allowed error of the size.

    Returns
    -------
    list of dict
        The cells of each row, as text and as value to sort by.
    """
    rows = []
    for row in index.to_dict("records"):
        cells = _unjudged(row)
        verdict = verdict_of(verdicts.get(row["recording"], ()), detector, schemes[0], schemes)
        verdict = verdict or {"predicted_mm": None}
        predicted_mm = known_or_none(verdict["predicted_mm"])
        judged = outcome(cells["size_mm"], predicted_mm, tolerance_mm)
        duration = known_or_none(row["duration_s"])
        note = row["source"] if cells["accepted"] and words.is_known(row["source"]) else ""
        rows.append(
            cells
            | {
                "predicted_mm": predicted_mm,
                "detector": detector,
                "verdict": words.size(predicted_mm) if predicted_mm is not None else "",
                "outcome": judged if cells["accepted"] else "rejected",
                "duration_s": duration,
                "duration": words.number(duration, 1) if duration is not None else "",
                "note": note,
                "reason": _why_not(row),
                "notes": "; ".join(filter(None, (note, _why_not(row)))),
                "sha256": row["sha256"] if words.is_known(row["sha256"]) else "",
            }
        )
    return rows


def unjudged_rows(index: pd.DataFrame) -> list[Cells]:
    """Return the cells of each row that no verdict changes, including rejected recordings.

    Parameters
    ----------
    index : DataFrame
        results/recordings.csv.

    Returns
    -------
    list of dict
        ``recording``, ``accepted``, ``size_mm``, ``size`` and ``nodule_at_mm``.
    """
    return [_unjudged(row) for row in index.to_dict("records")]


def _unjudged(row: Row) -> Cells:
    size_mm = known_or_none(row["size_mm"])
    return {
        "recording": row["recording"],
        "accepted": row["status"] == "accepted",
        "size_mm": size_mm,
        "size": words.size(size_mm) if size_mm is not None else "unlabelled",
        "nodule_at_mm": seven_digits(number(str(row.get("nodule_at_mm", "")))),
    }


def truth(row: Row) -> str:
    """Return a recording's truth, such as ``3 mm nodule``; `row` is from `unjudged_rows`."""
    return {None: "unlabelled", 0.0: "no nodule"}.get(row["size_mm"], f"{row['size']} nodule")


def _why_not(row: Row) -> str:
    """Return why a recording was rejected or has no verdict; empty if it has a verdict."""
    if row["status"] != "accepted":
        reason: str = row["reason"]
        return reason
    return f"no verdict: {row['no_verdict']}" if words.is_known(row["no_verdict"]) else ""
