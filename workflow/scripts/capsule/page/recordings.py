"""Make the table of all recordings, and the data on them for the page's scripts."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from capsule import words
from capsule.detectors.registry import detector_row
from capsule.detectors.unlike import unlike
from capsule.evaluation.rates import is_within
from capsule.kinds import Cells, Row
from capsule.page.packing import rounded
from capsule.page.quality_map import MEASURES, NOT_MEASURED, quality_cells
from capsule.page.tables import Tables

OUTCOMES = (
    *("exact", "within tolerance", "off", "missed"),
    *("rightly none", "false alarm", "unlabelled", "not judged", "rejected"),
)
# The table of an archive above MAX_ROWS begins with FIRST_ROWS; the reader can list more.
MAX_ROWS, FIRST_ROWS = 60, 50
# With more marks on one line, the marks overlap.
MAX_MARKS = 200


def page_values(tables: Tables) -> Cells:
    """Return the page's values that list the recordings, with the leading detector's verdicts."""
    first = tables.first_verdicts
    lead, tolerance_mm = tables.lead.detector, tables.settings["evaluation"]["tolerance_mm"]
    quality = quality_cells(tables.described)
    rows = recording_rows(tables.index, tables.by_recording, lead, tolerance_mm, quality)
    present = {row["outcome"] for row in rows}
    detectors = map(detector_row, dict.fromkeys([lead, *tables.evaluation.detectors()]))
    return {
        "recordings": rows,
        "rows_listed": len(rows) if len(rows) <= MAX_ROWS else FIRST_ROWS,
        "recording_sizes": list(dict.fromkeys(row["size"] for row in rows)),
        "outcomes": [name for name in OUTCOMES if name in present],
        "tolerance": f"{tolerance_mm:g} mm",
        "measures": [measure.title for measure in MEASURES.values()],
        # For the page's scripts.
        "data": {
            "sizes": list(map(words.size, tables.evaluation.sizes_mm())),
            "detectors": [
                {
                    "name": row.name,
                    "drawn": row.drawn,
                    "needs": row.needs,
                    "scores": score_marks(first[first["detector"] == row.name]),
                }
                for row in detectors
            ],
        },
    }


def outcome(size_mm: float | None, predicted_mm: float | None, tolerance_mm: float) -> str:
    """Return the outcome of a verdict on an accepted recording, one of `OUTCOMES`.

    The sizes are 0 for no nodule, and None or NaN if they are not known.
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
    verdicts: Mapping[str, Sequence[Row]],
    detector: str,
    tolerance_mm: float,
    quality: Mapping[str, Cells],
) -> list[Cells]:
    """Return one row per recording, including rejected recordings."""
    rows: list[Cells] = []
    for row in index.to_dict("records"):
        accepted = row["status"] == "accepted"
        said = {each["detector"]: each for each in verdicts.get(row["recording"], [])}
        verdict = said.get(detector, {})
        predicted_mm = known_or_none(verdict.get("predicted_mm"))
        measured = quality.get(row["recording"], NOT_MEASURED)
        size_mm = known_or_none(row["size_mm"])
        rows.append(
            {
                "recording": row["recording"],
                "accepted": accepted,
                "size_mm": size_mm,
                "size": words.size(size_mm) if size_mm is not None else "unlabelled",
                "nodule_at_mm": seven_digits(
                    pd.to_numeric(row.get("nodule_at_mm"), errors="coerce")
                ),
                "predicted_mm": predicted_mm,
                "outcome": outcome(size_mm, predicted_mm, tolerance_mm) if accepted else "rejected",
                "duration_s": known_or_none(row["duration_s"]),
                "quality": measured["cells"],
                "remark": "; ".join([*_why_not(row, verdict), *measured["remarks"]]),
            }
        )
    return rows


def _why_not(row: Row, verdict: Row) -> list[str]:
    """Return why a recording is rejected, has no verdict, is unlike others or evidence in part."""
    no_verdict, reason = (
        row[key] if words.is_known(row.get(key)) else "" for key in ("no_verdict", "reason")
    )
    silent = f"no verdict: {no_verdict}" if no_verdict and row["status"] == "accepted" else ""
    return [*filter(None, [silent, unlike(verdict), reason])]


def score_marks(verdicts: pd.DataFrame) -> list[Cells]:
    """Return the scores of the labelled recordings, one row per size, at most `MAX_MARKS` each.

    Of more, those of evenly spaced ranks are kept.
    """
    marks = []
    known = verdicts[np.isfinite(verdicts["score"].astype(float))].sort_values("score")
    for size_mm, scores in known.groupby("size_mm")["score"]:
        ranks = np.linspace(0, len(scores) - 1, min(len(scores), MAX_MARKS))
        kept = rounded(scores.iloc[np.rint(ranks).astype(int)])
        marks.append({"size": words.size(size_mm), "of": len(scores), "scores": kept})
    return marks
