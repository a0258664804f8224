"""Write in words how far to trust a verdict, from the archive's labelled recordings."""

import pandas as pd

from capsule import words
from capsule.evaluation.rates import rate
from capsule.page.answers import Estimate

_SAME_BENCH = " These rates hold for recordings of the same bench and capsule only."
_ORIGINS = {
    "simulated": (
        " The labelled recordings are simulated: these rates do not hold for a real capsule."
    ),
    "mixed": (
        " Some of the labelled recordings are simulated: these rates hold for no single bench."
    ),
}


def trust_words(verdicts: pd.DataFrame, scheme: str, confidence: float, origin: str) -> str:
    """Return a sentence on how often a detector is right on labelled recordings.

    Parameters
    ----------
    verdicts : DataFrame
        ``size_mm`` and ``predicted_mm`` of the detector with one scheme.
    scheme : str
        The scheme.
    confidence : float
        Level of the intervals.
    origin : str
        Kind of the labelled recordings' origin, from `capsule.page.provenance.Origin`.
    """
    judged = verdicts[verdicts["predicted_mm"].notna()]
    nodules, healthy = judged[judged["size_mm"] > 0], judged[judged["size_mm"] == 0]
    if judged.empty:
        return (
            "This archive cannot show how far to trust a verdict, because no labelled recording "
            "was judged."
        )
    clauses = []
    if not nodules.empty:
        sizes_mm = sorted(nodules["size_mm"].unique())
        found = _estimate(nodules["predicted_mm"] > 0, confidence)
        clauses.append(f"it found {_of(found)} nodules of {_range(sizes_mm)} ({_rate(found)}")
        smallest = nodules[nodules["size_mm"] == sizes_mm[0]]
        if len(sizes_mm) > 1:
            of_smallest = words.count_of((smallest["predicted_mm"] > 0).sum(), len(smallest))
            clauses[-1] += f"; of {words.size(sizes_mm[0])}: {of_smallest}"
        clauses[-1] += ")"
    if not healthy.empty:
        quiet = _estimate(healthy["predicted_mm"] == 0, confidence)
        clauses.append(
            f"it reported none in {_of(quiet)} recordings without a nodule (specificity "
            f"{_rate(quiet)})"
        )
    sentence = f"On this archive, by {words.scheme(scheme)}, {' and '.join(clauses)}."
    return sentence + _ORIGINS.get(origin, _SAME_BENCH)


def _estimate(right: pd.Series, confidence: float) -> Estimate:
    hits, of = int(right.sum()), len(right)
    return Estimate(*rate(hits, of, confidence), hits, of)


def _of(estimate: Estimate) -> str:
    return words.count_of(estimate.hits, estimate.of)


def _rate(estimate: Estimate) -> str:
    return f"{words.percent(estimate.value)}, {words.interval(estimate.low, estimate.high)}"


def _range(sizes_mm: list[float]) -> str:
    if len(sizes_mm) == 1:
        return words.size(sizes_mm[0])
    return f"{sizes_mm[0]:g} to {words.size(sizes_mm[-1])}"
