"""Write the answers of the first screen in words, with their intervals and the paper's answers.

The words depend only on the values of `capsule.page.answers`.
"""

from capsule import words
from capsule.detectors.registry import PAPER
from capsule.evaluation.cross_validation import HELD_OUT
from capsule.evaluation.intervals import ONE_SIDED
from capsule.evaluation.lead import Lead
from capsule.kinds import Cells
from capsule.page.answers import (
    HALF_WIDTH,
    Answers,
    Estimate,
    Meaning,
    PaperAnswers,
    SetSpecificity,
    recordings_to_show,
)

NO_INTERVAL = "no interval: fewer than three places"
NOT_SHOWN = "not shown"
_SEE_TOP = "The recordings do not show what it has learned; see the top of the page."


def answer_cards(
    ours: Answers,
    paper: PaperAnswers,
    method: Answers | None,
    also: Answers | None,
) -> list[Cells]:
    """Return the cards that answer a reader's first questions.

    Parameters
    ----------
    ours : Answers
        The detector's results.
    paper : PaperAnswers
        The paper's results.
    method : Answers or None
        Results of the paper's detector on the same recordings; None if `ours` is that detector.
    also : Answers or None
        The detector's results by leave-one-out; None if `ours` are these.

    Returns
    -------
    list of dict
        ``id``, ``question``, ``answer``, ``value`` (None if not known), ``lines`` (one for each
        size), ``detail``, ``beside`` (pairs of a title and the answer of others) and ``paper``.
    """
    cards: list[Cells] = [
        {
            "id": "specificity",
            "question": "Healthy places called healthy (specificity)",
            "answer": _specificity_answer(ours),
            "value": None if ours.set_specificity else _known_or_none(ours.specificity),
            "lines": [],
            "detail": _specificity_words(ours),
            "paper": _paper_specificity_words(paper.specificity),
        },
        {
            "id": "found",
            "question": f"Nodules {'' if ours.confounded else 'reliably '}found (sensitivity)",
            "answer": _smallest_words(ours),
            "value": ours.smallest_mm,
            "lines": _found_lines(ours),
            "detail": _reliable_words(ours),
            "paper": "not compared" if ours.confounded else _paper_smallest_words(paper),
        },
        {
            "id": "meaning",
            "question": "How often a detection is right",
            "answer": _meaning_answer(ours.meaning),
            "value": ours.meaning.detection.value if ours.meaning else None,
            "lines": _meaning_lines(ours.meaning),
            "detail": _meaning_words(ours),
            "paper": "not given",
        },
        {
            "id": "within",
            "question": f"Size right within {ours.tolerance_mm:g} mm",
            "answer": words.percent(ours.within.value),
            "value": _known_or_none(ours.within),
            "lines": [],
            "detail": _within_words(ours),
            "paper": _paper_within_words(paper),
        },
    ]
    others = [("Leave-one-out", also), ("Paper's detector here", method)]
    for card in cards:
        said = [(title, _briefly(card["id"], each)) for title, each in others if each]
        card["beside"] = [(title, text) for title, text in said if text]
        if ours.confounded:
            card |= {"answer": NOT_SHOWN, "value": None}
    return cards


def summary(origin: str, ours: Answers, detector: str) -> str:
    """Return a few sentences that summarise a detector's results.

    Parameters
    ----------
    origin : str
        Kind of origin of the judged recordings, from `capsule.page.provenance.Origin`.
    ours : Answers
        The detector's results on these recordings.
    detector : str
        Its name.
    """
    nodules, healthy = ours.any_size.of, ours.specificity.of
    if not nodules and not healthy:
        return "There is no recording to judge by yet."
    subject = "the paper's detector" if detector == PAPER else f"the detector {detector}"
    kind = "simulated recording" if origin == "simulated" else "recording"
    held_out = ours.scheme == HELD_OUT
    what = f"held-out {kind}" if held_out else kind
    parts = [f"{healthy} without a nodule"] if healthy else []
    parts += [f"{nodules} with one"] if nodules else []
    counted = f"{words.plural(healthy + nodules, what)} ({words.enumerate_words(parts)})"
    on = f"On {counted}" + (", which taught nothing and chose nothing" if held_out else "")
    if not nodules:
        return f"{on}, {subject} cannot be judged, because none has a nodule of known size."
    found = words.count_of(ours.any_size.hits, nodules)
    sentences = [f"{on}, {subject} found {found} nodules."]
    if not healthy:
        sentences = [
            f"{on}, {subject} found {found} nodules. This says little, because each recording has "
            "one: a detector that always reports a nodule finds all of them."
        ]
    elif ours.set_specificity is None:
        alarms = words.count_of(healthy - ours.specificity.hits, healthy)
        sentences.append(f"It reported a nodule in {alarms} recordings without one.")
    else:
        sentences.append(
            "How often it reports a nodule where there is none is not measured: its threshold is "
            f"{_aim(ours.set_specificity)[0]} {words.percent(1 - ours.set_specificity.wanted)}."
        )
    if ours.unlike:
        sentences.append(
            f"{words.UNLIKE.capitalize()}: {words.count_of(ours.unlike, healthy + nodules)}; the "
            "rates include them."
        )
    if ours.confounded:
        sentences.append(
            "This does not show what it has learned: among the recordings that teach, "
            f"{ours.confounded}."
        )
    return " ".join(sentences)


def lead_words(lead: Lead, scheme: str) -> str:
    """Return why this detector leads the page.

    Parameters
    ----------
    lead : Lead
        From `capsule.evaluation.lead.leading`.
    scheme : str
        The scheme of the rates that the page shows first.
    """
    reached = words.percent(lead.balanced_accuracy)
    if lead.named:
        return f"The configuration names it (report.lead). Its balanced accuracy is {reached}."
    if lead.compared < 2:
        return "No other detector could be compared with it on this archive."
    end = (
        "The held-out sessions had no part in this choice."
        if scheme == HELD_OUT
        else "The same recordings chose it, so the intervals above are corrected for the choice."
    )
    return (
        f"Of {lead.compared} detectors it has the highest balanced accuracy on this archive, "
        f"{reached} by leave-one-out. A recording without a verdict counts as wrong. If two "
        f"detectors are equal, the first in the configuration leads. {end}"
    )


def bounds(estimate: Estimate) -> str:
    """Return the interval of a rate in words, or that there is none."""
    if not words.is_known(estimate.low):
        return NO_INTERVAL
    return words.interval(estimate.low, estimate.high)


def set_words(set_by: SetSpecificity) -> str:
    """Return what a specificity is that the threshold sets, and what a new patient may expect."""
    wanted, healthy = words.percent(set_by.wanted), words.plural(set_by.places, "healthy place")
    promise = f"The threshold rests on {healthy}."
    if set_by.places < set_by.least_places:
        promise = (
            f"{wanted} cannot be promised: this takes {set_by.least_places} healthy places, and "
            f"this archive has {set_by.places}. The threshold is their highest score."
        )
    return (
        f"{promise} A new patient may expect a specificity of "
        f"{words.interval(set_by.low, set_by.high)} (central 90 %; approximate, because scores are "
        "cross-validated)."
    )


def threshold_words(wanted: float, set_by: SetSpecificity | None) -> str:
    """Return what learned thresholds aim at, and that too few healthy places cannot promise it."""
    aim = f"Learned thresholds aim at a specificity of {words.percent(wanted)}."
    if set_by is None or set_by.places >= set_by.least_places:
        return aim
    return f"{aim} {set_words(set_by)}"


def to_measure(set_by: SetSpecificity) -> str:
    """Return how many healthy recordings would measure the specificity."""
    return (
        f"To measure it to ±{100 * HALF_WIDTH:g} points takes {set_by.needed} held-out healthy "
        "recordings."
    )


def _known_or_none(estimate: Estimate) -> float | None:
    return estimate.value if estimate.of else None


def _briefly(card: str, answers: Answers) -> str:
    """Return another detector's or scheme's answer to the question of a card; empty for none."""
    match card:
        case "specificity":
            if answers.set_specificity:
                return f"{_specificity_answer(answers)}, not measured"
            return _rate_words(answers.specificity)
        case "found":
            return _smallest_words(answers)
        case "meaning":
            return _meaning_answer(answers.meaning) if answers.meaning else ""
        case _:
            return _rate_words(answers.within)


def _specificity_answer(ours: Answers) -> str:
    if ours.set_specificity is None:
        return words.percent(ours.specificity.value)
    return f"{_aim(ours.set_specificity)[1]} {words.percent(ours.set_specificity.wanted)}"


def _aim(set_by: SetSpecificity) -> tuple[str, str]:
    """Return the verbs for an aim that a threshold reaches on average, or cannot promise."""
    if set_by.places >= set_by.least_places:
        return "set for", "set to"
    return "meant for", "aims at"


def _specificity_words(ours: Answers) -> str:
    if ours.set_specificity is not None:
        said = f"By the threshold, not measured. {set_words(ours.set_specificity)}"
        return f"{said} {to_measure(ours.set_specificity)}"
    specificity = ours.specificity
    if not specificity.of:
        return "There is no recording without a nodule."
    counts = words.count_of(specificity.hits, specificity.of)
    held_out = "held-out " if ours.scheme == HELD_OUT else ""
    return (
        f"{bounds(specificity)}; {counts} {held_out}recordings without a nodule have this verdict, "
        f"{ours.healthy.text()}."
    )


def _smallest_words(ours: Answers) -> str:
    if ours.smallest_mm is not None:
        return f"{words.size(ours.smallest_mm)} and larger"
    if ours.confounded:
        return NOT_SHOWN
    return "none shown" if ours.judged and not ours.healthy_wanting else words.UNKNOWN


def _found_lines(ours: Answers) -> list[str]:
    named = [(words.size(each.size_mm), each.recall) for each in ours.found]
    named += [("all sizes", ours.any_size)] if len(named) > 1 else []
    return [
        f"{name}: {_rate_words(rate)}, {words.count_of(rate.hits, rate.of)}" for name, rate in named
    ]


def _reliable_words(ours: Answers) -> str:
    if not ours.judged:
        return "There is no recording of a nodule."
    level = words.percent(ours.reliable_rate)
    said = f"Rates {ours.nodules.text()}."
    if ours.confounded:
        return f"{said} {_SEE_TOP}"
    said += (
        f" Reliably found: sensitivity and specificity are at least {level}, by their one-sided "
        f"{words.percent(ONE_SIDED)} lower bounds, at this size and every larger one."
    )
    needed = recordings_to_show(ours.reliable_rate)
    most = max(each.recall.of for each in ours.found)
    if ours.smallest_mm is None and most < needed:
        said += (
            f" {words.plural(most, 'recording')} of a size cannot show this: it takes {needed} "
            "places or set-ups, all of them found."
        )
    if not ours.specificity.of:
        said += " There is no recording without a nodule, so no false alarm can occur."
    return said


def _meaning_answer(meaning: Meaning | None) -> str:
    if meaning is None or not words.is_known(meaning.detection.value):
        return words.UNKNOWN
    return f"{_hundred(meaning.detection.value)} of 100"


def _meaning_lines(meaning: Meaning | None) -> list[str]:
    if meaning is None:
        return []
    pairs = (("detections", meaning.detection), ("verdicts of no nodule", meaning.no_detection))
    return [
        f"Of 100 {what}, {_hundred(each.value)} are right ({_hundreds(each)})."
        for what, each in pairs
        if words.is_known(each.value)
    ]


def _meaning_words(ours: Answers) -> str:
    meaning = ours.meaning
    if ours.confounded:
        return _SEE_TOP
    if meaning is None:
        return "This needs recordings with a nodule and without one."
    said = (
        f"If {words.percent(meaning.prevalence)} of the places examined have a nodule "
        "(evaluation.prevalence), and the sizes are those of the judged recordings."
    )
    if ours.set_specificity is not None:
        span = words.interval(ours.set_specificity.low, ours.set_specificity.high)
        mean = words.percent(ours.set_specificity.mean)
        said += f" The specificity counts as {mean}, in the ranges as {span}."
    return said


def _hundred(share: float) -> str:
    """Return a share in 100; with a decimal near 0 and 100, which it never reaches by rounding."""
    count = 100 * share
    if 1.5 <= count < 98.5 or count in (0, 100):
        return words.number(count, 0)
    return words.probability(share).removesuffix(" %")


def _hundreds(estimate: Estimate) -> str:
    if not words.is_known(estimate.low):
        return NO_INTERVAL
    return f"{_hundred(estimate.low)} to {_hundred(estimate.high)}"


def _rate_words(estimate: Estimate) -> str:
    if not estimate.of:
        return words.UNKNOWN
    return f"{words.percent(estimate.value)} ({bounds(estimate)})"


def _paper_smallest_words(paper: PaperAnswers) -> str:
    size = "none" if paper.smallest_mm is None else f"{words.size(paper.smallest_mm)} and larger"
    return f"{size}, by the same rule"


def _paper_specificity_words(specificity: Estimate) -> str:
    return f"{_rate_words(specificity)}, computed from its counts; the paper does not print it"


def _within_words(ours: Answers) -> str:
    within, error = ours.within, ours.size_error_mm
    if not within.of:
        return "There is no recording of a nodule."
    said = f"{bounds(within)}; {words.count_of(within.hits, within.of)} recordings of nodules."
    if not error.of:
        return said
    mean = f"{words.number(error.value)} mm"
    if words.is_known(error.low):
        mean += f" ({words.number(error.low)} to {words.number(error.high)} mm)"
    return f"{said} Mean error {mean}; a missed nodule counts as 0 mm."


def _paper_within_words(paper: PaperAnswers) -> str:
    sizes = words.enumerate_words([f"{size_mm:g}" for size_mm in paper.sizes_mm])
    printed = f"{_rate_words(paper.within)} over {sizes} mm"
    if not paper.same_tolerance:
        return f"{printed}, with another tolerance"
    if paper.ours_within is None:
        return f"{printed}; this archive lacks some of these sizes"
    return f"{printed}; here over the same sizes {words.percent(paper.ours_within.value)}"
