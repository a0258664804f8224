"""The position of the wave at any moment, from the position frames of the peristalsis board.

The board counts half-steps from its start. With an index switch, the count at the last passage of
the index tells the phase. This holds even after a reset of the board or lost steps of the motor.
Without an index switch only the count tells the phase, and a reset loses it.
"""

import math
from collections import deque

import numpy as np

from capsule.bench.protocol import Position
from capsule.bench.timeline import BoardClock

RUNNING = "running"
# Between two frames further apart than this, the position is unknown.
FARTHEST_APART_S = 1.5
# For so long after the newest frame, the position is extrapolated at the wave's speed.
AHEAD_S = 1.0
# After so many turns without an index, the cam shaft does not follow the motor.
LONGEST_TURN = 1.3
_KEPT = 60


class WavePhase:
    """The position of the wave over time, from the frames of the peristalsis board."""

    def __init__(self, wavelength_mm: float, *, forward: bool) -> None:
        self._wavelength_mm = wavelength_mm
        self._sign = 1.0 if forward else -1.0
        # Added to the board's count, it gives the wave's position; None after a reset.
        self._offset_mm: float | None = 0.0
        self._wave_mm = 0.0
        self._mm_per_half_step = (0, 0.0)
        self._clock = BoardClock()
        # Of each frame its time, the wave's position (NaN: unknown) and its speed.
        self._knots: deque[tuple[float, float, float]] = deque(maxlen=_KEPT)
        # Phase at the index, also of an earlier session; None until the cam shaft has passed it.
        self.index_mm: float | None = None
        self.known = False

    def begin_anew(self) -> None:
        """Forget all frames, because a reset set the board's count and clock to zero."""
        self._clock = BoardClock()
        self._knots.clear()
        self._offset_mm = None
        self.known = False

    def note(self, position: Position, arrived_s: float) -> bool:
        """Store a frame; return False if it shows that the board was reset."""
        continues = self._clock.continues(position.device_ms)
        if not continues:
            self.begin_anew()
        moment_s = self._clock.moment_s(position.device_ms, arrived_s)
        wave_mm = self._wave(position)
        self.known = not math.isnan(wave_mm)
        if self.known:
            self._wave_mm = wave_mm
        if not self._knots or moment_s > self._knots[-1][0]:
            self._knots.append((moment_s, wave_mm, self._sign * position.speed_mm_s))
        return continues

    def at(self, moments_s: np.ndarray) -> np.ndarray:
        """Return the wave's position at moments of the computer's clock; NaN: unknown."""
        if not self._knots:
            return np.full(moments_s.shape, np.nan)
        knots_s, way_mm, speeds_mm_s = np.array(self._knots).T
        wave_mm: np.ndarray = np.interp(moments_s, knots_s, way_mm)
        after = np.searchsorted(knots_s, moments_s, side="right")
        apart_s = np.diff(knots_s, prepend=-np.inf, append=np.inf)[after]
        wave_mm[apart_s > FARTHEST_APART_S] = np.nan
        beyond_s = moments_s - knots_s[-1]
        ahead = (after == knots_s.size) & (beyond_s <= AHEAD_S)
        wave_mm[ahead] = way_mm[-1] + speeds_mm_s[-1] * beyond_s[ahead]
        return wave_mm

    def _wave(self, position: Position) -> float:
        """Return the wave's position at a frame; NaN if its phase is unknown or no wave runs."""
        steps, counted_mm = position.half_steps, self._sign * position.position_mm
        # More half-steps give a more exact length of one half-step.
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
        """Correct the offset of the board's count by the index, passed `turned_mm` ago."""
        since_mm = self._offset_mm
        expected_mm = self._wave_mm if since_mm is None else counted_mm + since_mm
        if self.index_mm is None:
            if since_mm is None:
                return  # the board was reset before its first index
            self.index_mm = (expected_mm - turned_mm) % self._wavelength_mm
        # The index tells the phase only; the number of waves is the one nearest to expectation.
        phase_mm = turned_mm + self.index_mm
        turns = round((expected_mm - phase_mm) / self._wavelength_mm)
        self._offset_mm = phase_mm + turns * self._wavelength_mm - counted_mm
