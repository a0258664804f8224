"""Collect the data on all recordings for the page's scripts: every verdict and score."""

from collections.abc import Mapping, Sequence

from capsule import words
from capsule.detectors.registry import detector_row
from capsule.kinds import Cells, Row
from capsule.page.packing import rounded
from capsule.page.recordings import OUTCOMES, known_or_none, outcome, seven_digits, verdict_of
from capsule.page.schemes import standing_in

# With more marks on one line, the marks overlap.
MAX_MARKS = 200


def page_data(
    rows: Sequence[Row],
    verdicts: Mapping[str, Sequence[Row]],
    detectors: Sequence[str],
    sizes_mm: Sequence[float],
    schemes: Sequence[str],
    tolerance_mm: float,
) -> Cells:
    """Return the data on all recordings for the page's scripts.

    Parameters
    ----------
    rows : sequence of mapping
        From `capsule.page.recordings.recording_rows`.
    verdicts : mapping of str to sequence of mapping
        From `capsule.page.recordings.verdicts_by_recording`.
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
        ``sizes``. ``detectors`` and ``schemes``, each with ``name`` and ``words``; a detector also
        has ``drawn`` and ``needs``, a scheme ``stand_in`` (from `standing_in`). ``main_scheme`` and
        ``outcomes``. ``verdicts``, for each
        detector and scheme the size in mm and the outcome's number of every row. ``scores``, from
        `score_marks`. ``checksums`` of the rows.
    """
    tables = {}
    for detector in detectors:
        for scheme in schemes:
            judged = [
                _verdict(verdicts.get(row["recording"], ()), detector, scheme, schemes)
                for row in rows
            ]
            tables[f"{detector}|{scheme}"] = (judged, score_marks(rows, judged))
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
        "verdicts": {
            key: _columns(rows, judged, tolerance_mm) for key, (judged, _) in tables.items()
        },
        "scores": {key: marks for key, (_, marks) in tables.items()},
        "checksums": {row["recording"]: row["sha256"][:16] for row in rows if row["accepted"]},
    }


def score_marks(rows: Sequence[Row], judged: Sequence[Row | None]) -> list[Cells]:
    """Return the scores of the labelled recordings, one row per size, at most `MAX_MARKS` each.

    Parameters
    ----------
    rows : sequence of mapping
        The recordings.
    judged : sequence of mapping or None
        The verdict on each recording.

    Returns
    -------
    list of dict
        ``size_mm``, ``of`` (number of recordings) and ``scores``, ascending: all scores, or those
        of evenly spaced ranks.
    """
    by_size: dict[float, list[float]] = {}
    for row, verdict in zip(rows, judged, strict=True):
        if row["size_mm"] is not None and verdict is not None and verdict["score"] is not None:
            by_size.setdefault(row["size_mm"], []).append(verdict["score"])
    marks = []
    for size_mm in sorted(by_size):
        scores = sorted(by_size[size_mm])
        count = min(len(scores), MAX_MARKS)
        last = max(count - 1, 1)
        kept = [scores[round(rank * (len(scores) - 1) / last)] for rank in range(count)]
        marks.append({"size_mm": size_mm, "of": len(scores), "scores": rounded(kept)})
    return marks


def _verdict(
    verdicts: Sequence[Row], detector: str, scheme: str, schemes: Sequence[str]
) -> Row | None:
    """Return size and score of a detector's verdict, or of the one that stands in."""
    row = verdict_of(verdicts, detector, scheme, schemes)
    if row is None:
        return None
    return {
        "predicted_mm": known_or_none(row["predicted_mm"]),
        "score": seven_digits(row.get("score")),
    }


def _columns(rows: Sequence[Row], judged: Sequence[Row | None], tolerance_mm: float) -> Cells:
    predicted = [None if verdict is None else verdict["predicted_mm"] for verdict in judged]
    outcomes = [
        outcome(row["size_mm"], size_mm, tolerance_mm) if row["accepted"] else "rejected"
        for row, size_mm in zip(rows, predicted, strict=True)
    ]
    return {
        "predicted_mm": predicted,
        "outcome": [OUTCOMES.index(each) for each in outcomes],
    }
