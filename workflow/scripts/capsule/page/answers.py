"""The answers of the first screen, in values: what the system can do on these recordings.

`capsule.page.cards` words them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from capsule.evaluation.rates import rate
from capsule.evaluation.size_error import mean_interval
from capsule.kinds import Row, Settings


@dataclass(frozen=True)
class Estimate:
    """A value with its interval; NaN where there is nothing to count.

    Attributes
    ----------
    value, low, high : float
        The value and the bounds of its interval.
    hits, of : int
        The counts behind a rate; of a mean, ``of`` is how many values were averaged.
    """

    value: float
    low: float
    high: float
    hits: int
    of: int


@dataclass(frozen=True)
class Answers:
    """What a detector achieves on these recordings, by one scheme.

    Attributes
    ----------
    reliable_rate : float
        What precision, recall and specificity must all reach, for a size to be reliably found.
    judged : bool
        Whether a recording of a nodule of known size was judged at all.
    smallest_mm : float or None
        From `smallest_reliable_size`; None without a recording of no nodule.
    healthy_wanting : bool
        Whether a size would be reliably found, were there any recording of no nodule: a detector
        that calls everything a nodule cannot be told from a good one.
    precision, recall : Estimate or None
        Those of that size; None where there is none.
    specificity : Estimate
        The share of the recordings without a nodule that were called so.
    tolerance_mm : float
        How far off a size may be.
    within : Estimate
        The share of the recordings of nodules whose size is right within the tolerance.
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
    """What the paper achieves on its recordings, by the same rules.

    Attributes
    ----------
    smallest_mm : float or None
        From `smallest_reliable_size`.
    specificity : Estimate
        Worked out from its counts.
    sizes_mm : tuple of float
        The sizes whose estimates it judges, ascending.
    within : Estimate
        Over these sizes, within its tolerance.
    same_tolerance : bool
        Whether its tolerance is the one used here.
    ours_within : Estimate or None
        Our own over these sizes; None where this archive lacks one of them.
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
    """Return what a detector achieves on these recordings.

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
    """Return what the paper achieves, and what of it can be compared with ours.

    Parameters
    ----------
    paper : mapping of str to DataFrame
        ``detection``, ``specificity`` and ``sizing`` of the paper.
    our_sizing : DataFrame
        The rates per size of the detector and scheme that stand beside them.
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
    """Return the smallest size from which on every size is reliably found.

    Parameters
    ----------
    detection : DataFrame
        Precision and recall per size, of one detector and scheme.
    specificity : float
        Its specificity. The precision of a size counts only false alarms of exactly that size, so
        a detector with many false alarms of other sizes can have a precision of 100 %.
    level : float
        What precision, recall and specificity must all reach, there and at every larger size.

    Returns
    -------
    float or None
        Size in mm; None where not even the largest size is reliably found, or where a rate is
        not known.
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
    """Return the within-tolerance rate of several sizes, pooled.

    Parameters
    ----------
    sizing : DataFrame
        The rates per size, of one detector and scheme.
    confidence : float
        Level of the Wilson interval.
    sizes_mm : sequence of float, optional
        The sizes to pool; all of them if not given.
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
    # NaN stays NaN here: it is not smaller than 0.
    return Estimate(mean, 0.0 if low < 0 else low, high, 0, errors.size)


def specificity(table: pd.DataFrame) -> Estimate:
    """Return the specificity in the one row of its table, NaN where the table has none."""
    if table.empty:
        unknown = float("nan")
        return Estimate(unknown, unknown, unknown, 0, 0)
    row = table.iloc[0]
    return _estimate(row, "specificity", row["true_negatives"], row["healthy"])


def _estimate(row: Row, name: str, hits: float, of: float) -> Estimate:
    value, low, high = (float(row[column]) for column in (name, f"{name}_low", f"{name}_high"))
    return Estimate(value, low, high, int(hits), int(of))
