"""Estimate the gain from more recordings: narrower intervals, and better taught detectors."""

from collections.abc import Mapping

import pandas as pd

from capsule import words
from capsule.evaluation.intervals import recordings_needed
from capsule.evaluation.learning import ALL_BUT_ONE, main_ranges
from capsule.kinds import Cells, Row
from capsule.page.cells import plain_cell, rate_cell_of
from capsule.page.rates import Rates, sets_specificity

# Half the width of the interval that the page plans for: +-10 points.
HALF_WIDTH = 0.1
# If the gain's interval ends below this, more recordings are not likely to help.
LEAST_GAIN = 0.05
_HALF = 0.5
_SHARES = {0.25: "a quarter", _HALF: "a half", 0.75: "three quarters", ALL_BUT_ONE: "all but one"}


def page_values(rates: Rates, learning: pd.DataFrame) -> Cells:
    """Return the page's values on the number of recordings.

    Parameters
    ----------
    rates : Rates
        The rates.
    learning : DataFrame
        From `capsule.evaluation.learning`.

    Returns
    -------
    dict
        ``needed`` (from `needed_rows`), ``learning`` (from `learning_rows`), ``half_width`` and
        ``least_gain`` in points.
    """
    return {
        "needed": needed_rows(rates),
        "learning": learning_rows(learning),
        "half_width": f"{100 * HALF_WIDTH:g}",
        "least_gain": f"{100 * LEAST_GAIN:g}",
    }


def needed_rows(rates: Rates) -> Cells:
    """Return how many recordings each rate needs for its interval, one column per detector.

    The rates of the page's first scheme count.

    Returns
    -------
    dict
        ``detectors``; ``rows`` with ``title``, ``size``, ``recordings``, ``cells`` and ``missing``
        (how many more recordings give all detectors' rates the interval); ``sentence``, how many
        these are of each size.
    """
    detectors = rates.evaluation.detectors()
    confidence = rates.settings["evaluation"]["confidence"]
    of_each = [_rates_of(rates, detector) for detector in detectors]
    rows = []
    for size_mm in rates.evaluation.sizes_mm():
        made = [_needed(*found.get(size_mm, (0, "", None)), confidence) for found in of_each]
        count = max(judged for judged, _, _ in made)
        if count:
            rows.append(
                {
                    "title": _title(size_mm, size_mm),
                    "size": words.size(size_mm),
                    "recordings": count,
                    "cells": [cell for _, _, cell in made],
                    "missing": max(max(needed for _, needed, _ in made) - count, 0),
                }
            )
    wanted = f"{words.percent(confidence)} interval of ±{100 * HALF_WIDTH:g} points"
    missing = [f"{row['missing']} of {row['size']}" for row in rows if row["missing"]]
    sentence = f"Each rate of each detector has a {wanted} or a narrower one."
    if missing:
        listed = words.enumerate_words(missing)
        sentence = f"A {wanted} for each detector needs more recordings: {listed}."
    return {"detectors": detectors, "rows": rows, "sentence": sentence if rows else ""}


def _rates_of(rates: Rates, detector: str) -> dict[float, tuple[int, str, Row | None]]:
    """Return a detector's specificity (as size 0) and recalls: recordings, name and row of each.

    A specificity that the threshold sets is None.
    """
    scheme = rates.schemes[0]
    tables, is_set = rates.of(detector, scheme), sets_specificity(detector, scheme)
    found: dict[float, tuple[int, str, Row | None]] = {}
    for row in tables["specificity"].to_dict("records"):
        found[0.0] = row["healthy"], "specificity", None if is_set else row
    for row in tables["detection"].to_dict("records"):
        found[row["size_mm"]] = row["tp"] + row["fn"], "recall", row
    return found


def _needed(judged: int, name: str, row: Row | None, confidence: float) -> tuple[int, int, Cells]:
    """Return the recordings of a rate, how many it needs, and its cell."""
    if not judged:
        return judged, 0, plain_cell(None, words.UNKNOWN)
    if row is None:
        return judged, 0, plain_cell(None, "set by the threshold")
    needed = recordings_needed(row[name], HALF_WIDTH, confidence)
    # Of all rates in its interval, the one nearest to one half has the widest interval.
    widest = min(max(0.5, row[f"{name}_low"]), row[f"{name}_high"])
    most = recordings_needed(widest, HALF_WIDTH, confidence)
    return judged, needed, rate_cell_of(row, name, f"needs {needed}, at most {most}")


def learning_rows(learning: pd.DataFrame) -> Cells:
    """Return the learning curves: one row per detector and range of sizes, one column per share.

    Parameters
    ----------
    learning : DataFrame
        From `capsule.evaluation.learning`.

    Returns
    -------
    dict
        ``shares`` (headings with the number of teaching recordings); ``rows`` with ``detector``,
        ``title``, ``cells`` and ``gain``; ``sentences``, each with a ``detector`` and its
        ``text``.
    """
    taught = learning.drop_duplicates("share").sort_values("share").to_dict("records")
    rows, sentences = [], []
    for detector, of_detector in learning.groupby("detector", sort=False):
        curves = {}
        for first_mm, last_mm in main_ranges(of_detector["size_from_mm"]):
            of_range = of_detector.query("size_from_mm == @first_mm and size_to_mm == @last_mm")
            curves[_title(first_mm, last_mm)] = of_range.set_index("share").to_dict("index")
        rows += [
            {
                "detector": detector,
                "title": title,
                "cells": [rate_cell_of(curve[row["share"]], "rate") for row in taught],
                "gain": _gain_cell(curve[_HALF]),
            }
            for title, curve in curves.items()
        ]
        sentences.append({"detector": detector, "text": _sentence(curves)})
    shares = [
        {
            "title": _SHARES[row["share"]],
            "taught": f"{words.number(row['taught'], 0)} "
            f"({words.number(row['taught_healthy'], 0)})",
        }
        for row in taught
    ]
    return {"shares": shares, "rows": rows, "sentences": sentences}


def _gain_cell(half: Row) -> Cells:
    if not words.is_known(half["gain"]):
        return plain_cell(None, words.UNKNOWN)
    low, high = (words.points(half[f"gain_{end}"]) for end in ("low", "high"))
    return plain_cell(float(half["gain"]), words.points(half["gain"]), f"{low} to {high}")


def _advice(half: Row) -> str:
    """Return in words whether more recordings are likely to help, from the gain since half."""
    if half["gain_low"] > 0:
        return "more recordings are likely to help"
    if half["gain_high"] < LEAST_GAIN:
        return "more recordings are not likely to help"
    return "this can be chance; too few recordings to tell"


def _sentence(curves: Mapping[str, Mapping[float, Row]]) -> str:
    """Return in words what a detector reaches with half of the archive and with all but one."""
    by_advice: dict[str, list[str]] = {}
    for title, curve in curves.items():
        if words.is_known(curve[_HALF]["gain"]):
            half, last = (words.percent(curve[share]["rate"]) for share in (_HALF, ALL_BUT_ONE))
            by_advice.setdefault(_advice(curve[_HALF]), []).append(f"{title} {half} and {last}")
    clauses = [f"{', '.join(rates)}: {advice}" for advice, rates in by_advice.items()]
    return f"{'; '.join(clauses)}." if clauses else "nothing to compare yet."


def _title(first_mm: float, last_mm: float) -> str:
    if last_mm == 0:
        return "specificity"
    if first_mm == last_mm:
        return f"found at {words.size(first_mm)}"
    return f"found from {words.size(first_mm)} on"
