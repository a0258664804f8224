"""The answers of the first screen in words, each with its interval and the paper's answer."""

from collections.abc import Mapping, Sequence

import pandas as pd

from capsule import words
from capsule.page import answers


def answer_cards(
    ours: Mapping[str, pd.DataFrame],
    paper: Mapping[str, pd.DataFrame],
    predictions: pd.DataFrame,
    settings: Mapping,
    printed_tolerance_mm: float,
) -> list[dict]:
    """Answer the questions that a reader brings, each with interval and the paper's answer.

    Parameters
    ----------
    ours, paper : mapping of str to DataFrame
        ``detection``, ``specificity`` and ``sizing`` of one detector and scheme, and the paper's.
    predictions : DataFrame
        The verdicts of that detector and scheme.
    settings : mapping
        Sections ``evaluation`` and ``report`` of the configuration.
    printed_tolerance_mm : float
        The tolerance of the paper's rates.

    Returns
    -------
    list of dict
        ``id``, ``question``, ``answer``, ``value``, ``detail`` and ``paper``.
    """
    confidence, level = settings["evaluation"]["confidence"], settings["report"]["reliable_rate"]
    tolerance = settings["evaluation"]["tolerance_mm"]
    smallest = answers.smallest_reliable_size(ours["detection"], level)
    healthy = answers.specificity(ours["specificity"])
    healthy_paper = answers.specificity(paper["specificity"])
    within = answers.within_tolerance(ours["sizing"], confidence)
    error = answers.mean_size_error(predictions, confidence)
    return [
        {
            "id": "smallest",
            "question": "Smallest size reliably found",
            "answer": _smallest_words(ours["detection"], smallest),
            "value": smallest,
            "detail": _rates_at(ours["detection"], smallest)
            + f"Reliable: precision and recall of at least {words.percent(level)}, there and at "
            "every larger size."
            + ("" if healthy.of else " With no recording without a nodule, precision is empty."),
            "paper": _paper_smallest(paper["detection"], level),
        },
        {
            "id": "specificity",
            "question": "Specificity",
            "answer": words.percent(healthy.value),
            "value": healthy.value,
            "detail": _specificity_words(healthy),
            "paper": f"{words.percent(healthy_paper.value)} "
            f"({words.interval(healthy_paper.low, healthy_paper.high)}), worked out from its "
            "counts; it does not print it",
        },
        {
            "id": "within",
            "question": f"Size right within {tolerance:g} mm",
            "answer": words.percent(within.value),
            "value": within.value,
            "detail": f"{words.interval(within.low, within.high)}; "
            f"{words.count_of(within.hits, within.of)} recordings of nodules."
            if within.of
            else "There is no recording of a nodule.",
            "paper": _paper_within(
                ours["sizing"], paper["sizing"], confidence, tolerance == printed_tolerance_mm
            ),
        },
        {
            "id": "error",
            "question": "Mean error of the size",
            "answer": f"{words.number(error.value)} mm" if error.of else words.UNKNOWN,
            "value": error.value,
            "detail": _error_words(error),
            "paper": "not given",
        },
    ]


def summary(origin: str, accepted: int, cards: Sequence[Mapping], settings: Mapping) -> str:
    """Answer in a sentence or two, by the paper's own detector.

    Parameters
    ----------
    origin : str
        Kind of origin, from `capsule.page.provenance.Origin`.
    accepted : int
        How many recordings were used.
    cards : sequence of mapping
        From `answer_cards`.
    settings : mapping
        Section ``evaluation`` of the configuration.

    Returns
    -------
    str
    """
    by_id = {card["id"]: card for card in cards}
    smallest, healthy = by_id["smallest"], by_id["specificity"]
    kind = "simulated recording" if origin == "simulated" else "recording"
    on = f"On {words.plural(accepted, kind)}"
    if not accepted:
        return "There is no recording to judge by yet."
    if smallest["answer"] == words.UNKNOWN:
        found = f"{on}, none of a nodule of known size, there is nothing to judge detection by"
    else:
        what = f"nodules of {smallest['answer']} and larger"
        what = "no nodule size" if smallest["value"] is None else what
        found = f"{on}, the paper's detector reliably finds {what}"
    if words.is_known(healthy["value"]):
        share = words.percent(1 - healthy["value"])
        found += f"; it reports a nodule in {share} of the runs without one"
    if words.is_known(by_id["within"]["value"]):
        tolerance = f"{settings['tolerance_mm']:g} mm"
        share = by_id["within"]["answer"]
        found += f". It gives the size within {tolerance} in {share} of the runs with a nodule"
    return found + "."


def _smallest_words(detection: pd.DataFrame, smallest: float | None) -> str:
    if smallest is not None:
        return words.size(smallest)
    return "none" if detection["recall"].notna().any() else words.UNKNOWN


def _rates_at(detection: pd.DataFrame, size_mm: float | None) -> str:
    if size_mm is None:
        return ""
    row = detection[detection["size_mm"] == size_mm].iloc[0]
    precision = words.interval(row["precision_low"], row["precision_high"])
    recall = words.interval(row["recall_low"], row["recall_high"])
    return (
        f"There, precision {words.percent(row['precision'])} ({precision}) and recall "
        f"{words.percent(row['recall'])} ({recall}). "
    )


def _paper_smallest(detection: pd.DataFrame, level: float) -> str:
    smallest = answers.smallest_reliable_size(detection, level)
    return "none" if smallest is None else f"{words.size(smallest)}, by the same rule"


def _specificity_words(healthy: answers.Estimate) -> str:
    if not healthy.of:
        return "There is no recording without a nodule."
    return (
        f"{words.interval(healthy.low, healthy.high)}; "
        f"{words.count_of(healthy.hits, healthy.of)} recordings without a nodule were called so."
    )


def _paper_within(
    ours: pd.DataFrame, paper: pd.DataFrame, confidence: float, same_tolerance: bool
) -> str:
    sizes_mm = sorted(paper["size_mm"])
    printed = answers.within_tolerance(paper, confidence)
    named = words.enumerate_words([f"{size_mm:g}" for size_mm in sizes_mm])
    text = (
        f"{words.percent(printed.value)} ({words.interval(printed.low, printed.high)}) over "
        f"{named} mm"
    )
    if not same_tolerance:
        return f"{text}, with another tolerance"
    if not set(sizes_mm) <= set(ours["size_mm"]):
        return f"{text}; this archive lacks some of these sizes"
    same = answers.within_tolerance(ours, confidence, sizes_mm)
    return f"{text}; here over the same sizes {words.percent(same.value)}"


def _error_words(error: answers.Estimate) -> str:
    if not error.of:
        return "There is no recording of a nodule."
    bounds = f"{words.number(error.low)} to {words.number(error.high)} mm; "
    mean = f"mean of {words.plural(error.of, 'recording')}, a missed nodule counting as 0 mm."
    return (bounds if words.is_known(error.low) else "") + mean
