"""Simulate a capsule that travels along a gut, wave by wave, and folds and unfolds on command."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.geometry.origami import half_width, sensor_offsets
from capsule.phantom.advance import Strokes, carried_part, one_stroke, slipped_part
from capsule.phantom.bulge import climbs
from capsule.phantom.chance import Pass
from capsule.phantom.folding import reach, shown
from capsule.phantom.parameters import Phantom
from capsule.phantom.pressing import Pressing
from capsule.phantom.sensor import Polymer, Unloaded, counts, loaded_resistance
from capsule.phantom.wall import wave_period
from capsule.phantom.wave import cam_time

# The peristalsis board's steepest ramp, 100 mm/s^2, stops a wave of 25 mm/s in this time.
_RAMP_S = 0.25


class Fate(Protocol):
    """The random quantities of a journey, as `capsule.phantom.chance.Chance` draws them."""

    pressing: Pressing
    strokes: Strokes
    folded_mm: FloatArray
    slips_mm: FloatArray
    wander: FloatArray
    strength: FloatArray
    unloaded: Unloaded

    def draw_pass(self, number: int) -> Pass:
        """Draw the random quantities of a pass; passes count from 1."""


@dataclass(frozen=True)
class Stretch:
    """Consecutive samples of a journey.

    Attributes
    ----------
    time_s
        Times of the samples, shape (K,).
    counts
        Readings of the converter, integers, shape (S, K).
    wave_mm
        Distance that the drive has carried the wave since a crest was at place 0, shape (K,).
    folded
        Degree of folding, from 0 (unfolded) to 1 (folded), shape (K,).
    head_mm
        True distance of sensor 1 from the start, shape (K,). No controller may use it.
    """

    time_s: FloatArray
    counts: IntArray
    wave_mm: FloatArray
    folded: FloatArray
    head_mm: FloatArray


class Journey:
    """A simulated capsule between two walls.

    Each wave carries the unfolded capsule forward by a stroke. A wave carries the folded capsule
    by a stroke of another length, usually backward. While the capsule folds or unfolds, no wave
    moves it. The capsule cannot leave the gut at its start, and it stops at its end. If the wave
    stops, the capsule stays where it is.

    Parameters
    ----------
    phantom
        The bench.
    fate
        The random quantities of the journey.
    length_mm
        Position of the gut's end.
    """

    def __init__(self, phantom: Phantom, fate: Fate, length_mm: float) -> None:
        self._phantom, self._fate, self._length_mm = phantom, fate, length_mm
        sensors = fate.wander.shape[0]
        self._offsets = sensor_offsets(phantom.origami, sensors)
        self._period_s = wave_period(phantom.wall)
        self._crest_mm = phantom.wall.wavelength_mm * fate.pressing.phase / (2 * np.pi)
        self._polymer = Polymer(phantom.sensor, phantom.electronics.rate_hz)
        self._sample = 0
        self._stopped_s = np.inf
        self._folding, self._folded = False, 0.0
        self._bent: float | None = None
        self._passes = 1
        self._pass = fate.draw_pass(1)
        self._holds = self._pass.holds
        # The current leg: its wave and degree of folding, its start, and its distances.
        self._leg: tuple[int, float] | None = None
        self._from_mm = self._head_mm = self._moved_mm = self._slip_mm = self._part = 0.0

    @property
    def samples_left(self) -> int:
        """Number of further samples for which random quantities exist."""
        left: int = self._fate.wander.shape[1] - self._sample
        return left

    @property
    def at_end(self) -> bool:
        """Return whether the capsule has arrived at the end of the gut."""
        return self._head_mm >= self._length_mm

    def fold(self) -> None:
        """Begin to fold."""
        self._folding = True

    def unfold(self) -> None:
        """Begin to unfold; the capsule settles in a new seat, which begins a new pass."""
        if self._folding:
            self._passes += 1
            self._pass = self._fate.draw_pass(self._passes)
            self._holds = self._pass.holds
        self._folding = False

    def stop_wave(self) -> None:
        """Begin to stop the wave; it does not start again."""
        self._stopped_s = min(self._stopped_s, self._sample / self._phantom.electronics.rate_hz)

    def bend(self, folded: float) -> None:
        """Set the degree of folding that the next samples reach, for an origami moved by a motor.

        Parameters
        ----------
        folded
            Degree of folding, from 0 (unfolded) to 1 (folded).
        """
        if folded > self._folded:
            self.fold()
        elif folded < self._folded:
            self.unfold()
        self._bent = folded

    def advance(self, samples: int) -> Stretch:
        """Simulate the next samples.

        Parameters
        ----------
        samples
            Number of samples K, at most `samples_left`.
        """
        phantom, fate = self._phantom, self._fate
        some = slice(self._sample, self._sample + samples)
        rate_hz = phantom.electronics.rate_hz
        time_s = np.round(np.arange(some.start, some.stop) / rate_hz, 6)
        drive_s = self._drive_time(time_s)
        cams_s = cam_time(fate.pressing.train, drive_s)
        folded = self._fold_on(samples, rate_hz)
        head_mm = self._move_on(cams_s, folded)
        compression_mm = fate.pressing.compression(
            self._pass.bulges,
            head_mm - self._offsets[:, np.newaxis],
            drive_s,
            reach(phantom.folding, half_width(phantom.origami), folded),
            self._pass.looseness_mm * fate.wander[:, some],
            fate.strength[:, some],
        )
        followed_mm = self._polymer.follow(compression_mm * shown(phantom.folding, folded))
        unloaded = fate.unloaded
        ohms = loaded_resistance(
            phantom.sensor, unloaded.rest_ohm, unloaded.change[:, some], followed_mm
        )
        self._sample = some.stop
        readings = counts(phantom.electronics, ohms)
        wave_mm = phantom.wall.speed_mm_s * cams_s - self._crest_mm
        return Stretch(time_s, readings, wave_mm, folded, head_mm)

    def _drive_time(self, time_s: FloatArray) -> FloatArray:
        """Return the time in s that an unstopped drive needs for the same distance: shape (K,)."""
        ramping_s = np.clip(time_s - self._stopped_s, 0.0, _RAMP_S)
        slower_s = ramping_s - ramping_s**2 / (2 * _RAMP_S)
        return np.minimum(time_s, self._stopped_s) + slower_s

    def _fold_on(self, samples: int, rate_hz: float) -> FloatArray:
        """Return the degree of folding at each sample; the origami folds at a constant speed."""
        if self._bent is not None:
            folded = np.linspace(self._folded, self._bent, samples + 1)[1:]
            self._folded = self._bent
            return folded
        step = 1.0 / (self._phantom.folding.fold_s * rate_hz)
        way = (1.0 if self._folding else -1.0) * step * np.arange(1, samples + 1)
        folded = np.clip(self._folded + way, 0.0, 1.0)
        self._folded = float(folded[-1])
        return folded

    def _move_on(self, cams_s: FloatArray, folded: FloatArray) -> FloatArray:
        """Return the position of the head at each sample, in mm."""
        number, part = np.divmod(cams_s / self._period_s, 1.0)
        number = number.astype(int)
        # Waves move the capsule only if it is fully unfolded (0) or fully folded (1).
        way = np.where((folded > 0) & (folded < 1), 0.5, folded)
        begins = np.flatnonzero((np.diff(number) != 0) | (np.diff(way) != 0)) + 1
        head_mm = np.empty(cams_s.size)
        for some in np.split(np.arange(cams_s.size), begins):
            leg = int(number[some[0]]), float(way[some[0]])
            if leg != self._leg:
                self._begin_leg(leg, float(part[some[0]]))
            advance = self._phantom.advance
            carried = carried_part(advance, part[some]) - carried_part(advance, self._part)
            slipped = slipped_part(advance, part[some])
            here_mm = self._from_mm + carried * self._moved_mm - slipped * self._slip_mm
            head_mm[some] = np.clip(here_mm, None, self._length_mm)
            self._head_mm = float(head_mm[some[-1]])
        return head_mm

    def _begin_leg(self, leg: tuple[int, float], part: float) -> None:
        """Begin a new leg: at a new wave, or when folding changes the motion within a wave."""
        wave, folded = leg
        same_wave = self._leg is not None and self._leg[0] == wave
        # A new wave begins where the previous leg ends with its wave, not at the last sample.
        self._from_mm = self._head_mm if same_wave else self._from_mm + self._rest_mm()
        self._leg, self._part = leg, part if same_wave else 0.0
        self._moved_mm = self._slip_mm = 0.0
        if folded == 0:
            fate = self._fate
            climbs_mm = climbs(
                self._pass.bulges, self._from_mm - self._offsets, fate.strokes.stroke_mm
            )
            self._moved_mm, self._holds = one_stroke(
                self._phantom.advance, fate.strokes, wave, climbs_mm, self._holds
            )
            self._slip_mm = float(fate.slips_mm[wave])
        elif folded == 1:
            self._moved_mm = max(float(self._fate.folded_mm[wave]), -self._from_mm)

    def _rest_mm(self) -> float:
        """Return the distance that remains in the current leg until the end of its wave, in mm."""
        begun = float(carried_part(self._phantom.advance, np.float64(self._part)))
        return (1 - begun) * self._moved_mm - self._slip_mm
