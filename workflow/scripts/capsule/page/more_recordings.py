"""Estimate the gain from more recordings: narrower intervals, and better taught detectors."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import pandas as pd

from capsule import words
from capsule.evaluation.cross_validation import LEAVE_ONE_OUT
from capsule.evaluation.intervals import recordings_needed, recordings_needed_within
from capsule.evaluation.learning import ALL_BUT_ONE, main_ranges
from capsule.evaluation.more_healthy import MoreHealthy, with_more_healthy
from capsule.evaluation.rates import with_clusters
from capsule.kinds import Cells, Row
from capsule.page.cells import plain_cell, rate_cell_of
from capsule.page.detector_sections import Rates
from capsule.page.schemes import sets_specificity

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


class Taught(Protocol):
    """A row of the learning table (rates reached with parts of the archive), as pandas gives it."""

    taught: float
    taught_healthy: float


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

    Parameters
    ----------
    rates : Rates
        The rates; the verdicts by leaving one place out count.

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
        gains = [title for title, told in known.items() if _gains(told)]
        all_known, any_gain = all_known and len(known) == len(of_range), any_gain or bool(gains)
        if known:
            sentences.append({"detector": detector, "text": _foreseen_text(known, gains)})
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


def _gains(told: MoreHealthy) -> bool:
    return told.expected - told.now >= LEAST_FORESEEN


def _foreseen_text(known: Mapping[str, MoreHealthy], gains: Sequence[str]) -> str:
    """Return in words the share of nodules found now and then, the gains first."""
    clauses = [
        f"{title} {words.percent(known[title].now)} now, "
        f"{words.percent(round(known[title].expected, 2))} then "
        f"({words.interval(round(known[title].low, 2), round(known[title].high, 2))})"
        for title in gains
    ]
    same = [f"{title} {words.percent(known[title].now)}" for title in known if title not in gains]
    clauses += [f"{', '.join(same)}: no gain expected"] if same else []
    return f"{'; '.join(clauses)}."


def needed_rows(rates: Rates) -> Cells:
    """Return how many recordings each rate needs for its interval, one column per detector.

    Parameters
    ----------
    rates : Rates
        The rates; those of the page's first scheme count.

    Returns
    -------
    dict
        ``detectors``; ``rows`` with ``title``, ``recordings``, ``cells`` and ``missing`` (how many
        more recordings give all detectors' rates the interval); ``sentence``, from
        `_needed_sentence`.
    """
    evaluation, scheme = rates.evaluation, rates.schemes[0]
    confidence = rates.settings["evaluation"]["confidence"]
    detectors = evaluation.detectors()
    by_size: dict[float, list[tuple[int, Row | None]]] = {}
    for detector in detectors:
        of_detector = _rates_of(rates, detector, scheme)
        for size_mm in evaluation.sizes_mm():
            by_size.setdefault(size_mm, []).append(of_detector.get(size_mm, (0, None)))
    rows = []
    for size_mm, each in by_size.items():
        count = max(judged for judged, _ in each)
        needed = [_needed(rate, confidence) for judged, rate in each if judged and rate is not None]
        if count:
            missing = max(max(needed, default=0) - count, 0)
            rows.append(
                {
                    "title": _title(size_mm, size_mm),
                    "size": words.size(size_mm),
                    "recordings": count,
                    "cells": [_needed_cell(judged, rate, confidence) for judged, rate in each],
                    "missing": missing,
                }
            )
    return {
        "detectors": detectors,
        "rows": rows,
        "sentence": _needed_sentence(rows, confidence) if rows else "",
    }


def _needed_sentence(rows: Sequence[Row], confidence: float) -> str:
    """Return a sentence on how many more recordings of each size make all intervals narrow."""
    wanted = f"{words.percent(confidence)} interval of ±{100 * HALF_WIDTH:g} points"
    missing = [f"{row['missing']} of {row['size']}" for row in rows if row["missing"]]
    if not missing:
        return f"Each rate of each detector has a {wanted} or a narrower one."
    listed = words.enumerate_words(missing)
    return f"A {wanted} for each detector needs more recordings: {listed}."


def _rates_of(rates: Rates, detector: str, scheme: str) -> dict[float, tuple[int, Row | None]]:
    """Return a detector's specificity (as size 0) and recalls, each with its recordings counted.

    A specificity that the threshold sets is None.
    """
    tables = rates.of(detector, scheme)
    is_set = sets_specificity(detector, scheme)
    healthy = [
        (0.0, row["healthy"], None if is_set else row)
        for row in tables["specificity"].to_dict("records")
    ]
    nodules = [
        (row["size_mm"], row["tp"] + row["fn"], row)
        for row in tables["detection"].to_dict("records")
    ]
    return {size_mm: (judged, row) for size_mm, judged, row in healthy + nodules}


def _needed_cell(judged: int, row: Row | None, confidence: float) -> Cells:
    if not judged:
        return plain_cell(None, words.UNKNOWN)
    if row is None:
        return plain_cell(None, "set by the threshold")
    name, needed = _name(row), _needed(row, confidence)
    most = recordings_needed_within(row[f"{name}_low"], row[f"{name}_high"], HALF_WIDTH, confidence)
    return rate_cell_of(row, name) | {"count": f"needs {needed}, at most {most}"}


def _needed(row: Row, confidence: float) -> int:
    return recordings_needed(row[_name(row)], HALF_WIDTH, confidence)


def _name(row: Row) -> str:
    return "specificity" if "specificity" in row else "recall"


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
    taught = learning.drop_duplicates("share").sort_values("share")
    shares = [
        {"title": _SHARES[row.share], "taught": _taught(row)}
        for row in taught.itertuples(index=False)
    ]
    rows, sentences = [], []
    for detector, of_detector in learning.groupby("detector", sort=False):
        curves = {}
        for first_mm, last_mm in main_ranges(of_detector["size_from_mm"]):
            of_range = of_detector.query("size_from_mm == @first_mm and size_to_mm == @last_mm")
            curves[_title(first_mm, last_mm)] = {
                row["share"]: row for row in of_range.to_dict("records")
            }
        for title, curve in curves.items():
            cells = [rate_cell_of(curve[share], "rate") for share in taught["share"]]
            row = {"detector": detector, "title": title, "cells": cells}
            rows.append(row | {"gain": _gain_cell(curve[_HALF])})
        sentences.append({"detector": detector, "text": _sentence(curves)})
    return {"shares": shares, "rows": rows, "sentences": sentences}


def _taught(row: Taught) -> str:
    return f"{words.number(row.taught, 0)} ({words.number(row.taught_healthy, 0)})"


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
