"""The track of a survey for its picture: positions of the head, states and suspected places."""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from capsule.arrays import BoolArray, FloatArray, TextArray
from capsule.kinds import Settings
from capsule.recordings.units import pressed_and_period
from capsule.survey.files import Session

# Groups of the states of `capsule.survey.cycle` that look the same in a picture.
AHEAD, BACK, AGAIN = "ahead", "back", "again"
_GROUPS = {
    "folding": BACK,
    "returning": BACK,
    "unfolding": BACK,
    "finding": AGAIN,
    "passing": AGAIN,
}


@dataclass(frozen=True)
class Track:
    """The judgements of a survey, as in `capsule.survey.files.Session`: arrays of shape (J,)."""

    time_s: FloatArray
    head_mm: FloatArray  # with straight lines between known positions
    known: BoolArray  # whether the survey knew the position at that time
    state: TextArray  # of the capsule after the judgement
    score: FloatArray
    threshold: FloatArray
    wave_mm: FloatArray


class Pin(NamedTuple):
    """The times in s at which a survey suspected a place and decided on it."""

    suspected_s: float
    decided_s: float


def track_of(session: Session) -> Track:
    """Return the track of a session."""
    judged = np.flatnonzero(~np.isnan(session.threshold))
    time_s, head_mm = session.time_s[judged], session.head_mm[judged]
    known = ~np.isnan(head_mm)
    if known.any():
        head_mm = np.interp(time_s, time_s[known], head_mm[known])
    states = np.array(["starting", *(event.after for event in session.events)])
    when_s = np.array([event.time_s for event in session.events])
    return Track(
        time_s,
        head_mm,
        known,
        # One millisecond more, because times are stored with three decimals.
        states[np.searchsorted(when_s, time_s + 1e-3, side="right")],
        session.score[judged],
        session.threshold[judged],
        session.wave_mm[judged],
    )


def group_of(state: str) -> str:
    """Return the group of a state in a picture: `AHEAD`, `BACK` or `AGAIN`."""
    return _GROUPS.get(state, AHEAD)


def pins_of(session: Session) -> list[Pin]:
    """Return when each suspected place was suspected and decided."""
    suspected = [event.time_s for event in session.events if event.event == "suspected"]
    pins = []
    for since_s, until_s in pairwise([*suspected, float(session.time_s[-1])]):
        explored = (
            event.time_s
            for event in session.events
            if since_s < event.time_s <= until_s and event.after in ("exploring", "closing")
        )
        pins.append(Pin(since_s, next(explored, until_s)))
    return pins


def crest_at_mm(session: Session, detector: Settings) -> float:
    """Return where the sensors felt a crest of the wave, projected back to `wave_mm` 0.

    Returns
    -------
    float
        From -wavelength / 2 to wavelength / 2; NaN if no position or no wave is known.
    """
    wavelength_mm = float(detector["wavelength_mm"])
    known = np.flatnonzero(~np.isnan(session.head_mm))
    if known.size < 2:
        return float("nan")
    head_mm = np.interp(session.time_s, session.time_s[known], session.head_mm[known])
    # Only samples between two known positions that follow each other directly.
    steps = np.diff(known)
    usable = np.zeros(head_mm.size, dtype=bool)
    usable[known[0] + 1 : known[-1] + 1] = np.repeat(steps <= np.median(steps), steps)
    usable &= ~np.isnan(session.wave_mm)
    rate_hz = 1 / float(np.median(np.diff(session.time_s)))
    pressed, _ = pressed_and_period(session.values, rate_hz, detector)
    behind_mm = detector["pitch_mm"] * np.arange(len(pressed))[:, np.newaxis]
    ahead_mm = head_mm - behind_mm - session.wave_mm
    counts = usable & ~np.isnan(pressed)
    felt = np.where(counts, pressed, 0.0)
    rest = felt.sum(axis=1, keepdims=True) / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    turns = np.exp(-2j * np.pi * np.where(counts, ahead_mm, 0.0) / wavelength_mm)
    turned = np.sum(np.where(counts, felt - rest, 0.0) * turns)
    if turned == 0:
        return float("nan")
    return float(-np.angle(turned) / (2 * np.pi) * wavelength_mm)
