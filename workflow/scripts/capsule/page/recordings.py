"""Make the table of all recordings, and the data on them for the page's scripts."""

import math
from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from capsule import words
from capsule.arrays import FloatArray
from capsule.detectors.registry import detector_row
from capsule.evaluation.rates import is_within
from capsule.kinds import Cells, Row
from capsule.page.packing import rounded
from capsule.page.rates import ALL, standing_in

OUTCOMES = (
    *("exact", "within tolerance", "off", "missed"),
    *("rightly none", "false alarm", "unlabelled", "not judged", "rejected"),
)
# The table of an archive above MAX_ROWS begins with FIRST_ROWS; the reader can list more.
MAX_ROWS, FIRST_ROWS = 60, 50
# With more marks on one line, the marks overlap.
MAX_MARKS = 200


def page_values(
    index: pd.DataFrame,
    verdicts: pd.DataFrame,
    detectors: Sequence[str],
    sizes_mm: Sequence[float],
    schemes: Sequence[str],
    tolerance_mm: float,
) -> Cells:
    """Return the page's values that list the recordings.

    Parameters
    ----------
    index : DataFrame
        results/recordings.csv.
    verdicts : DataFrame
        From `all_verdicts`.
    detectors : sequence of str
        In the order of the page; the first is shown until the reader chooses another.
    sizes_mm : sequence of float
        Sizes of the templates, 0 first.
    schemes : sequence of str
        The schemes of the page; the first is shown until the reader chooses another.
    tolerance_mm : float
        Allowed error of the size.

    Returns
    -------
    dict
        ``recordings`` (from `recording_rows`), of which the table holds ``rows_listed`` before the
        page's script runs; ``recording_sizes`` and ``outcomes`` for the filters; ``first_shown``;
        ``tolerance``; ``data`` for the page's scripts, from `page_data`.
    """
    rows = recording_rows(index, verdicts, detectors[0], schemes, tolerance_mm)
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
        "data": page_data(rows, verdicts, detectors, sizes_mm, schemes, tolerance_mm),
    }


def all_verdicts(predictions: pd.DataFrame, detections: pd.DataFrame) -> pd.DataFrame:
    """Return size and score of all verdicts; those on unlabelled recordings have the scheme `ALL`.

    Parameters
    ----------
    predictions, detections : DataFrame
        results/evaluation/predictions.csv and results/detections.csv.
    """
    columns = ["recording", "detector", "scheme", "predicted_mm", "score"]
    return pd.concat(
        table.reindex(columns=columns).astype({"predicted_mm": float, "score": float})
        for table in (predictions, detections.assign(scheme=ALL))
    )


def verdicts_of(
    verdicts: pd.DataFrame,
    recordings: Iterable[str],
    detector: str,
    scheme: str,
    schemes: Sequence[str],
) -> pd.DataFrame:
    """Return a detector's verdict on each recording under a scheme, or the one that stands in.

    Parameters
    ----------
    verdicts : DataFrame
        From `all_verdicts`.
    recordings : iterable of str
        The recordings.
    detector, scheme : str
        Their names.
    schemes : sequence of str
        The schemes of the page, for `capsule.page.rates.standing_in`.

    Returns
    -------
    DataFrame
        One row per recording; NaN without a verdict.
    """
    rank = {name: place for place, name in enumerate(standing_in(scheme, schemes))}
    rows = verdicts[(verdicts["detector"] == detector) & verdicts["scheme"].isin(rank)]
    ranked = rows.sort_values("scheme", key=lambda names: names.map(rank), kind="stable")
    return ranked.drop_duplicates("recording").set_index("recording").reindex(list(recordings))


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


def seven_digits(value: float | None) -> float | None:
    """Return a number to seven digits, more than a drawing shows; None if it is not finite."""
    return float(f"{value:.7g}") if words.is_known(value) and math.isfinite(value) else None


def known_or_none(value: float | None) -> float | None:
    """Return a number; None if it is not known."""
    return float(value) if words.is_known(value) else None


def recording_rows(
    index: pd.DataFrame,
    verdicts: pd.DataFrame,
    detector: str,
    schemes: Sequence[str],
    tolerance_mm: float,
) -> list[Cells]:
    """Return one row per recording, including rejected recordings.

    Parameters are as in `page_values`; ``tolerance_mm`` is the allowed error of the size.

    Returns
    -------
    list of dict
        The cells of each row, as text and as value to sort by.
    """
    shown = verdicts_of(verdicts, index["recording"], detector, schemes[0], schemes)
    rows: list[Cells] = []
    for row, predicted in zip(index.to_dict("records"), shown["predicted_mm"], strict=True):
        accepted, predicted_mm = row["status"] == "accepted", known_or_none(predicted)
        size_mm, duration = known_or_none(row["size_mm"]), known_or_none(row["duration_s"])
        reason = _why_not(row)
        rows.append(
            {
                "recording": row["recording"],
                "place": len(rows),
                "accepted": accepted,
                "size_mm": size_mm,
                "size": words.size(size_mm) if size_mm is not None else "unlabelled",
                "nodule_at_mm": seven_digits(
                    pd.to_numeric(row.get("nodule_at_mm"), errors="coerce")
                ),
                "predicted_mm": predicted_mm,
                "verdict": words.size(predicted_mm) if predicted_mm is not None else "",
                "outcome": outcome(size_mm, predicted_mm, tolerance_mm) if accepted else "rejected",
                "duration_s": duration,
                "duration": words.number(duration, 1) if duration is not None else "",
                "reason": reason,
                "sha256": row["sha256"] if words.is_known(row["sha256"]) else "",
            }
        )
    return rows


def _why_not(row: Row) -> str:
    """Return why a recording was rejected, has no verdict, or is evidence in part; else empty."""
    reason: str = row["reason"] if words.is_known(row["reason"]) else ""
    if row["status"] == "accepted" and words.is_known(row["no_verdict"]):
        return "; ".join(filter(None, (f"no verdict: {row['no_verdict']}", reason)))
    return reason


def page_data(
    rows: Sequence[Row],
    verdicts: pd.DataFrame,
    detectors: Sequence[str],
    sizes_mm: Sequence[float],
    schemes: Sequence[str],
    tolerance_mm: float,
) -> Cells:
    """Return the data on all recordings for the page's scripts: every verdict and score.

    The rows are from `recording_rows`. The other parameters are as in `page_values`.

    Returns
    -------
    dict
        ``sizes``. ``detectors`` and ``schemes``, each with ``name`` and ``words``; a detector also
        has ``drawn`` and ``needs``, a scheme ``stand_in`` (from `standing_in`). ``main_scheme`` and
        ``outcomes``. ``verdicts``, for each detector and scheme the size in mm and the outcome's
        number of every row. ``scores``, from `score_marks`. ``recordings``, the accepted ones.
    """
    names = [row["recording"] for row in rows]
    true_mm = np.array([row["size_mm"] for row in rows], dtype=float)
    columns, scores = {}, {}
    for detector in detectors:
        for scheme in schemes:
            key = f"{detector}|{scheme}"
            shown = verdicts_of(verdicts, names, detector, scheme, schemes)
            predicted = list(map(known_or_none, shown["predicted_mm"]))
            outcomes = [
                outcome(row["size_mm"], size_mm, tolerance_mm) if row["accepted"] else "rejected"
                for row, size_mm in zip(rows, predicted, strict=True)
            ]
            numbers = [OUTCOMES.index(each) for each in outcomes]
            columns[key] = {"predicted_mm": predicted, "outcome": numbers}
            known = list(map(seven_digits, shown["score"]))
            scores[key] = score_marks(true_mm, np.array(known, dtype=float))
    return {
        "sizes": list(sizes_mm),
        "detectors": [
            {"name": row.name, "words": row.sentence, "drawn": row.drawn, "needs": row.needs}
            for row in map(detector_row, detectors)
        ],
        "schemes": [
            {"name": name, "words": words.scheme(name), "stand_in": standing_in(name, schemes)}
            for name in schemes
        ],
        "main_scheme": schemes[0],
        "outcomes": list(OUTCOMES),
        "verdicts": columns,
        "scores": scores,
        "recordings": [row["recording"] for row in rows if row["accepted"]],
    }


def score_marks(true_mm: FloatArray, scores: FloatArray) -> list[Cells]:
    """Return the scores of the labelled recordings, one row per size, at most `MAX_MARKS` each.

    Parameters
    ----------
    true_mm : (N,) array
        True sizes; NaN for an unlabelled recording.
    scores : (N,) array
        The score of each recording; NaN without a verdict.

    Returns
    -------
    list of dict
        ``size_mm``, ``of`` (number of recordings) and ``scores``, ascending: all scores, or those
        of evenly spaced ranks.
    """
    marks, known = [], ~np.isnan(true_mm) & ~np.isnan(scores)
    for size_mm in np.unique(true_mm[known]):
        ranked = np.sort(scores[known & (true_mm == size_mm)])
        count = min(len(ranked), MAX_MARKS)
        last = max(count - 1, 1)
        kept = [ranked[round(rank * (len(ranked) - 1) / last)] for rank in range(count)]
        marks.append({"size_mm": float(size_mm), "of": len(ranked), "scores": rounded(kept)})
    return marks
