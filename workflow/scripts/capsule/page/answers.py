"""Compute the answers of the first screen: what a detector achieves on these recordings.

The sentences around them are in workflow/report/sections/answer.html.j2, and in what it includes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil

import pandas as pd

from capsule import words
from capsule.evaluation.confounded import in_words
from capsule.evaluation.intervals import (
    ONE_SIDED,
    new_specificity,
    normal_quantile,
    rate,
    recordings_needed,
)
from capsule.evaluation.lead import Lead, headline_confidence
from capsule.kinds import Row, Settings
from capsule.page.rates import Rates, Scope, sets_specificity

# A specificity is called measured well enough with an interval of +-5 points.
HALF_WIDTH = 0.05
NO_INTERVAL = "no interval: fewer than three places"
UNKNOWN = float("nan")


@dataclass(frozen=True)
class Estimate:
    """A value with its interval; NaN if there is nothing to count.

    Attributes
    ----------
    value, low, high : float
        The value and the bounds of its interval.
    hits, of : int
        The counts behind a rate; for a mean, ``of`` is the number of values.
    at_least : float
        The one-sided lower bound of a rate; NaN if the table has none.
    """

    value: float
    low: float
    high: float
    hits: int
    of: int
    at_least: float = UNKNOWN

    def text(self) -> str:
        """Return a rate with its interval in words."""
        return f"{words.percent(self.value)} ({self.bounds()})" if self.of else words.UNKNOWN

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

    Attributes
    ----------
    wanted : float
        The specificity at which the threshold aims.
    places, least_places : int
        Number of healthy places that teach, and the number that the wanted specificity needs.
    low, high : float
        From `capsule.evaluation.intervals.new_specificity`.
    mean : float
        The wanted specificity; with too few places, what such a threshold has on average.
    needed : int
        How many healthy recordings would measure the wanted specificity to +-`half_width`.
    half_width : float
        Half the width of an interval that counts as measured.
    """

    wanted: float
    places: int
    least_places: int
    low: float
    high: float
    mean: float
    needed: int
    half_width: float = HALF_WIDTH

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

    def aim(self) -> tuple[str, str]:
        """Return the verbs for an aim that a threshold reaches on average, or cannot promise."""
        return ("meant for", "aims at") if self.cannot() else ("set for", "set to")


@dataclass(frozen=True)
class Answers:
    """The results of a detector on these recordings, by one scheme.

    Attributes
    ----------
    scheme : str
        The scheme.
    found : dict of float to Estimate
        The share of the nodules of each judged size that is found, by size in mm, ascending.
    any_size : Estimate
        The share of all nodules that is found.
    smallest_mm : float or None
        From `smallest_reliable_size`; None without a recording of no nodule.
    healthy_wanting : bool
        Whether only a recording without a nodule is missing for a size to be reliably found.
        Without one, a detector that reports a nodule everywhere looks like a good detector.
    specificity : Estimate
        Share of the recordings without a nodule that have this verdict.
    set_specificity : SetSpecificity or None
        Set if the threshold sets the specificity, so that `specificity` says nothing.
    meaning : (Estimate, Estimate) or None
        Positive and negative predictive value, over the sizes of the archive. None if there is no
        recording without a nodule, or none with one.
    nodules, healthy : Scope
        For which recordings the rates of nodules and of healthy recordings hold.
    within : Estimate
        Share of the recordings of nodules whose size is right within the tolerance.
    size_error_mm : Estimate
        From `size_error`.
    unlike : int
        Number of these recordings that are unlike those that teach.
    confounded : str
        What follows from the header in the recordings that teach, from
        `capsule.evaluation.confounded.in_words`. If anything does, nothing is reliably found.
    """

    scheme: str
    found: dict[float, Estimate]
    any_size: Estimate
    smallest_mm: float | None
    healthy_wanting: bool
    specificity: Estimate
    set_specificity: SetSpecificity | None
    meaning: tuple[Estimate, Estimate] | None
    nodules: Scope
    healthy: Scope
    within: Estimate
    size_error_mm: Estimate
    unlike: int
    confounded: str

    def found_lines(self) -> list[str]:
        """Return the share found of each size, and of all if there are several, in words."""
        named = [(words.size(size_mm), each) for size_mm, each in self.found.items()]
        named += [("all sizes", self.any_size)] if len(named) > 1 else []
        return [f"{name}: {each.text()}, {each.count()}" for name, each in named]

    def meaning_lines(self) -> list[str]:
        """Return the share of each verdict that is right, in words."""
        pairs = zip(("detections", "verdicts of no nodule"), self.meaning or (), strict=False)
        return [
            f"Of 100 {what}, {each.in_hundred()[0]} are right ({each.in_hundred()[1]})."
            for what, each in pairs
            if words.is_known(each.value)
        ]


def answers_of(rates: Rates, detector: str, scheme: str, lead: Lead | None = None) -> Answers:
    """Return a detector's results by one scheme.

    Parameters
    ----------
    rates : Rates
        The tables.
    detector, scheme : str
        Their names.
    lead : Lead, optional
        The leading detector: its intervals are corrected for having been chosen.
    """
    rules, reliable_rate = rates.settings["evaluation"], rates.settings["report"]["reliable_rate"]
    tables, level = rates.of(detector, scheme), rules["confidence"]
    if lead and lead.detector == detector:
        level = headline_confidence(lead, scheme, level)
    if level != rules["confidence"]:
        tables = rates.at(detector, scheme, level)
    set_by = set_specificity(rates, scheme) if sets_specificity(detector, scheme) else None
    found, specific = sizes_found(tables["detection"]), specificity(tables["specificity"])
    quiet = specific.at_least if set_by is None else set_by.low
    any_reliable = smallest_reliable_size(found, 1.0, reliable_rate) is not None
    verdicts, sizing = rates.verdicts(detector, scheme), tables["sizing"]
    confounded, (nodules, healthy) = in_words(rates.confounded), rates.scopes(scheme)

    def pooled(name: str, hits: int, of: int) -> Estimate:
        if tables["summary"].empty or not of:
            return Estimate(*rate(hits, of, level), hits, of)
        return _estimate(tables["summary"].iloc[0], name, hits, of)

    return Answers(
        scheme=scheme,
        found=found,
        any_size=pooled(
            "sensitivity",
            sum(each.hits for each in found.values()),
            sum(each.of for each in found.values()),
        ),
        smallest_mm=(None if confounded else smallest_reliable_size(found, quiet, reliable_rate)),
        healthy_wanting=(not confounded and specific.of == 0 and set_by is None and any_reliable),
        specificity=specific,
        set_specificity=set_by,
        meaning=None if confounded else _meaning(tables["predictive_values"], set_by),
        nodules=nodules,
        healthy=healthy,
        within=pooled("within_rate", int(sizing["within"].sum()), int(sizing["recordings"].sum())),
        size_error_mm=size_error(tables["summary"], int((verdicts["size_mm"] > 0).sum())),
        unlike=int(verdicts.get("familiar", pd.Series()).eq("no").sum()),
        confounded=confounded,
    )


def set_specificity(rates: Rates, scheme: str) -> SetSpecificity | None:
    """Return what a threshold at a rank of healthy places promises; None without such a place."""
    rules, places = rates.settings["evaluation"], rates.healthy_places(scheme)
    if not places:
        return None
    wanted = rules["specificity"]
    low, high = new_specificity(places, wanted)
    needed = recordings_needed(wanted, HALF_WIDTH, rules["confidence"])
    # As few as reach it on average: the mean of Beta(n, 1) is n / (n + 1).
    least = ceil(wanted / (1 - wanted) - 1e-9)
    mean = wanted if places >= least else places / (places + 1)
    return SetSpecificity(wanted, places, least, low, high, mean, needed)


def sizes_found(detection: pd.DataFrame) -> dict[float, Estimate]:
    """Return how often the nodules of each size are found, for the sizes that were judged.

    Parameters
    ----------
    detection : DataFrame
        Counts and recall per size, of one detector and scheme.
    """
    rows = detection[detection["tp"] + detection["fn"] > 0].sort_values("size_mm")
    return {
        float(row["size_mm"]): _estimate(row, "recall", row["tp"], row["tp"] + row["fn"])
        for row in rows.to_dict("records")
    }


def recordings_to_show(level: float) -> int:
    """Return how many recordings, all with the right verdict, have this lower bound.

    That of n of n recordings is ``n / (n + z^2)``.
    """
    square = normal_quantile(2 * ONE_SIDED - 1) ** 2
    return ceil(square * level / (1 - level) - 1e-9)


def _meaning(
    table: pd.DataFrame, set_by: SetSpecificity | None
) -> tuple[Estimate, Estimate] | None:
    """Return the predictive values over all sizes; the table has an empty size for these.

    Where the threshold sets the specificity, they follow from the set one (Bayes' rule), and their
    ranges from the specificity that new places of this bench may expect.
    """
    rows = table[pd.to_numeric(table["size_mm"]).isna()]
    if rows.empty:
        return None
    row = rows.iloc[0]
    if set_by is None:
        ppv, npv = (_estimate(row, name, 0, 1) for name in ("ppv", "npv"))
    else:
        value, low, high = (
            predictive_values(float(row["sensitivity"]), each, float(row["prevalence"]))
            for each in (set_by.mean, set_by.low, set_by.high)
        )
        ppv, npv = (Estimate(value[n], low[n], high[n], 0, 1) for n in (0, 1))
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


def paper_answers(
    paper: Mapping[str, pd.DataFrame],
    our_sizing: pd.DataFrame,
    settings: Settings,
    printed_tolerance_mm: float,
) -> dict[str, str]:
    """Return the results of the paper on its recordings in words, by the same rules.

    Parameters
    ----------
    paper : mapping of str to DataFrame
        ``detection``, ``specificity`` and ``sizing`` of the paper.
    our_sizing : DataFrame
        Our rates per size, of the detector and scheme that the page compares.
    settings : mapping
        Sections ``evaluation`` and ``report`` of the configuration.
    printed_tolerance_mm : float
        The tolerance of the paper's rates.

    Returns
    -------
    dict of str to str
        The paper's answer on each card, by the card's ``id``.
    """
    confidence, tolerance = (settings["evaluation"][k] for k in ("confidence", "tolerance_mm"))
    specific, sizes_mm = specificity(paper["specificity"]), sorted(paper["sizing"]["size_mm"])
    smallest_mm = smallest_reliable_size(
        sizes_found(paper["detection"]), specific.at_least, settings["report"]["reliable_rate"]
    )
    size = "none" if smallest_mm is None else f"{words.size(smallest_mm)} and larger"
    within = within_tolerance(paper["sizing"], confidence).text()
    if tolerance != printed_tolerance_mm:
        compared = ", with another tolerance"
    elif set(sizes_mm) <= set(our_sizing["size_mm"]):
        ours = within_tolerance(our_sizing, confidence, sizes_mm).value
        compared = f"; here over the same sizes {words.percent(ours)}"
    else:
        compared = "; this archive lacks some of these sizes"
    over = words.enumerate_words([f"{size_mm:g}" for size_mm in sizes_mm])
    return {
        "specificity": f"{specific.text()}, computed from its counts; the paper does not print it",
        "found": f"{size}, by the same rule",
        "meaning": "not given",
        "within": f"{within} over {over} mm{compared}",
    }


def smallest_reliable_size(
    found: dict[float, Estimate], specificity: float, level: float
) -> float | None:
    """Return the smallest size from which every size is reliably found.

    Parameters
    ----------
    found : dict of float to Estimate
        How often each size is found, ascending.
    specificity : float
        Lower bound of the specificity. Without it, a detector that reports a nodule everywhere
        would find every size.
    level : float
        The lower bounds must all reach this, at that size and every larger one.

    Returns
    -------
    float or None
        Size in mm; None if not even the largest size is reliably found, or if a bound is not
        known.
    """
    smallest = None
    # A comparison with NaN is false: an unknown rate is not reliable.
    if not specificity >= level - 1e-9:
        return smallest
    for size_mm in reversed(found):
        if not found[size_mm].at_least >= level - 1e-9:
            break
        smallest = size_mm
    return smallest


def within_tolerance(
    sizing: pd.DataFrame, confidence: float, sizes_mm: Sequence[float] | None = None
) -> Estimate:
    """Return the within-tolerance rate, pooled over several sizes.

    Parameters
    ----------
    sizing : DataFrame
        The rates per size, of one detector and scheme.
    confidence : float
        Level of the Wilson interval.
    sizes_mm : sequence of float, optional
        The sizes to pool; all sizes if not given.
    """
    rows = sizing if sizes_mm is None else sizing[sizing["size_mm"].isin(sizes_mm)]
    hits, of = int(rows["within"].sum()), int(rows["recordings"].sum())
    return Estimate(*rate(hits, of, confidence), hits, of)


def size_error(summary: pd.DataFrame, nodules: int) -> Estimate:
    """Return the mean absolute error of the size over all recordings of nodules, in mm.

    Parameters
    ----------
    summary : DataFrame
        The only row of a detector and scheme, or none.
    nodules : int
        Number of recordings of nodules.
    """
    if summary.empty or not nodules:
        return Estimate(UNKNOWN, UNKNOWN, UNKNOWN, 0, nodules)
    return _estimate(summary.iloc[0], "mean_absolute_error_mm", 0, nodules)


def specificity(table: pd.DataFrame) -> Estimate:
    """Return the specificity from the only row of its table; NaN if the table is empty."""
    if table.empty:
        return Estimate(UNKNOWN, UNKNOWN, UNKNOWN, 0, 0)
    row = table.iloc[0]
    return _estimate(row, "specificity", row["true_negatives"], row["healthy"])


def _estimate(row: Row, name: str, hits: float, of: float) -> Estimate:
    value, low, high = (float(row[column]) for column in (name, f"{name}_low", f"{name}_high"))
    at_least = float(row.get(f"{name}_at_least", "nan"))
    return Estimate(value, low, high, int(hits), int(of), at_least)


def _hundred(share: float) -> str:
    """Return a share in 100; with a decimal near 0 and 100, which it never reaches by rounding."""
    count = 100 * share
    if 1.5 <= count < 98.5 or count in (0, 100):
        return words.number(count, 0)
    return words.probability(share).removesuffix(" %")
