"""How often the leading detector is right: counts with intervals, by size, and the paper's."""

from collections import Counter
from collections.abc import Mapping, Sequence

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
from capsule.evaluation.archive_rates import Rates
from capsule.evaluation.cross_validation import HELD_OUT, LEAVE_ONE_OUT
from capsule.evaluation.lead import Lead, headline_confidence
from capsule.kinds import Cells
from capsule.page.sketches import size_chart

# Nodules below this are counted apart: they are harder to find.
LARGE_FROM_MM = 2.0


def page_values(rates: Rates, ours: Answers, lead: Lead) -> Cells:
    """Return the counts of the first screen."""
    scheme, confidence = rates.schemes[0], rates.settings["evaluation"]["confidence"]
    level = headline_confidence(lead, scheme, confidence)
    verdicts = rates.verdicts(lead.detector, scheme)
    paper, paper_quiet = found_and_quiet(rates.evaluation.paper["detection"])
    counts = []
    for what, some in (("large", _large), ("small", _small)):
        mine = {size: each for size, each in ours.found.items() if some(size)}
        if mine:
            counts.append(
                {
                    "what": what,
                    "sizes": _range(list(mine)),
                    "ours": pooled(rates, verdicts, mine, level),
                    "paper": together(
                        [each for size, each in paper.items() if some(size)], confidence
                    ),
                    "split": _split(verdicts[verdicts["size_mm"].isin(list(mine))]),
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
    sizes_mm = [size for size in rates.evaluation.sizes_mm() if size > 0]
    series = [(words.scheme(name), _found(rates, lead.detector, name)) for name in _charted(rates)]
    series.append(("paper", paper))
    return {
        "counts": counts,
        "chart": size_chart(
            [{"name": name, "rates": _points(found, sizes_mm)} for name, found in series],
            [words.size(size) for size in sizes_mm],
        ),
        "chart_series": [
            (name, [found[size].text() if size in found else words.NOT_GIVEN for size in sizes_mm])
            for name, found in series
        ],
        "chart_sizes": [words.size(size) for size in sizes_mm],
        "chart_confidence": words.percent(level),
    }


def meaning_values(ours: Answers, prevalence: float) -> Cells:
    """Return what a verdict means at the configured prevalence, and what the slider needs.

    Both are None if the recordings cannot tell.
    """
    if not ours.meaning:
        return {"meaning": None, "missed": None}
    ppv, npv = (
        [each.value, each.low, each.high]
        if words.is_known(each.value) and words.is_known(each.low)
        else None
        for each in ours.meaning
    )
    right = ours.meaning[1]
    missed = Estimate(1 - right.value, 1 - right.high, 1 - right.low, 0, 1)
    return {"meaning": {"prevalence": prevalence, "ppv": ppv, "npv": npv}, "missed": missed}


def _large(size_mm: float) -> bool:
    return size_mm >= LARGE_FROM_MM


def _small(size_mm: float) -> bool:
    return 0 < size_mm < LARGE_FROM_MM


def _range(sizes_mm: Sequence[float]) -> str:
    first, last = words.size(min(sizes_mm)), words.size(max(sizes_mm))
    return first if first == last else f"{min(sizes_mm):g} to {last}"


def _split(verdicts: pd.DataFrame) -> list[tuple[int, str]]:
    """Return how many were called a nodule and uncertain, the two that count as found."""
    counted = Counter(verdicts["verdict"])
    both = (VerdictWord.NODULE, VerdictWord.UNCERTAIN)
    return [(counted[word], str(word)) for word in both if counted[word]]


def _charted(rates: Rates) -> list[str]:
    schemes = [name for name in (HELD_OUT, LEAVE_ONE_OUT) if name in rates.schemes]
    return schemes or rates.schemes[:1]


def _found(rates: Rates, detector: str, scheme: str) -> dict[float, Estimate]:
    found, _ = found_and_quiet(rates.of(detector, scheme)["detection"])
    return found


def _points(
    found: Mapping[float, Estimate], sizes_mm: Sequence[float]
) -> list[tuple[float, float, float] | None]:
    return [
        (each.value, each.low, each.high)
        if (each := found.get(size)) and words.is_known(each.low)
        else None
        for size in sizes_mm
    ]
