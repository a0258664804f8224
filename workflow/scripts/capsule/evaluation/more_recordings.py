"""Say what more recordings bring: narrower intervals, and better taught detectors."""

from collections.abc import Mapping

import pandas as pd

from capsule import words
from capsule.evaluation.archive_rates import Rates, sets_specificity
from capsule.evaluation.intervals import recordings_needed
from capsule.evaluation.learning import ALL_BUT_ONE, main_ranges
from capsule.kinds import Row

# Half the width of the interval that the page plans for: +-10 points.
HALF_WIDTH = 0.1
# If the gain's interval ends below this, more recordings are not likely to help.
LEAST_GAIN = 0.05
_HALF = 0.5


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
    """Return whether more recordings are likely to teach a detector more; empty if not known."""
    of_detector, curves = learning[learning["detector"] == detector], {}
    for first_mm, last_mm in main_ranges(of_detector["size_from_mm"]):
        of_range = of_detector.query("size_from_mm == @first_mm and size_to_mm == @last_mm")
        curves[_title(first_mm, last_mm)] = of_range.set_index("share").to_dict("index")
    said = _sentence(curves)
    return f"With half of the recordings to teach it, and with all but one: {said}" if said else ""


def _advice(half: Row) -> str:
    """Return in words whether more recordings are likely to help, from the gain since half."""
    if half["gain_low"] > 0:
        return "more recordings are likely to help"
    if half["gain_high"] < LEAST_GAIN:
        return "more recordings are not likely to help"
    return "this can be chance; too few recordings to tell"


def _sentence(curves: Mapping[str, Mapping[float, Row]]) -> str:
    """Return in words what a detector reaches with half of the archive and with all but one."""
    by_advice: dict[str, list[str]] = {}
    for title, curve in curves.items():
        if words.is_known(curve[_HALF]["gain"]):
            half, last = (words.percent(curve[share]["rate"]) for share in (_HALF, ALL_BUT_ONE))
            by_advice.setdefault(_advice(curve[_HALF]), []).append(f"{title} {half} and {last}")
    clauses = [f"{', '.join(rates)}: {advice}" for advice, rates in by_advice.items()]
    return f"{'; '.join(clauses)}." if clauses else ""


def _title(first_mm: float, last_mm: float) -> str:
    if last_mm == 0:
        return "specificity"
    if first_mm == last_mm:
        return f"found at {words.size(first_mm)}"
    return f"found from {words.size(first_mm)} on"
