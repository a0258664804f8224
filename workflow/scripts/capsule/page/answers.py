"""Compute the answers of the first screen: what a detector achieves on these recordings.

`capsule.page.cards` puts them into words.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil

import pandas as pd

from capsule.evaluation.intervals import (
    ONE_SIDED,
    mean_interval,
    new_specificity,
    normal_quantile,
    rate,
    recordings_needed,
)
from capsule.kinds import Row, Settings
from capsule.page.schemes import Scope

# A specificity is called measured well enough with an interval of +-5 points.
HALF_WIDTH = 0.05


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
    at_least: float = float("nan")


@dataclass(frozen=True)
class Found:
    """The share of the nodules of one size that are found.

    Attributes
    ----------
    size_mm : float
        The size.
    recall : Estimate
        The share that is found.
    """

    size_mm: float
    recall: Estimate


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
        How many healthy recordings would measure the wanted specificity to +-`HALF_WIDTH`.
    """

    wanted: float
    places: int
    least_places: int
    low: float
    high: float
    mean: float
    needed: int


@dataclass(frozen=True)
class Meaning:
    """The share of verdicts that are right, if a share of the places examined have a nodule.

    Attributes
    ----------
    prevalence : float
        That share of the places.
    detection, no_detection : Estimate
        Positive and negative predictive value, over the sizes of the archive.
    """

    prevalence: float
    detection: Estimate
    no_detection: Estimate


@dataclass(frozen=True)
class Answers:
    """The results of a detector on these recordings, by one scheme.

    Attributes
    ----------
    scheme : str
        The scheme.
    reliable_rate : float
        A size is reliably found if the lower bounds of its sensitivity and of the specificity
        reach this rate, and those of every larger size too.
    found : tuple of Found
        The sizes of which a recording was judged, ascending.
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
    meaning : Meaning or None
        None if there is no recording without a nodule, or none with one.
    nodules, healthy : Scope
        For which recordings the rates of nodules and of healthy recordings hold.
    tolerance_mm : float
        Allowed error of the size.
    within : Estimate
        Share of the recordings of nodules whose size is right within the tolerance.
    size_error_mm : Estimate
        From `mean_size_error`.
    unlike : int
        Number of these recordings that are unlike those that teach.
    confounded : str
        What follows from the header in the recordings that teach, from
        `capsule.evaluation.confounded.in_words`. If anything does, nothing is reliably found.
    """

    scheme: str
    reliable_rate: float
    found: tuple[Found, ...]
    any_size: Estimate
    smallest_mm: float | None
    healthy_wanting: bool
    specificity: Estimate
    set_specificity: SetSpecificity | None
    meaning: Meaning | None
    nodules: Scope
    healthy: Scope
    tolerance_mm: float
    within: Estimate
    size_error_mm: Estimate
    unlike: int = 0
    confounded: str = ""

    def if_confounded(self, what: str) -> "Answers":
        """Return the answers that stay if `what` follows from the header; all, if nothing does."""
        if not what:
            return self
        return replace(self, confounded=what, smallest_mm=None, healthy_wanting=False, meaning=None)

    @property
    def judged(self) -> bool:
        """Return whether any recording of a nodule of known size was judged."""
        return bool(self.found)


@dataclass(frozen=True)
class PaperAnswers:
    """The results of the paper on its recordings, by the same rules.

    Attributes
    ----------
    smallest_mm : float or None
        From `smallest_reliable_size`.
    specificity : Estimate
        Computed from the paper's counts.
    sizes_mm : tuple of float
        The sizes for which the paper gives sizing rates, ascending.
    within : Estimate
        Share of right sizes over these sizes, within the paper's tolerance.
    same_tolerance : bool
        Whether the paper's tolerance equals the configured one.
    ours_within : Estimate or None
        Our share over these sizes; None if this archive lacks one of them.
    """

    smallest_mm: float | None
    specificity: Estimate
    sizes_mm: tuple[float, ...]
    within: Estimate
    same_tolerance: bool
    ours_within: Estimate | None


def our_answers(
    tables: Mapping[str, pd.DataFrame],
    predictions: pd.DataFrame,
    settings: Settings,
    confidence: float,
    scheme: str,
    scopes: tuple[Scope, Scope],
    set_by: SetSpecificity | None,
) -> Answers:
    """Return a detector's results on these recordings.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        ``detection``, ``specificity``, ``sizing``, ``summary`` and ``predictive_values`` of the
        detector and one scheme.
    predictions : DataFrame
        The verdicts of that detector and scheme.
    settings : mapping
        Sections ``evaluation`` and ``report`` of the configuration.
    confidence : float
        Level of the intervals of the tables.
    scheme : str
        The scheme.
    scopes : (Scope, Scope)
        For which recordings the rates of nodules and of healthy recordings hold.
    set_by : SetSpecificity or None
        From `set_specificity`, if the threshold sets the specificity.
    """
    reliable_rate = settings["report"]["reliable_rate"]
    found = sizes_found(tables["detection"])
    specific = specificity(tables["specificity"])
    quiet = specific.at_least if set_by is None else set_by.low
    smallest_mm = smallest_reliable_size(found, quiet, reliable_rate)
    no_healthy = specific.of == 0 and set_by is None
    any_reliable = smallest_reliable_size(found, 1.0, reliable_rate) is not None
    return Answers(
        scheme=scheme,
        reliable_rate=reliable_rate,
        found=found,
        any_size=_pooled(
            tables["summary"],
            "sensitivity",
            sum(each.recall.hits for each in found),
            sum(each.recall.of for each in found),
            confidence,
        ),
        smallest_mm=smallest_mm,
        healthy_wanting=no_healthy and any_reliable,
        specificity=specific,
        set_specificity=set_by,
        meaning=_meaning(tables["predictive_values"], set_by),
        nodules=scopes[0],
        healthy=scopes[1],
        tolerance_mm=settings["evaluation"]["tolerance_mm"],
        within=_pooled(
            tables["summary"],
            "within_rate",
            int(tables["sizing"]["within"].sum()),
            int(tables["sizing"]["recordings"].sum()),
            confidence,
        ),
        size_error_mm=mean_size_error(predictions, confidence),
        unlike=int(predictions.get("familiar", pd.Series()).eq("no").sum()),
    )


def set_specificity(places: int, wanted: float, confidence: float) -> SetSpecificity | None:
    """Return what a threshold at a rank of healthy places promises; None without such a place."""
    if not places:
        return None
    low, high = new_specificity(places, wanted)
    needed = recordings_needed(wanted, HALF_WIDTH, confidence)
    # As few as reach it on average: the mean of Beta(n, 1) is n / (n + 1).
    least = ceil(wanted / (1 - wanted) - 1e-9)
    mean = wanted if places >= least else places / (places + 1)
    return SetSpecificity(wanted, places, least, low, high, mean, needed)


def sizes_found(detection: pd.DataFrame) -> tuple[Found, ...]:
    """Return how often the nodules of each size are found, for the sizes that were judged.

    Parameters
    ----------
    detection : DataFrame
        Counts and recall per size, of one detector and scheme.
    """
    rows = detection[detection["tp"] + detection["fn"] > 0].sort_values("size_mm")
    return tuple(
        Found(float(row["size_mm"]), _estimate(row, "recall", row["tp"], row["tp"] + row["fn"]))
        for row in rows.to_dict("records")
    )


def recordings_to_show(level: float) -> int:
    """Return how many recordings, all with the right verdict, have this lower bound.

    That of n of n recordings is ``n / (n + z^2)``.
    """
    square = normal_quantile(2 * ONE_SIDED - 1) ** 2
    return ceil(square * level / (1 - level) - 1e-9)


def _meaning(table: pd.DataFrame, set_by: SetSpecificity | None) -> Meaning | None:
    """Return the predictive values over all sizes; the table has an empty size for these.

    Where the threshold sets the specificity, they follow from the set one (Bayes' rule), and their
    ranges from the specificity that a new patient may expect.
    """
    rows = table[pd.to_numeric(table["size_mm"]).isna()]
    if rows.empty:
        return None
    row = rows.iloc[0]
    prevalence, sensitivity = float(row["prevalence"]), float(row["sensitivity"])
    if set_by is None:
        ppv, npv = (_estimate(row, name, 0, 1) for name in ("ppv", "npv"))
    else:
        value, low, high = (
            predictive_values(sensitivity, each, prevalence)
            for each in (set_by.mean, set_by.low, set_by.high)
        )
        ppv, npv = (Estimate(value[n], low[n], high[n], 0, 1) for n in (0, 1))
    if not (ppv.value >= 0 or npv.value >= 0):
        return None
    return Meaning(prevalence, ppv, npv)


def predictive_values(
    sensitivity: float, specificity: float, prevalence: float
) -> tuple[float, float]:
    """Return positive and negative predictive value by Bayes' rule; NaN without such a verdict."""
    right, alarms = sensitivity * prevalence, (1 - specificity) * (1 - prevalence)
    quiet, missed = specificity * (1 - prevalence), (1 - sensitivity) * prevalence
    unknown = float("nan")
    return (
        right / (right + alarms) if right + alarms else unknown,
        quiet / (quiet + missed) if quiet + missed else unknown,
    )


def _pooled(summary: pd.DataFrame, name: str, hits: int, of: int, confidence: float) -> Estimate:
    """Return a rate over all nodules, with the interval of the table where it has the rate."""
    if summary.empty or not of:
        return Estimate(*rate(hits, of, confidence), hits, of)
    return _estimate(summary.iloc[0], name, hits, of)


def paper_answers(
    paper: Mapping[str, pd.DataFrame],
    our_sizing: pd.DataFrame,
    settings: Settings,
    printed_tolerance_mm: float,
) -> PaperAnswers:
    """Return the paper's results, with ours over the same sizes.

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
    """
    confidence = settings["evaluation"]["confidence"]
    sizes_mm = tuple(sorted(paper["sizing"]["size_mm"]))
    ours_within = None
    if set(sizes_mm) <= set(our_sizing["size_mm"]):
        ours_within = within_tolerance(our_sizing, confidence, sizes_mm)
    specific = specificity(paper["specificity"])
    return PaperAnswers(
        smallest_mm=smallest_reliable_size(
            sizes_found(paper["detection"]),
            specific.at_least,
            settings["report"]["reliable_rate"],
        ),
        specificity=specific,
        sizes_mm=sizes_mm,
        within=within_tolerance(paper["sizing"], confidence),
        same_tolerance=settings["evaluation"]["tolerance_mm"] == printed_tolerance_mm,
        ours_within=ours_within,
    )


def smallest_reliable_size(
    found: Sequence[Found], specificity: float, level: float
) -> float | None:
    """Return the smallest size from which every size is reliably found.

    Parameters
    ----------
    found : sequence of Found
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
    for each in reversed(found):
        if not each.recall.at_least >= level - 1e-9:
            break
        smallest = each.size_mm
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


def mean_size_error(predictions: pd.DataFrame, confidence: float) -> Estimate:
    """Return the mean absolute error of the size over all recordings of nodules.

    A recording in which no nodule is detected counts as 0 mm, and so does one without a verdict.

    Parameters
    ----------
    predictions : DataFrame
        True and predicted sizes, of one detector and scheme.
    confidence : float
        Level of Student's interval of the mean.

    Returns
    -------
    Estimate
        In mm; the lower bound is never below 0.
    """
    nodules = predictions[predictions["size_mm"] > 0]
    predicted_mm = nodules["predicted_mm"].fillna(0.0)
    errors = (predicted_mm - nodules["size_mm"]).abs().to_numpy(dtype=float)
    mean, low, high = mean_interval(errors, confidence)
    # NaN stays NaN, because `low < 0` is false for it.
    return Estimate(mean, 0.0 if low < 0 else low, high, 0, errors.size)


def specificity(table: pd.DataFrame) -> Estimate:
    """Return the specificity from the only row of its table; NaN if the table is empty."""
    if table.empty:
        unknown = float("nan")
        return Estimate(unknown, unknown, unknown, 0, 0)
    row = table.iloc[0]
    return _estimate(row, "specificity", row["true_negatives"], row["healthy"])


def _estimate(row: Row, name: str, hits: float, of: float) -> Estimate:
    value, low, high = (float(row[column]) for column in (name, f"{name}_low", f"{name}_high"))
    at_least = float(row.get(f"{name}_at_least", "nan"))
    return Estimate(value, low, high, int(hits), int(of), at_least)
