"""The display of a running survey in the terminal."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TextIO

from capsule import words
from capsule.bench.terminal import REDRAW_EVERY_S, LivePanel
from capsule.detectors.verdicts import OF_SURVEY
from capsule.survey.cycle import FOLDED_STATES, STATES
from capsule.survey.pilot import Pilot
from capsule.survey.survey_log import Event

# Number of places that the display lists.
_PLACES = 6
# Step in mm by which the bar grows if the length of the gut is unknown.
_STRETCH_MM = 250.0
# The bar of the score ends at this multiple of the threshold.
_THRESHOLDS = 3
_MARKS = {"confirmed": "●", "dismissed": "○", "undecided": "◇", "": "?"}
_PLAIN = str.maketrans(f"●○◇━─▶◀█│·{words.MINUS}", "*oU=-><#|.-")


@dataclass(frozen=True)
class SurveyState:
    """The state of a survey.

    Attributes
    ----------
    title : str
        Name of the survey.
    time_s : float
        Time since the survey began.
    head_mm : float
        Last known position of the capsule's head; NaN before the first.
    known : bool
        Whether this is the present position.
    state : str
        One of `capsule.survey.cycle.STATES`.
    score, threshold : float
        Score and threshold of the newest judgement; the score is NaN if there is none.
    length_mm : float
        Length of the gut; infinite if unknown.
    places : sequence of (int, str, float, str)
        Number, status, position in mm and size in words of each suspected place. The status is
        empty while the place is not decided.
    """

    title: str
    time_s: float
    head_mm: float
    known: bool
    state: str
    score: float
    threshold: float
    length_mm: float
    places: Sequence[tuple[int, str, float, str]]


def state_lines(state: SurveyState, width: int, *, plain: bool = False) -> list[str]:
    """Return the lines that show the state of a survey.

    Parameters
    ----------
    state : SurveyState
        State of the survey.
    width : int
        Largest number of characters in a line.
    plain : bool
        Whether to use ASCII only.
    """
    minutes, seconds = divmod(int(state.time_s), 60)
    head = f"head {'' if state.known else 'last '}at {words.number(state.head_mm, 1)} mm"
    lines = [
        f"{state.title}  {minutes} min {seconds:02d} s  {head}: {STATES[state.state]}",
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


def _gut_bar(state: SurveyState, width: int) -> str:
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
        bar[cell_of(state.head_mm)] = "◀" if state.state in FOLDED_STATES else "▶"
    return f"0 {''.join(bar)}{end}"


def _score_bar(state: SurveyState, width: int) -> str:
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


class SurveyView:
    """A display of a survey: a state redrawn in place on a terminal, else a line per event.

    Parameters
    ----------
    stream : TextIO
        The output.
    title : str
        Name of the survey.
    length_mm : float
        Length of the gut; infinite if unknown.
    """

    def __init__(self, stream: TextIO, title: str, length_mm: float) -> None:
        self._panel = LivePanel(stream)
        self._title, self._length_mm = title, length_mm
        self._head_mm = math.nan

    def tell(self, event: Event) -> None:
        """Print an event, if the output cannot show the survey's state."""
        if not self._panel.redraws:
            self._panel.note(
                f"{event.time_s:8.1f} s {event.position_mm:7.1f} mm  {event.after:<11} "
                f"{event.reason}"
            )

    def show(self, time_s: float, pilot: Pilot, sizes: Mapping[int, str]) -> None:
        """Show the state of the survey, if the last display is old enough.

        Parameters
        ----------
        time_s : float
            Time of the newest sample.
        pilot : Pilot
            The survey's pilot.
        sizes : mapping of int to str
            Sizes of confirmed places in words, by place number.
        """
        if not math.isnan(pilot.sensing.head_mm):
            self._head_mm = pilot.sensing.head_mm
        if self._panel.redraws and self._panel.is_due(REDRAW_EVERY_S):
            self._draw(time_s, pilot, sizes)

    def end(self, time_s: float, pilot: Pilot, sizes: Mapping[int, str]) -> None:
        """Show the final state of the survey, and leave it on the terminal."""
        if self._panel.redraws:
            self._draw(time_s, pilot, sizes)
            self._panel.leave()

    def _draw(self, time_s: float, pilot: Pilot, sizes: Mapping[int, str]) -> None:
        suspects = pilot.suspects
        state = SurveyState(
            title=self._title,
            time_s=time_s,
            head_mm=self._head_mm,
            known=not math.isnan(pilot.sensing.head_mm),
            state=pilot.cycle.state,
            score=suspects.newest_score,
            threshold=suspects.threshold.threshold,
            length_mm=self._length_mm,
            places=[
                (place.number, place.status, place.place_mm, sizes.get(place.number, ""))
                for place in suspects.places
            ],
        )
        self._panel.draw(state_lines(state, self._panel.width, plain=self._panel.plain))
