"""How often the leading detector is right: counts with intervals, by size, and the paper's."""

import math
from collections import Counter
from collections.abc import Iterable

import pandas as pd

from capsule import words
from capsule.detectors.verdicts import VerdictWord
from capsule.evaluation.answers import (
    Answers,
    Estimate,
    false_alarms,
    found_and_quiet,
    pooled,
    together,
)
from capsule.evaluation.cross_validation import HELD_OUT, LEAVE_ONE_OUT
from capsule.evaluation.lead import headline_confidence
from capsule.kinds import Cells
from capsule.page.sketches import size_chart
from capsule.page.tables import Tables

# The nodules that are counted together, from a size in mm to below another: small ones are harder.
_SIZES = {"large": (2.0, math.inf), "small": (0.0, 2.0)}
# Highest prevalence of the slider, in percent.
MOST_PREVALENT = 60


def page_values(tables: Tables, ours: Answers) -> Cells:
    """Return the counts of the first screen."""
    lead, scheme = tables.lead, tables.schemes[0]
    confidence = tables.settings["evaluation"]["confidence"]
    level = headline_confidence(lead, scheme, confidence)
    verdicts = tables.verdicts(lead.detector, scheme)
    paper, paper_quiet = found_and_quiet(tables.evaluation.paper["detection"])
    counts = []
    for what, (least_mm, end_mm) in _SIZES.items():
        mine, theirs = (
            {size_mm: each for size_mm, each in found.items() if least_mm <= size_mm < end_mm}
            for found in (ours.found, paper)
        )
        if mine:
            counts.append(
                {
                    "what": what,
                    "sizes": _range(mine),
                    "ours": pooled(tables, verdicts, mine, level),
                    "paper": together([*theirs.values()], confidence),
                    "split": _split(verdicts[verdicts["size_mm"].isin([*mine])]),
                }
            )
    if ours.specificity.of:
        counts.append(
            {
                "what": "alarms",
                "sizes": "",
                "ours": false_alarms(ours.specificity),
                "paper": false_alarms(paper_quiet),
                "split": _split(verdicts[verdicts["size_mm"] == 0]),
            }
        )
    charted = [name for name in (HELD_OUT, LEAVE_ONE_OUT) if name in tables.schemes]
    series = {
        words.scheme(name): found_and_quiet(tables.of(lead.detector, name)["detection"])[0]
        for name in charted or [scheme]
    }
    nodules_mm = [size_mm for size_mm in tables.evaluation.sizes_mm() if size_mm > 0]
    return {
        "counts": counts,
        "chart": size_chart(series | {"paper": paper}, nodules_mm),
    }


def meaning_values(ours: Answers, prevalence: float) -> Cells | None:
    """Return what a verdict means in words, at the configured prevalence and at each of the slider.

    None if the recordings cannot tell.
    """
    if not ours.meaning:
        return None
    ppv, right = ours.meaning
    wrong = Estimate(1 - right.value, 1 - right.high, 1 - right.low, 0, 1)
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
            said[name] = Estimate(value, low, high, hits=0, of=1).in_hundred()
        return said

    slider = {percent: at(percent / 100) for percent in range(1, MOST_PREVALENT + 1)}
    return {"percent": 100 * prevalence, **at(prevalence), "moved": slider}


def _range(sizes_mm: Iterable[float]) -> str:
    first, last = words.size(min(sizes_mm)), words.size(max(sizes_mm))
    return first if first == last else f"{min(sizes_mm):g} to {last}"


def _split(verdicts: pd.DataFrame) -> list[tuple[int, str]]:
    """Return how many were called a nodule and uncertain, the two that count as found."""
    counted = Counter(verdicts["verdict"])
    both = (VerdictWord.NODULE, VerdictWord.UNCERTAIN)
    return [(counted[word], str(word)) for word in both if counted[word]]
