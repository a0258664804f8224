"""Compute the answers of the first screen: what a detector achieves on these recordings.

`capsule.page.cards` puts them into words.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from capsule.evaluation.rates import rate
from capsule.evaluation.size_error import mean_interval
from capsule.kinds import Row, Settings


@dataclass(frozen=True)
class Estimate:
    """A value with its interval; NaN if there is nothing to count.

    Attributes
    ----------
    value, low, high : float
        The value and the bounds of its interval.
    hits, of : int
        The counts behind a rate; for a mean, ``of`` is the number of values.
    """

    value: float
    low: float
    high: float
    hits: int
    of: int


@dataclass(frozen=True)
class Answers:
    """The results of a detector on these recordings, by one scheme.

    Attributes
    ----------
    reliable_rate : float
        A size is reliably found if precision, recall and specificity all reach this rate.
    judged : bool
        Whether any recording of a nodule of known size was judged.
    smallest_mm : float or None
        From `smallest_reliable_size`; None without a recording of no nodule.
    healthy_wanting : bool
        Whether only a recording without a nodule is missing for a size to be reliably found.
        Without one, a detector that reports a nodule everywhere looks like a good detector.
    precision, recall : Estimate or None
        Rates of the smallest reliable size; None if there is no such size.
    specificity : Estimate
        Share of the recordings without a nodule that have this verdict.
    tolerance_mm : float
        Allowed error of the size.
    within : Estimate
        Share of the recordings of nodules whose size is right within the tolerance.
    size_error_mm : Estimate
        From `mean_size_error`.
    """

    reliable_rate: float
    judged: bool
    smallest_mm: float | None
    healthy_wanting: bool
    precision: Estimate | None
    recall: Estimate | None
    specificity: Estimate
    tolerance_mm: float
    within: Estimate
    size_error_mm: Estimate


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
    tables: Mapping[str, pd.DataFrame], predictions: pd.DataFrame, settings: Settings
) -> Answers:
    """Return a detector's results on these recordings.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        ``detection``, ``specificity`` and ``sizing`` of the detector and one scheme.
    predictions : DataFrame
        The verdicts of that detector and scheme.
    settings : mapping
        Sections ``evaluation`` and ``report`` of the configuration.
    """
    confidence = settings["evaluation"]["confidence"]
    reliable_rate = settings["report"]["reliable_rate"]
    detection = tables["detection"]
    specific = specificity(tables["specificity"])
    smallest_mm = smallest_reliable_size(detection, specific.value, reliable_rate)
    healthy_wanting = (
        specific.of == 0 and smallest_reliable_size(detection, 1.0, reliable_rate) is not None
    )
    precision = recall = None
    if smallest_mm is not None:
        row = detection[detection["size_mm"] == smallest_mm].iloc[0]
        precision = _estimate(row, "precision", row["tp"], row["tp"] + row["fp"])
        recall = _estimate(row, "recall", row["tp"], row["tp"] + row["fn"])
    return Answers(
        reliable_rate=reliable_rate,
        judged=bool(detection["recall"].notna().any()),
        smallest_mm=smallest_mm,
        healthy_wanting=healthy_wanting,
        precision=precision,
        recall=recall,
        specificity=specific,
        tolerance_mm=settings["evaluation"]["tolerance_mm"],
        within=within_tolerance(tables["sizing"], confidence),
        size_error_mm=mean_size_error(predictions, confidence),
    )


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
            paper["detection"], specific.value, settings["report"]["reliable_rate"]
        ),
        specificity=specific,
        sizes_mm=sizes_mm,
        within=within_tolerance(paper["sizing"], confidence),
        same_tolerance=settings["evaluation"]["tolerance_mm"] == printed_tolerance_mm,
        ours_within=ours_within,
    )


def smallest_reliable_size(
    detection: pd.DataFrame, specificity: float, level: float
) -> float | None:
    """Return the smallest size from which every size is reliably found.

    Parameters
    ----------
    detection : DataFrame
        Precision and recall per size, of one detector and scheme.
    specificity : float
        Its specificity. It is needed because the precision of a size counts only false alarms of
        exactly that size: a detector with many false alarms of other sizes can reach 100 %.
    level : float
        Precision, recall and specificity must all reach this, at that size and every larger one.

    Returns
    -------
    float or None
        Size in mm; None if not even the largest size is reliably found, or if a rate is not
        known.
    """
    smallest = None
    # A comparison with NaN is false: an unknown rate is not reliable.
    if not specificity >= level - 1e-9:
        return smallest
    for _, row in detection.sort_values("size_mm", ascending=False).iterrows():
        if not (row["precision"] >= level - 1e-9 and row["recall"] >= level - 1e-9):
            break
        smallest = float(row["size_mm"])
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

    A recording in which no nodule is detected counts as 0 mm.

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
    errors = (nodules["predicted_mm"] - nodules["size_mm"]).abs().dropna().to_numpy(dtype=float)
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
    return Estimate(value, low, high, int(hits), int(of))
