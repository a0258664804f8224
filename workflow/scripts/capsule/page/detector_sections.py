"""Collect what the page says of the leading detector: how often it is right, and its methods."""

import math
from collections import Counter
from collections.abc import Sequence

import pandas as pd

from capsule import words
from capsule.detectors.registry import PAPER, detector_row
from capsule.detectors.verdicts import VerdictWord
from capsule.evaluation import paper
from capsule.evaluation.answers import (
    Answers,
    Estimate,
    answers_of,
    false_alarms,
    found_and_quiet,
    pooled,
    set_specificity,
    together,
)
from capsule.evaluation.archive_rates import Rates, headline_confidence, table_note
from capsule.evaluation.columns import RATES
from capsule.evaluation.cross_validation import HELD_OUT, LEAVE_ONE_OUT
from capsule.kinds import Cells
from capsule.page.cells import plain_cell, rate_table
from capsule.page.recordings import known_or_none
from capsule.page.sketches import size_chart
from capsule.page.tables import Tables
from capsule.recordings.origin import origin_of

# The nodules that are counted together, from a size in mm to below another: small ones are harder.
_SIZES = {"large": (2.0, math.inf), "small": (0.0, 2.0)}
# Highest prevalence of the slider, in percent.
MOST_PREVALENT = 60


def page_values(tables: Tables) -> Cells:
    """Return the page's values from the detectors' rates."""
    scheme, lead, detector = tables.schemes[0], tables.lead, tables.lead.detector
    judged, _ = tables.recordings(scheme)
    rules, reliable = tables.settings["evaluation"], tables.settings["report"]["reliable_rate"]
    level = headline_confidence(lead, scheme, rules["confidence"])
    drawn = [f"{name} ({words.scheme(scheme)})" for name in dict.fromkeys([detector, PAPER])]
    ours = answers_of(tables, detector, scheme, lead)
    return {
        "ours": ours,
        "not_reliable": ours.not_reliable(reliable),
        "first": _first_screen(tables, ours, level),
        "meaning": meaning_values(ours, rules["prevalence"]),
        "held_out": scheme == HELD_OUT,
        **_by_size(tables, detector, scheme),
        "lead": lead,
        "scheme": words.scheme(scheme),
        "headline_confidence": words.percent(level),
        "judged_origin": origin_of(judged["source"].fillna("")).kind,
        "sizes": [words.size(size_mm) for size_mm in tables.evaluation.sizes_mm()],
        "threshold": set_specificity(tables, scheme),
        "rates_hold": table_note(tables),
        "figure_series": words.enumerate_words([*drawn, "the paper"]),
        "methods": _methods(tables, ours),
    }


def _first_screen(tables: Tables, ours: Answers, level: float) -> Cells:
    """Return the counts of the first screen, ours with intervals of a level, and its chart."""
    detector, scheme = tables.lead.detector, tables.schemes[0]
    confidence = tables.settings["evaluation"]["confidence"]
    verdicts = tables.verdicts(detector, scheme)
    found, quiet = found_and_quiet(tables.evaluation.paper["detection"])
    counts = []
    for what, (least_mm, end_mm) in _SIZES.items():
        mine, theirs = (
            {size_mm: rate for size_mm, rate in rates.items() if least_mm <= size_mm < end_mm}
            for rates in (ours.found, found)
        )
        if mine:
            rate = pooled(tables, verdicts, mine, level)
            beside = together([*theirs.values()], confidence)
            counts.append(_count(what, verdicts, [*mine], rate, beside))
    if ours.specificity.of:
        rate, beside = false_alarms(ours.specificity), false_alarms(quiet)
        counts.append(_count("alarms", verdicts, [0.0], rate, beside))
    charted = [name for name in (HELD_OUT, LEAVE_ONE_OUT) if name in tables.schemes]
    series = {
        words.scheme(name): found_and_quiet(tables.of(detector, name)["detection"])[0]
        for name in charted or [scheme]
    }
    nodules_mm = tables.evaluation.sizes_mm()[1:]
    return {"counts": counts, "chart": size_chart(series | {"paper": found}, nodules_mm)}


def _count(
    what: str,
    verdicts: pd.DataFrame,
    sizes_mm: Sequence[float],
    ours: Estimate,
    beside: Estimate | None,
) -> Cells:
    """Return a count of recordings of some sizes, beside the paper's.

    ``split`` tells how many were called a nodule and uncertain, the two that count as found.
    """
    called = Counter(verdicts.loc[verdicts["size_mm"].isin(sizes_mm), "verdict"])
    both = (VerdictWord.NODULE, VerdictWord.UNCERTAIN)
    first, last = words.size(sizes_mm[0]), words.size(sizes_mm[-1])
    return {
        "what": what,
        "sizes": first if first == last else f"{sizes_mm[0]:g} to {last}",
        "ours": ours,
        "paper": beside,
        "split": [(called[word], str(word)) for word in both if called[word]],
    }


def meaning_values(ours: Answers, prevalence: float) -> Cells | None:
    """Return what a verdict means in words, at the configured prevalence and at each of the slider.

    None if the recordings cannot tell.
    """
    if not ours.meaning:
        return None
    ppv, right = ours.meaning
    wrong = Estimate(1 - right.value, 1 - right.high, 1 - right.low)
    known = {
        name: each
        for name, each in (("ppv", ppv), ("npv", wrong))
        if words.is_known(each.value) and words.is_known(each.low)
    }

    def at(other: float) -> Cells:
        # Odds after a verdict are odds before it times a ratio that does not change.
        ratio = other / (1 - other) * (1 - prevalence) / prevalence
        said = {}
        for name, each in known.items():
            shares = (each.value, each.low, each.high)
            value, low, high = (ratio * share / (1 - share + ratio * share) for share in shares)
            said[name] = Estimate(value, low, high).in_hundred()
        return said

    slider = {percent: at(percent / 100) for percent in range(1, MOST_PREVALENT + 1)}
    return {"percent": 100 * prevalence, **at(prevalence), "moved": slider}


def _by_size(rates: Rates, detector: str, scheme: str) -> Cells:
    """Return a detector's confusions and rates by one scheme, the rates beside the paper's."""
    sizes_mm = rates.evaluation.sizes_mm()
    tolerance_mm = rates.settings["evaluation"]["tolerance_mm"]
    ours, printed = rates.of(detector, scheme), rates.evaluation.paper
    tables = {name: pd.concat([ours[name], printed[name]], ignore_index=True) for name in RATES}
    points = [paper.detection_points(tables["detection"]), paper.sizing_points(tables["sizing"])]
    measures = {"precision": "Precision", "recall": "Recall"}
    measures |= {"exact_rate": "Exact size", "within_rate": f"Within {tolerance_mm:g} mm"}
    by_size = rate_table(pd.concat(points), measures, sizes_mm[1:])
    by_size["heads"].append(f"Mean absolute error, {words.scheme(scheme)}")
    errors_mm = ours["sizing"].set_index("size_mm")["mean_absolute_error_mm"].astype(float)
    for row in by_size["rows"]:
        error_mm = known_or_none(errors_mm.get(row["size_mm"]))
        text = words.UNKNOWN if error_mm is None else f"{words.number(error_mm)} mm"
        row["cells"].append(plain_cell(error_mm, text, scheme=scheme))
    return {
        "confusion": confusion_rows(ours["confusion"], sizes_mm),
        "rates": by_size,
        "negatives": rate_table(
            paper.negative_points(tables["confusion"]), {"classified": "Share"}, sizes_mm
        ),
    }


def confusion_rows(confusion: pd.DataFrame, sizes_mm: Sequence[float]) -> list[Cells]:
    """Return the counts of verdicts: one row per true size, one cell per predicted size.

    A further cell counts the recordings without a verdict, if there are any. A cell has its
    ``count``, its ``share`` of the row in quarters (for its shade), and whether it is ``right``.
    """
    counts = {
        (row.size_mm, known_or_none(row.predicted_mm)): int(row.count)
        for row in confusion.itertuples(index=False)
    }
    silent = any(count for (_, predicted), count in counts.items() if predicted is None)
    verdicts = [*sizes_mm, None] if silent else sizes_mm
    rows = []
    for actual in sizes_mm:
        row = {predicted: counts.get((actual, predicted), 0) for predicted in verdicts}
        total = sum(row.values())
        cells = [
            {"count": count, "share": round(4 * count / (total or 1)), "right": actual == predicted}
            for predicted, count in row.items()
        ]
        rows.append({"size": words.size(actual), "cells": cells, "total": total})
    return rows


def _methods(rates: Rates, ours: Answers) -> Cells:
    """Return what workflow/report/sections/methods.html.j2 says in lists of words."""
    judging = list(map(detector_row, rates.settings["detectors"]))
    thresholds = {
        row.name: _threshold(rates.verdicts(row.name, ours.scheme)["threshold"].dropna())
        for row in judging
        if row.fixed_threshold is None
    }
    return {
        "detectors": [
            f"{row.name} ({row.sentence}{thresholds.get(row.name, '')})" for row in judging
        ],
        "learned": bool(thresholds),
        "bounded": rates.evaluation.predictions["estimate_low_mm"].notna().any(),
    }


def _threshold(known: pd.Series) -> str:
    """Return a learned threshold with its range over the folds; empty if it is not known."""
    if known.empty:
        return ""
    low, high = (words.significant(float(end)) for end in (known.min(), known.max()))
    return f"; threshold {low}" if low == high else f"; threshold {low} to {high} over the folds"
