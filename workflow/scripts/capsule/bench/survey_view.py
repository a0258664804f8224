"""The display of a running survey in the terminal."""

import math

from capsule import words
from capsule.bench.state import State
from capsule.detectors.verdicts import OF_SURVEY
from capsule.survey.cycle import FOLDED_STATES, STATES

# Number of places that the display lists.
_PLACES = 6
# Step in mm by which the bar grows if the length of the gut is unknown.
_STRETCH_MM = 250.0
# The bar of the score ends at this multiple of the threshold.
_THRESHOLDS = 3
_MARKS = {"confirmed": "●", "dismissed": "○", "undecided": "◇", "": "?"}
_PLAIN = str.maketrans(f"●○◇━─▶◀█│·{words.MINUS}", "*oU=-><#|.-")


def state_lines(state: State, width: int, *, plain: bool = False) -> list[str]:
    """Return the lines that show the state of a survey.

    Parameters
    ----------
    state : State
        The survey's state.
    width : int
        Largest number of characters in a line.
    plain : bool
        Whether to use ASCII only.
    """
    minutes, seconds = divmod(int(state.time_s), 60)
    head = "head not found yet"
    if not math.isnan(state.head_mm):
        last = "" if state.head_known else "last "
        head = f"head {last}at {words.number(state.head_mm, 1)} mm"
    lines = [
        f"{state.title}  {minutes} min {seconds:02d} s  {head}: {STATES[state.doing]}",
        _gut_bar(state, width),
        _score_bar(state, width),
    ]
    for number, status, place_mm, size in state.places[: -_PLACES - 1 : -1]:
        verdict = f"{OF_SURVEY.get(status, 'suspected')}{f', {size}' if size else ''}"
        lines.append(f"{_MARKS[status]} place {number} at {place_mm:.0f} mm: {verdict}")
    if len(state.places) > _PLACES:
        lines.append(f"  and {len(state.places) - _PLACES} before")
    short = [line[:width] for line in lines]
    return [line.translate(_PLAIN) for line in short] if plain else short


def _gut_bar(state: State, width: int) -> str:
    """Return a bar of the gut: the part passed so far, the places, the head and its direction."""
    reached_mm = max([0.0, *(place_mm for _, _, place_mm, _ in state.places)])
    if not math.isnan(state.head_mm):
        reached_mm = max(reached_mm, state.head_mm)
    length_mm = state.length_mm
    if math.isinf(length_mm):
        length_mm = _STRETCH_MM * (reached_mm // _STRETCH_MM + 1)
    end = f" {length_mm:.0f} mm"
    cells = max(width - len(end) - 2, 10)

    def cell_of(place_mm: float) -> int:
        return min(max(int(place_mm / length_mm * cells), 0), cells - 1)

    passed = cell_of(reached_mm)
    bar = ["━" if at <= passed else "─" for at in range(cells)]
    for _, status, place_mm, _ in state.places:
        bar[cell_of(place_mm)] = _MARKS[status]
    if not math.isnan(state.head_mm):
        bar[cell_of(state.head_mm)] = "◀" if state.doing in FOLDED_STATES else "▶"
    return f"0 {''.join(bar)}{end}"


def _score_bar(state: State, width: int) -> str:
    """Return a bar of the score, with a mark at the threshold."""
    score = "none" if math.isnan(state.score) else words.number(state.score, 3)
    label, end = f"score {score:<6}", f" threshold {state.threshold:.3f}"
    cells = max(min(width - len(label) - len(end), 60), 9)
    mark = cells // _THRESHOLDS
    filled = 0
    if not math.isnan(state.score):
        filled = min(max(round(state.score / state.threshold * mark), 0), cells)
    bar = ["█" if at < filled else "·" for at in range(cells)]
    if filled <= mark:
        bar[mark] = "│"
    return f"{label}{''.join(bar)}{end}"
