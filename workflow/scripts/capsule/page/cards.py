"""Write the answers of the first screen in words, with their intervals and the paper's answers.

The words depend only on the values of `capsule.page.answers`.
"""

from capsule import words
from capsule.detectors.registry import PAPER
from capsule.evaluation.lead import Lead
from capsule.kinds import Cells
from capsule.page.answers import Answers, Estimate, PaperAnswers


def answer_cards(ours: Answers, paper: PaperAnswers, method: Answers | None) -> list[Cells]:
    """Return the cards that answer a reader's first questions.

    Parameters
    ----------
    ours : Answers
        The detector's results.
    paper : PaperAnswers
        The paper's results.
    method : Answers or None
        Results of the paper's detector on the same recordings; None if `ours` is that detector.

    Returns
    -------
    list of dict
        ``id``, ``question``, ``answer``, ``value`` (None if not known), ``detail``, ``method``
        (empty without one) and ``paper``.
    """
    return [
        {
            "id": "smallest",
            "question": "Smallest size reliably found",
            "answer": _smallest_words(ours),
            "value": ours.smallest_mm,
            "detail": _reliable_words(ours),
            "method": _smallest_words(method) if method else "",
            "paper": _paper_smallest_words(paper),
        },
        {
            "id": "specificity",
            "question": "Specificity",
            "answer": words.percent(ours.specificity.value),
            "value": _known_or_none(ours.specificity),
            "detail": _specificity_words(ours.specificity),
            "method": _rate_words(method.specificity) if method else "",
            "paper": _paper_specificity_words(paper.specificity),
        },
        {
            "id": "within",
            "question": f"Size right within {ours.tolerance_mm:g} mm",
            "answer": words.percent(ours.within.value),
            "value": _known_or_none(ours.within),
            "detail": _within_words(ours.within),
            "method": _rate_words(method.within) if method else "",
            "paper": _paper_within_words(paper),
        },
        {
            "id": "error",
            "question": "Mean error of the size",
            "answer": _error_words(ours.size_error_mm),
            "value": _known_or_none(ours.size_error_mm),
            "detail": _error_detail(ours.size_error_mm),
            "method": _error_words(method.size_error_mm) if method else "",
            "paper": "not given",
        },
    ]


def summary(origin: str, labelled: int, ours: Answers, detector: str) -> str:
    """Return a few sentences that summarise a detector's results.

    Parameters
    ----------
    origin : str
        Kind of origin, from `capsule.page.provenance.Origin`.
    labelled : int
        Number of recordings of known size; only these count.
    ours : Answers
        The detector's results on these recordings.
    detector : str
        Its name.
    """
    if not labelled:
        return "There is no recording to judge by yet."
    subject = "the paper's detector" if detector == PAPER else f"the detector {detector}"
    kind = "simulated recording" if origin == "simulated" else "recording"
    on = f"On {words.plural(labelled, kind)}"
    if ours.smallest_mm is not None:
        nodules = f"nodules of {words.size(ours.smallest_mm)} and larger"
        sentences = [f"{on}, {subject} reliably finds {nodules}."]
    elif ours.healthy_wanting:
        sentences = [
            f"{on}, it is not known how reliably {subject} finds a nodule, because each of them "
            "has one."
        ]
    elif ours.judged:
        sentences = [f"{on}, {subject} reliably finds no nodule size."]
    else:
        sentences = [f"{on}, {subject} cannot be judged, because none has a nodule of known size."]
    if ours.specificity.of:
        false_alarms = words.percent(1 - ours.specificity.value)
        sentences.append(f"It reports a nodule in {false_alarms} of the recordings without one.")
    if ours.within.of:
        share, tolerance = words.percent(ours.within.value), f"{ours.tolerance_mm:g} mm"
        sentences.append(
            f"It gives the size within {tolerance} in {share} of the recordings with a nodule."
        )
    return " ".join(sentences)


def lead_words(lead: Lead, scheme: str) -> str:
    """Return why this detector leads the page.

    Parameters
    ----------
    lead : Lead
        From `capsule.evaluation.lead.leading`.
    scheme : str
        The scheme by which the detectors were compared.
    """
    reached = words.percent(lead.balanced_accuracy)
    if lead.named:
        return f"The configuration names it (report.lead). Its balanced accuracy is {reached}."
    if lead.compared < 2:
        return "No other detector could be compared with it on this archive."
    return (
        f"Of {lead.compared} detectors it has the highest balanced accuracy on this archive, "
        f"{reached} by {words.scheme(scheme)}. A recording without a verdict counts as wrong. If "
        "two detectors are equal, the first in the configuration leads. The same recordings chose "
        "the detector, so its rates are slightly too good."
    )


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
        "Reliable: precision, recall and specificity of at least "
        f"{words.percent(ours.reliable_rate)}, there and at every larger size."
    )
    no_precision = (
        " There is no recording without a nodule. So no false alarm can occur, and precision "
        "has no meaning."
    )
    return rates_there + reliable + ("" if ours.specificity.of else no_precision)


def _rate_words(estimate: Estimate) -> str:
    if not estimate.of:
        return words.UNKNOWN
    return f"{words.percent(estimate.value)} ({_bounds(estimate)})"


def _paper_smallest_words(paper: PaperAnswers) -> str:
    size = "none" if paper.smallest_mm is None else words.size(paper.smallest_mm)
    return f"{size}, by the same rule"


def _specificity_words(specificity: Estimate) -> str:
    if not specificity.of:
        return "There is no recording without a nodule."
    counts = words.count_of(specificity.hits, specificity.of)
    return f"{_bounds(specificity)}; {counts} recordings without a nodule have this verdict."


def _paper_specificity_words(specificity: Estimate) -> str:
    return f"{_rate_words(specificity)}, computed from its counts; the paper does not print it"


def _within_words(within: Estimate) -> str:
    if not within.of:
        return "There is no recording of a nodule."
    return f"{_bounds(within)}; {words.count_of(within.hits, within.of)} recordings of nodules."


def _paper_within_words(paper: PaperAnswers) -> str:
    sizes = words.enumerate_words([f"{size_mm:g}" for size_mm in paper.sizes_mm])
    printed = f"{_rate_words(paper.within)} over {sizes} mm"
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
    mean = f"mean of {words.plural(size_error_mm.of, 'recording')}; a missed nodule counts as"
    if not words.is_known(size_error_mm.low):
        return f"{mean} 0 mm."
    low, high = words.number(size_error_mm.low), words.number(size_error_mm.high)
    return f"{low} to {high} mm; {mean} 0 mm."
