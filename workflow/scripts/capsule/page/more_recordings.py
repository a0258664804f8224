"""Estimate the gain from more recordings: narrower intervals, and better taught detectors."""

from collections.abc import Mapping

import pandas as pd

from capsule import words
from capsule.evaluation.cross_validation import LEAVE_ONE_OUT
from capsule.evaluation.intervals import recordings_needed
from capsule.evaluation.learning import ALL_BUT_ONE, main_ranges
from capsule.evaluation.more_healthy import MoreHealthy, with_more_healthy
from capsule.evaluation.rates import with_clusters
from capsule.kinds import Cells, Row
from capsule.page.cells import plain_cell, rate_cell_of
from capsule.page.rates import Rates, sets_specificity

# Half the width of the interval that the page plans for: +-10 points.
HALF_WIDTH = 0.1
# If the gain's interval ends below this, more recordings are not likely to help.
LEAST_GAIN = 0.05
# Further healthy recordings whose gain is foreseen, and the least gain that is worth telling.
MORE_HEALTHY, LEAST_FORESEEN = 20, 0.01
# The detectors of which this was right on simulated benches (docs/intervals.md), each with the
# share of nodules that it must find already.
FORESEEN_FROM = {"taught": 0.0, "diagonal": 0.5}
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
        ``foreseen`` (from `foreseen_values`), ``more_healthy``, ``needed`` (from
        `needed_rows`), ``learning`` (from `learning_rows`), ``half_width`` and ``least_gain`` in
        points.
    """
    return {
        "foreseen": foreseen_values(rates),
        "more_healthy": MORE_HEALTHY,
        "needed": needed_rows(rates),
        "learning": learning_rows(learning),
        "half_width": f"{100 * HALF_WIDTH:g}",
        "least_gain": f"{100 * LEAST_GAIN:g}",
    }


def foreseen_values(rates: Rates) -> Cells:
    """Return in words what more healthy recordings are expected to find.

    The verdicts by leaving one place out count.

    Returns
    -------
    dict
        ``none``, whether no detector is expected to find more nodules of any size, and
        ``sentences``, each with a ``detector`` and its ``text``. Without a sentence, nothing is
        foreseen.
    """
    wanted = rates.settings["evaluation"]["specificity"]
    named = rates.index.astype(object).where(rates.index.notna(), "").set_index("recording")
    sentences, all_known, any_gain = [], True, False
    for detector in filter(FORESEEN_FROM.__contains__, rates.evaluation.detectors()):
        rows = rates.verdicts(detector, LEAVE_ONE_OUT)
        of_range = _foreseen(with_clusters(rows, named.to_dict("index")), wanted)
        known = {
            title: told
            for title, told in of_range.items()
            if told is not None and told.now >= FORESEEN_FROM[detector]
        }
        gains = [
            title for title, told in known.items() if told.expected - told.now >= LEAST_FORESEEN
        ]
        all_known, any_gain = all_known and len(known) == len(of_range), any_gain or bool(gains)
        clauses = [
            f"{title} {words.percent(known[title].now)} now, "
            f"{words.percent(round(known[title].expected, 2))} then "
            f"({words.interval(round(known[title].low, 2), round(known[title].high, 2))})"
            for title in gains
        ]
        same = [f"{each} {words.percent(known[each].now)}" for each in known if each not in gains]
        clauses += [f"{', '.join(same)}: no gain expected"] if same else []
        if known:
            sentences.append({"detector": detector, "text": f"{'; '.join(clauses)}."})
    return {"none": all_known and not any_gain, "sentences": sentences}


def _foreseen(rows: pd.DataFrame, specificity: float) -> dict[str, MoreHealthy | None]:
    """Return what is foreseen of a detector's verdicts, by the title of a range of sizes."""
    healthy = rows[(rows["size_mm"] == 0) & rows["score"].notna()]
    scores, places = healthy["score"].to_numpy(), healthy["place"].to_numpy()
    foreseen = {}
    for first_mm, last_mm in main_ranges(rows["size_mm"]):
        if last_mm > 0:
            nodules = rows[rows["size_mm"].between(first_mm, last_mm)]
            margins = (nodules["score"] - nodules["threshold"]).to_numpy()
            told = with_more_healthy(scores, places, margins, MORE_HEALTHY, specificity)
            foreseen[_title(first_mm, last_mm)] = told
    return foreseen


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
