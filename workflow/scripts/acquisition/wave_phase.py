"""How far the drive has carried the wave at any moment, from what its board says now and then.

The board counts half-steps from its start. Where it has an index switch, the count at which the cam
shaft last passed it tells the phase, also after the board was reset and after the motor has lost
steps. Without one the count alone tells, and after a reset the phase is lost.
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from acquisition.protocol import Position
from acquisition.timeline import CLOCK_ENDS_MS, DELAYS_KEPT, DRIFT

RUNNING = "running"
# Between two frames further apart than this, nobody knows what the wave did.
FARTHEST_APART_S = 1.5
# Past the newest frame, the wave goes on at its speed for so long.
AHEAD_S = 1.0
# After so many turns without its index, the motor does not turn the cams as it thinks.
LONGEST_TURN = 1.3
_KEPT = 60


class BoardClock:
    """Tells when, by the computer's clock, something happened that a board has timed.

    The delay of a line varies; the smallest of late is the line's own.
    """

    def __init__(self) -> None:
        self._last_ms: int | None = None
        self._board_s = 0.0
        self._delays_s: deque[tuple[float, float]] = deque(maxlen=DELAYS_KEPT)

    def continues(self, device_ms: int) -> bool:
        """Say whether the board has run on since it was heard last."""
        return self._last_ms is None or (device_ms - self._last_ms) % CLOCK_ENDS_MS < 2**31

    def moment_s(self, device_ms: int, arrived_s: float) -> float:
        """Return the computer's clock at a moment of the board's; takes note of the delay."""
        if self._last_ms is not None:
            self._board_s += (device_ms - self._last_ms) % CLOCK_ENDS_MS / 1000
        self._last_ms = device_ms
        self._delays_s.append((self._board_s, arrived_s - self._board_s))
        # The two clocks may differ, so what was long ago counts as later.
        return self._board_s + min(
            delay_s + DRIFT * (self._board_s - at_s) for at_s, delay_s in self._delays_s
        )


@dataclass(frozen=True)
class _Knot:
    """A frame: when, how far the wave was (NaN where that is not known), and how fast."""

    moment_s: float
    wave_mm: float
    speed_mm_s: float


class WavePhase:
    """The wave's way, from the frames of the peristalsis board.

    Parameters
    ----------
    wavelength_mm : float
        Way of the wave in a turn of the cam shaft.
    forward : bool
        Whether the board counts upward.
    index_mm : float, optional
        Phase at the index, from a session before; without, it is learned.

    Attributes
    ----------
    index_mm : float or None
        Phase at the index; None where the cam shaft has not passed one.
    known : bool
        Whether the newest frame tells the phase.
    """

    def __init__(
        self, wavelength_mm: float, *, forward: bool, index_mm: float | None = None
    ) -> None:
        self._wavelength_mm = wavelength_mm
        self._sign = 1.0 if forward else -1.0
        # From the board's count to the wave's way; None where the count began anew.
        self._offset_mm: float | None = 0.0
        self._wave_mm = 0.0
        self._mm_per_half_step = (0, 0.0)
        self._clock = BoardClock()
        self._knots: deque[_Knot] = deque(maxlen=_KEPT)
        self.index_mm = index_mm
        self.known = False

    def begin_anew(self) -> None:
        """Take note that the board was reset: its count and its clock began again."""
        self._clock = BoardClock()
        self._knots.clear()
        self._offset_mm = None
        self.known = False

    def note(self, position: Position, arrived_s: float) -> bool:
        """Take a frame; False where it shows that the board was reset."""
        continues = self._clock.continues(position.device_ms)
        if not continues:
            self.begin_anew()
        moment_s = self._clock.moment_s(position.device_ms, arrived_s)
        wave_mm = self._wave(position)
        self.known = not math.isnan(wave_mm)
        if self.known:
            self._wave_mm = wave_mm
        if not self._knots or moment_s > self._knots[-1].moment_s:
            self._knots.append(_Knot(moment_s, wave_mm, self._sign * position.speed_mm_s))
        return continues

    def at(self, moments_s: np.ndarray) -> np.ndarray:
        """Return how far the wave was at some moments of the computer's clock; NaN: not known."""
        if not self._knots:
            return np.full(moments_s.shape, np.nan)
        knots_s = np.array([knot.moment_s for knot in self._knots])
        way_mm = np.array([knot.wave_mm for knot in self._knots])
        after = np.searchsorted(knots_s, moments_s, side="right")
        before = np.clip(after - 1, 0, None)
        wave_mm = np.full(moments_s.shape, np.nan)
        inside = (after > 0) & (after < knots_s.size)
        last, following = before[inside], after[inside]
        apart_s = knots_s[following] - knots_s[last]
        share = (moments_s[inside] - knots_s[last]) / np.maximum(apart_s, 1e-9)
        between_mm = way_mm[last] + share * (way_mm[following] - way_mm[last])
        wave_mm[inside] = np.where(apart_s <= FARTHEST_APART_S, between_mm, np.nan)
        beyond_s = moments_s - knots_s[-1]
        ahead = (after == knots_s.size) & (beyond_s <= AHEAD_S)
        wave_mm[ahead] = way_mm[-1] + self._knots[-1].speed_mm_s * beyond_s[ahead]
        return wave_mm

    def _wave(self, position: Position) -> float:
        """Return the wave's way at a frame; NaN where its phase is not known or no wave runs."""
        steps, counted_mm = position.half_steps, self._sign * position.position_mm
        # The more half-steps, the better the frame's millimetres tell how long one is.
        if abs(steps) > self._mm_per_half_step[0]:
            self._mm_per_half_step = abs(steps), counted_mm / steps
        if position.index_half_steps is not None:
            turned_mm = counted_mm - position.index_half_steps * self._mm_per_half_step[1]
            if abs(turned_mm) > LONGEST_TURN * self._wavelength_mm:
                return math.nan
            self._fit(counted_mm, turned_mm)
        if self._offset_mm is None or position.state != RUNNING:
            return math.nan
        return counted_mm + self._offset_mm

    def _fit(self, counted_mm: float, turned_mm: float) -> None:
        """Have the board's count fit the index, which it has passed by some millimetres."""
        since_mm = self._offset_mm
        expected_mm = self._wave_mm if since_mm is None else counted_mm + since_mm
        if self.index_mm is None:
            if since_mm is None:
                return  # the board was reset before its first index
            self.index_mm = (expected_mm - turned_mm) % self._wavelength_mm
        # Whole waves do not matter; those are taken that fit what was before.
        phase_mm = turned_mm + self.index_mm
        turns = round((expected_mm - phase_mm) / self._wavelength_mm)
        self._offset_mm = phase_mm + turns * self._wavelength_mm - counted_mm
