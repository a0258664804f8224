"""The answers of the first screen in words, each with its interval and the paper's answer.

What is worded, and what is left out, depends on the values of `capsule.page.answers` alone.
"""

from capsule import words
from capsule.page.answers import Answers, Estimate, PaperAnswers


def answer_cards(ours: Answers, paper: PaperAnswers) -> list[dict]:
    """Return the answers to the questions that a reader brings.

    Parameters
    ----------
    ours : Answers
        What a detector achieves.
    paper : PaperAnswers
        What the paper achieves.

    Returns
    -------
    list of dict
        ``id``, ``question``, ``answer``, ``value`` (None where not known), ``detail`` and
        ``paper``.
    """
    return [
        {
            "id": "smallest",
            "question": "Smallest size reliably found",
            "answer": _smallest_words(ours),
            "value": ours.smallest_mm,
            "detail": _reliable_words(ours),
            "paper": _paper_smallest_words(paper),
        },
        {
            "id": "specificity",
            "question": "Specificity",
            "answer": words.percent(ours.specificity.value),
            "value": _known_or_none(ours.specificity),
            "detail": _specificity_words(ours.specificity),
            "paper": _paper_specificity_words(paper.specificity),
        },
        {
            "id": "within",
            "question": f"Size right within {ours.tolerance_mm:g} mm",
            "answer": words.percent(ours.within.value),
            "value": _known_or_none(ours.within),
            "detail": _within_words(ours.within),
            "paper": _paper_within_words(paper),
        },
        {
            "id": "error",
            "question": "Mean error of the size",
            "answer": _error_words(ours.size_error_mm),
            "value": _known_or_none(ours.size_error_mm),
            "detail": _error_detail(ours.size_error_mm),
            "paper": "not given",
        },
    ]


def summary(origin: str, labelled: int, ours: Answers) -> str:
    """Return the answer in a sentence or two, by the paper's own detector.

    Parameters
    ----------
    origin : str
        Kind of origin, from `capsule.page.provenance.Origin`.
    labelled : int
        How many recordings of known size there are; no other is evidence.
    ours : Answers
        What the paper's own detector achieves on them.
    """
    if not labelled:
        return "There is no recording to judge by yet."
    kind = "simulated recording" if origin == "simulated" else "recording"
    on = f"On {words.plural(labelled, kind)}"
    if ours.smallest_mm is not None:
        nodules = f"nodules of {words.size(ours.smallest_mm)} and larger"
        answer = f"{on}, the paper's detector reliably finds {nodules}"
    elif ours.healthy_wanting:
        answer = (
            f"{on}, none of them without a nodule, it cannot be told how reliably the paper's "
            "detector finds one"
        )
    elif ours.judged:
        answer = f"{on}, the paper's detector reliably finds no nodule size"
    else:
        answer = f"{on}, none of a nodule of known size, there is nothing to judge detection by"
    if ours.specificity.of:
        false_alarms = words.percent(1 - ours.specificity.value)
        answer += f"; it reports a nodule in {false_alarms} of the runs without one"
    if ours.within.of:
        share, tolerance = words.percent(ours.within.value), f"{ours.tolerance_mm:g} mm"
        answer += f". It gives the size within {tolerance} in {share} of the runs with a nodule"
    return answer + "."


def _known_or_none(estimate: Estimate) -> float | None:
    return estimate.value if estimate.of else None


def _bounds(estimate: Estimate) -> str:
    return words.interval(estimate.low, estimate.high)


def _smallest_words(ours: Answers) -> str:
    if ours.smallest_mm is not None:
        return words.size(ours.smallest_mm)
    return "none" if ours.judged and not ours.healthy_wanting else words.UNKNOWN


def _reliable_words(ours: Answers) -> str:
    rates_there = ""
    if ours.precision and ours.recall:
        rates_there = (
            f"There, precision {words.percent(ours.precision.value)} ({_bounds(ours.precision)}) "
            f"and recall {words.percent(ours.recall.value)} ({_bounds(ours.recall)}). "
        )
    reliable = (
        f"Reliable: precision and recall of at least {words.percent(ours.reliable_rate)}, there "
        "and at every larger size."
    )
    no_precision = (
        " With no recording without a nodule there is no false alarm to count, so precision says "
        "nothing."
    )
    return rates_there + reliable + ("" if ours.specificity.of else no_precision)


def _paper_smallest_words(paper: PaperAnswers) -> str:
    if paper.smallest_mm is None:
        return "none"
    return f"{words.size(paper.smallest_mm)}, by the same rule"


def _specificity_words(specificity: Estimate) -> str:
    if not specificity.of:
        return "There is no recording without a nodule."
    counts = words.count_of(specificity.hits, specificity.of)
    return f"{_bounds(specificity)}; {counts} recordings without a nodule were called so."


def _paper_specificity_words(specificity: Estimate) -> str:
    rate = f"{words.percent(specificity.value)} ({_bounds(specificity)})"
    return f"{rate}, worked out from its counts; it does not print it"


def _within_words(within: Estimate) -> str:
    if not within.of:
        return "There is no recording of a nodule."
    return f"{_bounds(within)}; {words.count_of(within.hits, within.of)} recordings of nodules."


def _paper_within_words(paper: PaperAnswers) -> str:
    sizes = words.enumerate_words([f"{size_mm:g}" for size_mm in paper.sizes_mm])
    printed = f"{words.percent(paper.within.value)} ({_bounds(paper.within)}) over {sizes} mm"
    if not paper.same_tolerance:
        return f"{printed}, with another tolerance"
    if paper.ours_within is None:
        return f"{printed}; this archive lacks some of these sizes"
    return f"{printed}; here over the same sizes {words.percent(paper.ours_within.value)}"


def _error_words(size_error_mm: Estimate) -> str:
    return f"{words.number(size_error_mm.value)} mm" if size_error_mm.of else words.UNKNOWN


def _error_detail(size_error_mm: Estimate) -> str:
    if not size_error_mm.of:
        return "There is no recording of a nodule."
    mean = f"mean of {words.plural(size_error_mm.of, 'recording')}, a missed nodule counting as"
    if not words.is_known(size_error_mm.low):
        return f"{mean} 0 mm."
    low, high = words.number(size_error_mm.low), words.number(size_error_mm.high)
    return f"{low} to {high} mm; {mean} 0 mm."
