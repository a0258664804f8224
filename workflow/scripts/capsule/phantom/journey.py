"""Simulate a capsule that travels along a gut, wave by wave, and folds and unfolds on command.

All random quantities of a journey are drawn in advance, so that no decision changes them. A run
(`capsule.phantom.simulation`) is a journey over one place: it moves and presses alike. Only its
draws differ: they belong to its place, its set-up and its pass, and its noise is drawn for its own
length.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.phantom.advance import Motion, Strokes, draw_holds, draw_strokes
from capsule.phantom.contact import (
    Bulge,
    bulge_of,
    climbs,
    compression,
    looseness,
    reseated_strength,
    seat_wander,
    stray_offset,
    wandering_strength,
)
from capsule.phantom.origami import half_width, sensor_offsets
from capsule.phantom.parameters import Phantom
from capsule.phantom.sensor import Sensors, counts
from capsule.phantom.wall import (
    Unevenness,
    WaveTrain,
    cam_time,
    draw_unevenness,
    overlap,
    roughness,
    uneven_height,
    wave_height,
    wave_period,
    wave_train,
)
from capsule.seeding import generator

# The peristalsis board's steepest ramp, 100 mm/s^2, stops a wave of 25 mm/s in this time.
_RAMP_S = 0.25


@dataclass(frozen=True)
class Nodule:
    """A nodule under the wall of a long gut."""

    at_mm: float  # distance of sensor 1 from the start when it is over the nodule
    diameter_mm: float


@dataclass(frozen=True)
class Pass:
    """The random quantities of one pass; the capsule was folded between passes."""

    bulges: Sequence[Bulge]  # the nodules, as the capsule meets them in this pass
    # Number of waves for which each awn holds the capsule at each nodule once it catches, (N S,).
    holds: FloatArray
    looseness_mm: float  # standard deviation of the substructures' shift in their seats


@dataclass(frozen=True)
class Chance:
    """The random quantities of one journey that are the same in all its passes."""

    near: Unevenness  # the wall with the nodules
    far: Unevenness  # the wall opposite
    phase: float  # of the wave at place 0 and time 0, in radians
    train: WaveTrain
    strokes: Strokes  # by which the waves move the capsule
    wander: FloatArray  # shift of each seat, with deviation 1, shape (S, K)
    strength: FloatArray  # of each seat's contact, shape (S, K)


def draw_chance(
    phantom: Phantom,
    draw: Callable[[str], np.random.Generator],
    walls: tuple[Unevenness, Unevenness],
    phase: float,
    shape: tuple[int, int],
    waves: int,
) -> Chance:
    """Draw the random quantities of one journey.

    Parameters
    ----------
    draw
        Returns the random numbers of a subject. Each subject has its own stream, so that one
        changed parameter leaves other draws as they are.
    walls, phase
        As in `Chance`.
    shape
        Sensors S and samples K.
    waves
        Number of waves, which must last for all samples.
    """
    (sensors, samples), rate_hz = shape, phantom.electronics.rate_hz
    period_s = wave_period(phantom.wall)
    train = wave_train(phantom.wave, draw("waves"), period_s, waves)
    strokes = draw_strokes(phantom.advance, phantom.folding, draw, period_s, train.crests > 0)
    wander = seat_wander(phantom.contact, draw("wander"), sensors, samples, rate_hz)
    strength = wandering_strength(phantom.seat, draw("strength"), sensors, samples, rate_hz)
    number = (cam_time(train, np.arange(samples) / rate_hz) / period_s).astype(int)
    strength *= reseated_strength(phantom.seat, draw("reseat"), sensors, strokes.slips_mm, number)
    return Chance(*walls, phase, train, strokes, wander, strength)


@dataclass(frozen=True)
class Stretch:
    """Consecutive samples of a journey: arrays of shape (K,)."""

    time_s: FloatArray
    wave_mm: FloatArray  # how far the drive has carried the wave since a crest was at place 0
    folded: FloatArray  # degree of folding, from 0 (unfolded) to 1 (folded)
    head_mm: FloatArray  # true distance of sensor 1 from the start; no controller may use it
    compression_mm: FloatArray  # of each substructure, both halves together, shape (S, K)


class Capsule:
    """A simulated capsule between two walls.

    It moves as a `capsule.phantom.advance.Motion`. If the wave stops, it stays where it is.

    Parameters
    ----------
    draw_pass
        Returns the random quantities of a pass; passes count from 1.
    length_mm
        Length of the gut.

    Attributes
    ----------
    folding : bool
        Whether the origami is folded, or folds.
    """

    def __init__(
        self,
        phantom: Phantom,
        chance: Chance,
        draw_pass: Callable[[int], Pass],
        length_mm: float = np.inf,
    ) -> None:
        self._phantom, self._chance = phantom, chance
        self._draw_pass, self._length_mm = draw_pass, length_mm
        self._offsets = sensor_offsets(phantom.origami, chance.wander.shape[0])
        self._crest_mm = phantom.wall.wavelength_mm * chance.phase / (2 * np.pi)
        self._sample = 0
        self._stopped_s = np.inf
        self.folding, self._folded = False, 0.0
        self._passes = 1
        self._pass = draw_pass(1)
        self._motion = Motion(
            phantom.advance, chance.strokes, self._pass.holds,
            wave_period(phantom.wall), self._rise, length_mm,
        )  # fmt: skip

    @property
    def samples_left(self) -> int:
        """Number of further samples for which random quantities exist."""
        left: int = self._chance.wander.shape[1] - self._sample
        return left

    @property
    def at_end(self) -> bool:
        """Return whether the capsule has arrived at the end of the gut."""
        return self._motion.head_mm >= self._length_mm

    def fold(self) -> None:
        """Begin to fold."""
        self.folding = True

    def unfold(self) -> None:
        """Begin to unfold; the capsule settles in a new seat, which begins a new pass."""
        if self.folding:
            self._passes += 1
            self._pass = self._draw_pass(self._passes)
            self._motion.holds = self._pass.holds
        self.folding = False

    def stop_wave(self) -> None:
        """Begin to stop the wave; it does not start again."""
        self._stopped_s = min(self._stopped_s, self._sample / self._phantom.electronics.rate_hz)

    def press(self, samples: int) -> Stretch:
        """Simulate the next samples: how the capsule moves, and how the walls press it.

        Parameters
        ----------
        samples
            Number of samples K, at most `samples_left`.
        """
        phantom, chance = self._phantom, self._chance
        some = slice(self._sample, self._sample + samples)
        rate_hz = phantom.electronics.rate_hz
        time_s = np.round(np.arange(some.start, some.stop) / rate_hz, 6)
        drive_s = self._drive_time(time_s)
        cams_s = cam_time(chance.train, drive_s)
        folded = self._fold_on(samples)
        head_mm = self._motion.move(cams_s, folded)
        wave_mm = phantom.wall.speed_mm_s * cams_s - self._crest_mm
        pressed_mm = self._compression(head_mm, drive_s, folded, some)
        self._sample = some.stop
        return Stretch(time_s, wave_mm, folded, head_mm, pressed_mm)

    def _compression(
        self, head_mm: FloatArray, drive_s: FloatArray, folded: FloatArray, some: slice
    ) -> FloatArray:
        """Return the compression of each substructure at some samples, in mm: shape (S, K)."""
        phantom, chance, wall = self._phantom, self._chance, self._phantom.wall
        position_mm = head_mm - self._offsets[:, np.newaxis]
        wave_mm = wave_height(wall, phantom.wave, chance.train, position_mm, drive_s, chance.phase)
        near_mm = wave_mm + uneven_height(wall, chance.near, position_mm)
        far_mm = wave_mm + uneven_height(wall, chance.far, position_mm)
        heights, spheres = np.zeros_like(position_mm), np.zeros_like(position_mm)
        for bulge in self._pass.bulges:
            profile = bulge.profile(position_mm)
            heights += bulge.height_mm * bulge.coupling[:, np.newaxis] * profile
            spheres += bulge.sphere_n_mm * profile
        # A substructure that shifts towards one wall moves away from the other wall.
        wander_mm = self._pass.looseness_mm * chance.wander[:, some]
        unfolded_mm, strength = half_width(phantom.origami), chance.strength[:, some]
        reach_mm = unfolded_mm + folded * (phantom.folding.half_width_mm - unfolded_mm)
        near = strength * overlap(wall, reach_mm, near_mm + heights + wander_mm)
        far = strength * overlap(wall, reach_mm, far_mm - wander_mm)
        pressed = compression(phantom.contact, wall, near, spheres)
        return pressed + compression(phantom.contact, wall, far)

    def _rise(self, position_mm: float, stroke_mm: float) -> FloatArray:
        """Return the height that each awn would climb on each nodule in a stroke."""
        return climbs(self._pass.bulges, position_mm - self._offsets, stroke_mm)

    def _drive_time(self, time_s: FloatArray) -> FloatArray:
        """Return the time in s that an unstopped drive needs for the same distance: shape (K,)."""
        ramping_s = np.clip(time_s - self._stopped_s, 0.0, _RAMP_S)
        slower_s = ramping_s - ramping_s**2 / (2 * _RAMP_S)
        return np.minimum(time_s, self._stopped_s) + slower_s

    def _fold_on(self, samples: int) -> FloatArray:
        """Return the degree of folding at each sample; the origami folds at a constant speed."""
        step = 1.0 / (self._phantom.folding.fold_s * self._phantom.electronics.rate_hz)
        way = (1.0 if self.folding else -1.0) * step * np.arange(1, samples + 1)
        folded: FloatArray = np.clip(self._folded + way, 0.0, 1.0)
        self._folded = float(folded[-1])
        return folded


class Journey(Capsule):
    """A simulated capsule in a long gut, whose sensors are read on its way.

    Parameters
    ----------
    seed, name
        They determine all that is random.
    nodules
        The nodules in the gut.
    sensors, samples
        Number of sensors, and the largest number of samples.
    length_mm
        Length of the gut.
    """

    def __init__(
        self,
        phantom: Phantom,
        seed: int,
        name: str,
        nodules: Sequence[Nodule],
        sensors: int,
        samples: int,
        length_mm: float,
    ) -> None:
        def draw(*subject: str) -> np.random.Generator:
            return generator(seed, "journey", name, *subject)

        wall, rate_hz = phantom.wall, phantom.electronics.rate_hz
        rough = roughness(wall, draw("roughness"))
        near, far = (draw_unevenness(wall, draw(side), rough) for side in ("near", "far"))
        phase = draw("phase").uniform(0, 2 * np.pi)
        # Draw more waves than the mean period needs, because periods vary.
        waves = int(np.ceil(1.1 * samples / rate_hz / wave_period(wall))) + 8
        chance = draw_chance(phantom, draw, (near, far), phase, (sensors, samples), waves)
        returns_s = phantom.folding.drift_return_s
        self._sensors = Sensors(
            phantom.sensor, draw("sensor"), (sensors, samples), rate_hz, returns_s
        )
        super().__init__(
            phantom,
            chance,
            lambda number: _draw_pass(phantom, draw, nodules, sensors, number),
            length_mm,
        )

    def advance(self, samples: int) -> tuple[Stretch, IntArray]:
        """Return the next samples, and the readings of the converter: integers, shape (S, K)."""
        stretch = self.press(samples)
        # A partly folded origami shows a part of its compression.
        shown = 1 - stretch.folded * (1 - self._phantom.folding.signal_left)
        ohms = self._sensors.resistance(stretch.compression_mm * shown)
        return stretch, counts(self._phantom.electronics, ohms)


def _draw_pass(
    phantom: Phantom,
    draw: Callable[..., np.random.Generator],
    nodules: Sequence[Nodule],
    sensors: int,
    number: int,
) -> Pass:
    """Draw the random quantities of a pass; passes count from 1.

    A nodule's height offset stays the same, except for the fraction that each pass draws.
    """
    contact, redrawn = phantom.contact, phantom.folding.height_redrawn
    spread_mm = float(np.hypot(contact.series_offset_mm, contact.height_offset_mm))
    bulges, holds = [], [np.empty(0)]
    for which, nodule in enumerate(nodules):
        # Each nodule has its own streams, so that another nodule does not change this one.
        kept = draw("nodule", str(which)).normal(0.0, spread_mm)
        numbers = draw("nodule", str(which), "pass", str(number))
        offset_mm = np.sqrt(1 - redrawn) * kept
        offset_mm += np.sqrt(redrawn) * numbers.normal(0.0, spread_mm)
        offset_mm += stray_offset(contact, numbers)
        coupling = np.exp(numbers.normal(0.0, contact.coupling_spread, sensors))
        bulges.append(
            bulge_of(
                contact, phantom.wall, phantom.origami,
                nodule_mm=nodule.diameter_mm, at_mm=nodule.at_mm,
                height_offset_mm=offset_mm, coupling=coupling,
            )
        )  # fmt: skip
        holds.append(draw_holds(phantom.advance, numbers, sensors))
    return Pass(bulges, np.concatenate(holds), looseness(contact, draw("seat", str(number))))
