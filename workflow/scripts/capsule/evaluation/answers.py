"""Say what a detector achieves on these recordings, and what more of them would bring."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
import pandas as pd

from capsule import words
from capsule.evaluation.archive_rates import Lead, Rates, headline_confidence, sets_specificity
from capsule.evaluation.confounded import in_words
from capsule.evaluation.intervals import (
    ONE_SIDED,
    new_specificity,
    normal_quantile,
    rate,
    recordings_needed,
)
from capsule.evaluation.learning import ALL_BUT_ONE, main_ranges
from capsule.evaluation.rates import of_any, of_each, rate_over
from capsule.kinds import Row

NO_INTERVAL = "no interval: fewer than three places"
# Half the width of the interval that the page plans for: +-10 points.
HALF_WIDTH = 0.1
# If the gain's interval ends below this, more recordings are not likely to help.
LEAST_GAIN = 0.05
_HALF = 0.5
UNKNOWN = float("nan")


@dataclass(frozen=True)
class Estimate:
    """A value with the bounds of its interval; NaN if there is nothing to count.

    `hits` and `of` are the counts behind a rate; 0 if none stand behind it.
    `at_least` is the one-sided lower bound of a rate; NaN if the table has none.
    """

    value: float
    low: float
    high: float
    hits: int = 0
    of: int = 0
    at_least: float = UNKNOWN

    def text(self) -> str:
        """Return a rate with its interval in words."""
        if not words.is_known(self.value):
            return words.UNKNOWN
        return f"{words.percent(self.value)} ({self.bounds()})"

    def bounds(self) -> str:
        """Return the interval of a rate in words, or that there is none."""
        return words.interval(self.low, self.high) if words.is_known(self.low) else NO_INTERVAL

    def count(self) -> str:
        """Return the counts in words."""
        return words.count_of(self.hits, self.of)

    def in_hundred(self) -> tuple[str, str]:
        """Return a share in 100, and the range of the share in 100 in words."""
        value, low, high = map(_hundred, (self.value, self.low, self.high))
        return value, f"{low} to {high}" if words.is_known(self.low) else NO_INTERVAL


@dataclass(frozen=True)
class SetSpecificity:
    """A specificity that the threshold sets, and that no recording measures.

    The threshold aims at the wanted one, which needs `least_places` healthy places that teach. The
    ends are from `capsule.evaluation.intervals.new_specificity`. The mean is the wanted
    specificity; with too few places, what such a threshold has on average.
    """

    wanted: float
    places: int
    least_places: int
    low: float
    high: float
    mean: float

    def cannot(self) -> bool:
        """Return whether too few healthy places teach to promise the wanted specificity."""
        return self.places < self.least_places

    def text(self) -> str:
        """Return what the specificity is, and what new places of this bench may expect."""
        promise = f"The threshold rests on {words.plural(self.places, 'healthy place')}."
        if self.cannot():
            promise = (
                f"{words.percent(self.wanted)} cannot be promised: this takes {self.least_places} "
                f"healthy places, and this archive has {self.places}. The threshold is their "
                "highest score."
            )
        return (
            f"{promise} New places of this bench may expect a specificity of "
            f"{words.interval(self.low, self.high)} (central 90 %; approximate, because scores are "
            "cross-validated). Of a new patient, only held-out set-ups tell."
        )


@dataclass(frozen=True)
class Answers:
    """The results of a detector on these recordings, by one scheme.

    Attributes
    ----------
    scheme : str
        The scheme.
    found : dict of float to Estimate
        The share of the nodules of each judged size that is found, by size in mm, ascending.
    smallest_mm : float or None
        From `smallest_reliable_size`; None without a recording of no nodule.
    specificity : Estimate
        Share of the recordings without a nodule that have this verdict.
    set_specificity : SetSpecificity or None
        Set if the threshold sets the specificity, so that `specificity` says nothing.
    meaning : (Estimate, Estimate) or None
        Positive and negative predictive value, over the sizes of the archive. None if there is no
        recording without a nodule, or none with one.
    confounded : str
        What follows from the header in the recordings that teach, from
        `capsule.evaluation.confounded.in_words`. If anything does, nothing is reliably found.
    quiet : float
        Lower bound of the specificity.
    """

    scheme: str
    found: dict[float, Estimate]
    smallest_mm: float | None
    specificity: Estimate
    set_specificity: SetSpecificity | None
    meaning: tuple[Estimate, Estimate] | None
    confounded: str
    quiet: float

    def not_reliable(self, level: float) -> str:
        """Return why no size is reliably found, if so; empty if one is."""
        if self.smallest_mm is not None or not self.found:
            return ""
        if not self.quiet >= level:
            known = (
                f"is {words.percent(self.quiet)}" if words.is_known(self.quiet) else "is missing"
            )
            return f"the lower bound of the specificity {known}"
        most, needed = max(each.of for each in self.found.values()), recordings_to_show(level)
        if most < needed:
            return f"{words.plural(most, 'recording')} of a size; it takes {needed}, all found"
        return "the lower bound of the sensitivity of the largest size is lower"


def answers_of(rates: Rates, detector: str, scheme: str, lead: Lead | None = None) -> Answers:
    """Return a detector's results by one scheme.

    The intervals of the leading detector, if it is given, are corrected for having been chosen.
    """
    rules, reliable_rate = rates.settings["evaluation"], rates.settings["report"]["reliable_rate"]
    tables, level = rates.of(detector, scheme), rules["confidence"]
    if lead and lead.detector == detector:
        level = headline_confidence(lead, scheme, level)
    if level != rules["confidence"]:
        tables = rates.at(detector, scheme, level)
    set_by = set_specificity(rates, scheme) if sets_specificity(detector, scheme) else None
    found, specificity = found_and_quiet(tables["detection"])
    quiet = specificity.at_least if set_by is None else set_by.low
    confounded = in_words(rates.confounded)

    return Answers(
        scheme=scheme,
        found=found,
        smallest_mm=(None if confounded else smallest_reliable_size(found, quiet, reliable_rate)),
        specificity=specificity,
        set_specificity=set_by,
        meaning=None if confounded else _meaning(tables["summary"], set_by),
        confounded=confounded,
        quiet=quiet,
    )


def set_specificity(rates: Rates, scheme: str) -> SetSpecificity | None:
    """Return what a threshold at a rank of healthy places promises; None without such a place."""
    rules, places = rates.settings["evaluation"], rates.healthy_places(scheme)
    if not places:
        return None
    wanted = rules["specificity"]
    low, high = new_specificity(places, wanted)
    # As few as reach it on average: the mean of Beta(n, 1) is n / (n + 1).
    least = ceil(wanted / (1 - wanted) - 1e-9)
    mean = wanted if places >= least else places / (places + 1)
    return SetSpecificity(wanted, places, least, low, high, mean)


def found_and_quiet(detection: pd.DataFrame) -> tuple[dict[float, Estimate], Estimate]:
    """Return how often the nodules of each judged size are found, ascending, and the specificity.

    The table of detection of one detector and scheme has counts and recall per size; that of 0 mm
    is the specificity.
    """
    rows = detection[detection["tp"] + detection["fn"] > 0].sort_values("size_mm")
    found = {
        float(row["size_mm"]): _estimate(row, "recall", row["tp"], row["tp"] + row["fn"])
        for row in rows.to_dict("records")
    }
    specificity = found.pop(0.0, Estimate(UNKNOWN, UNKNOWN, UNKNOWN))
    return found, specificity


def recordings_to_show(level: float) -> int:
    """Return how many recordings, all with the right verdict, have this lower bound.

    That of n of n recordings is ``n / (n + z^2)``.
    """
    square = normal_quantile(2 * ONE_SIDED - 1) ** 2
    return ceil(square * level / (1 - level))


def _meaning(
    summary: pd.DataFrame, set_by: SetSpecificity | None
) -> tuple[Estimate, Estimate] | None:
    """Return the predictive values over all sizes.

    Where the threshold sets the specificity, they follow from the set one (Bayes' rule). Their
    ranges follow from the specificity that new places of this bench may expect together with the
    interval of the sensitivity, each at the same end.
    """
    rows = of_any(summary)
    if rows.empty:
        return None
    row = rows.iloc[0]
    if set_by is None:
        ppv, npv = (_estimate(row, name) for name in ("ppv", "npv"))
    else:
        ends = (("", set_by.mean), ("_low", set_by.low), ("_high", set_by.high))
        value, low, high = (
            predictive_values(float(row[f"sensitivity{end}"]), each, float(row["prevalence"]))
            for end, each in ends
        )
        ppv, npv = (Estimate(value[n], low[n], high[n]) for n in (0, 1))
    return (ppv, npv) if ppv.value >= 0 or npv.value >= 0 else None


def predictive_values(
    sensitivity: float, specificity: float, prevalence: float
) -> tuple[float, float]:
    """Return positive and negative predictive value by Bayes' rule; NaN without such a verdict."""
    right, alarms = sensitivity * prevalence, (1 - specificity) * (1 - prevalence)
    quiet, missed = specificity * (1 - prevalence), (1 - sensitivity) * prevalence
    return (
        right / (right + alarms) if right + alarms else UNKNOWN,
        quiet / (quiet + missed) if quiet + missed else UNKNOWN,
    )


def smallest_reliable_size(
    found: dict[float, Estimate], specificity: float, level: float
) -> float | None:
    """Return the smallest size in mm from which every size is reliably found.

    The sizes found are ascending, and each lower bound must reach the level at that size and every
    larger one. So must `specificity`, its lower bound: without it, a detector that reports a nodule
    everywhere would find every size. None if not even the largest size is reliably found, or if a
    bound is not known.
    """
    smallest = None
    # A comparison with NaN is false: an unknown rate is not reliable.
    if not specificity >= level:
        return smallest
    for size_mm in reversed(found):
        if not found[size_mm].at_least >= level:
            break
        smallest = size_mm
    return smallest


def pooled(
    rates: Rates, verdicts: pd.DataFrame, found: Mapping[float, Estimate], level: float
) -> Estimate:
    """Return how many nodules of the found sizes are found, with an interval over their set-ups."""
    tolerance_mm = rates.settings["evaluation"]["tolerance_mm"]
    ((_, rows),) = of_each(verdicts, tolerance_mm, rates.accepted_rows())
    some = rows[np.isin(rows["size_mm"], [*found])]
    hits, of = (sum(getattr(each, name) for each in found.values()) for name in ("hits", "of"))
    return Estimate(*rate_over(some, level), hits, of)


def together(estimates: Sequence[Estimate], level: float) -> Estimate | None:
    """Return the rate of several counts together; None if nothing was counted."""
    hits, of = (sum(getattr(each, name) for each in estimates) for name in ("hits", "of"))
    return Estimate(*rate(hits, of, level), hits, of) if of else None


def false_alarms(quiet: Estimate) -> Estimate:
    """Return the false alarms that a specificity leaves."""
    return Estimate(1 - quiet.value, 1 - quiet.high, 1 - quiet.low, quiet.of - quiet.hits, quiet.of)


def _estimate(row: Row, name: str, hits: float = 0, of: float = 0) -> Estimate:
    value, low, high = (float(row[column]) for column in (name, f"{name}_low", f"{name}_high"))
    at_least = float(row.get(f"{name}_at_least", "nan"))
    return Estimate(value, low, high, int(hits), int(of), at_least)


def _hundred(share: float) -> str:
    """Return a share in 100; with a decimal near 0 and 100, which it never reaches by rounding."""
    count = 100 * share
    if 1.5 <= count < 98.5 or count in (0, 100):
        return words.number(count, 0)
    return words.probability(share).removesuffix(" %")


def more_recordings(rates: Rates, learning: pd.DataFrame, detector: str) -> str:
    """Return a detector's two sentences on more recordings; empty ones are left out."""
    said = [needed_sentence(rates, detector), learning_sentence(learning, detector)]
    return " ".join(filter(None, said))


def needed_sentence(rates: Rates, detector: str) -> str:
    """Return how many more recordings of each size give its rate the planned interval.

    The rates of the page's first scheme count; a specificity that the threshold sets does not.
    """
    confidence, scheme = rates.settings["evaluation"]["confidence"], rates.schemes[0]
    rows = rates.of(detector, scheme)["detection"]
    if sets_specificity(detector, scheme):
        rows = rows[rows["size_mm"] > 0]
    more = {
        row["size_mm"]: recordings_needed(row["recall"], HALF_WIDTH, confidence) - of
        for row in rows.to_dict("records")
        if (of := row["tp"] + row["fn"])
    }
    if not more:
        return ""
    wanted = f"{words.percent(confidence)} interval of ±{100 * HALF_WIDTH:g} points"
    missing = [f"{count} of {words.size(size)}" for size, count in more.items() if count > 0]
    if not missing:
        return f"Each rate has a {wanted} or a narrower one."
    return f"A {wanted} needs more recordings: {words.enumerate_words(missing)}."


def learning_sentence(learning: pd.DataFrame, detector: str) -> str:
    """Return whether more recordings are likely to teach a detector more; empty if not known.

    It compares what the detector reaches with half of the archive and with all but one.
    """
    of_detector = learning[learning["detector"] == detector]
    by_advice: dict[str, list[str]] = {}
    for first_mm, last_mm in main_ranges(of_detector["size_from_mm"]):
        of_range = of_detector.query("size_from_mm == @first_mm and size_to_mm == @last_mm")
        curve = of_range.set_index("share").to_dict("index")
        if words.is_known(curve[_HALF]["gain"]):
            half, last = (words.percent(curve[share]["rate"]) for share in (_HALF, ALL_BUT_ONE))
            reached = f"{_range_title(first_mm, last_mm)} {half} and {last}"
            by_advice.setdefault(_advice(curve[_HALF]), []).append(reached)
    said = "; ".join(f"{', '.join(rates)}: {advice}" for advice, rates in by_advice.items())
    judged = "Judged on the recordings that teach, with half of them and all but one"
    return f"{judged}: {said}." if said else ""


def _advice(half: Row) -> str:
    """Return in words whether more recordings are likely to help, from the gain since half."""
    if half["gain_low"] > 0:
        return "more recordings are likely to help"
    if half["gain_high"] < LEAST_GAIN:
        return "more recordings are not likely to help"
    return "this can be chance; too few recordings to tell"


def _range_title(first_mm: float, last_mm: float) -> str:
    if last_mm == 0:
        return "specificity"
    if first_mm == last_mm:
        return f"found at {words.size(first_mm)}"
    return f"found from {words.size(first_mm)} on"
