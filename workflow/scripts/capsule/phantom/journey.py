"""Simulate a capsule that travels along a gut, wave by wave, and folds and unfolds on command.

All random quantities of a journey are drawn in advance, so that no decision changes them. A journey
and a run (`capsule.phantom.simulation`) move, press and sense alike. Only their draws differ: those
of a run belong to its place, its set-up and its pass, and its noise is drawn for its own length.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.phantom.advance import (
    Motion,
    Strokes,
    draw_holds,
    draw_strokes,
    folded_strokes,
    reach,
    shown,
    slips_back,
)
from capsule.phantom.contact import (
    Bulge,
    Pressing,
    bulge_of,
    climbs,
    looseness,
    reseated_strength,
    seat_wander,
    stray_offset,
    wandering_strength,
)
from capsule.phantom.origami import half_width, sensor_offsets
from capsule.phantom.parameters import Phantom
from capsule.phantom.sensor import Polymer, Unloaded, counts, draw_unloaded, loaded_resistance
from capsule.phantom.wall import cam_time, draw_unevenness, roughness, wave_period, wave_train
from capsule.seeding import generator

# The peristalsis board's steepest ramp, 100 mm/s^2, stops a wave of 25 mm/s in this time.
_RAMP_S = 0.25


@dataclass(frozen=True)
class Nodule:
    """A nodule under the wall of a long gut.

    Attributes
    ----------
    at_mm
        Distance of sensor 1 from the start when it is over the nodule.
    diameter_mm
        Diameter.
    """

    at_mm: float
    diameter_mm: float


@dataclass(frozen=True)
class Pass:
    """The random quantities of one pass; the capsule was folded between passes.

    Attributes
    ----------
    bulges
        The nodules, as the capsule meets them in this pass.
    holds
        Number of waves for which each awn holds the capsule at each nodule once it catches,
        shape (N S,).
    looseness_mm
        Standard deviation of the substructures' shift in their seats.
    """

    bulges: tuple[Bulge, ...]
    holds: FloatArray
    looseness_mm: float


class Chance:
    """All random quantities of one journey.

    Attributes
    ----------
    pressing : Pressing
        The gut and its waves.
    strokes : Strokes
        Strokes of the unfolded capsule.
    folded_mm : (waves,) array
        Stroke of the folded capsule.
    slips_mm : (waves,) array
        Slip back at the end of each wave.
    wander, strength : (S, K) arrays
        Shift of each seat, with deviation 1, and the strength of its contact.
    unloaded : Unloaded
        Resistance of the sensors without load.
    """

    def __init__(
        self,
        phantom: Phantom,
        seed: int,
        name: str,
        nodules: Sequence[Nodule],
        sensors: int,
        samples: int,
    ) -> None:
        self._phantom, self._nodules, self._sensors = phantom, tuple(nodules), sensors
        self._names = seed, "journey", name
        advance, rate_hz = phantom.advance, phantom.electronics.rate_hz
        period_s = wave_period(phantom.wall)
        # Draw more waves than the mean period needs, because periods vary.
        waves = int(np.ceil(1.1 * samples / rate_hz / period_s)) + 8
        train = wave_train(phantom.wave, self._draw("waves"), period_s, waves)
        there = train.crests > 0
        self.slips_mm = slips_back(advance, self._draw("slips"), period_s, waves)
        self.strokes: Strokes = draw_strokes(advance, self._draw("advance"), period_s, waves, there)
        self.folded_mm = folded_strokes(
            phantom.folding, self._draw("folded"), period_s, waves, there
        )
        self.wander = seat_wander(phantom.contact, self._draw("wander"), sensors, samples, rate_hz)
        self.strength = wandering_strength(
            phantom.seat, self._draw("strength"), sensors, samples, rate_hz
        )
        number = (cam_time(train, np.arange(samples) / rate_hz) / period_s).astype(int)
        self.strength *= reseated_strength(
            phantom.seat, self._draw("reseat"), sensors, self.slips_mm, number
        )
        self.unloaded: Unloaded = draw_unloaded(
            phantom.sensor,
            self._draw("sensor"),
            (sensors, samples),
            rate_hz,
            phantom.folding.drift_return_s,
        )
        rough = roughness(phantom.wall, self._draw("roughness"))
        near, far = (
            draw_unevenness(phantom.wall, self._draw(side), rough) for side in ("near", "far")
        )
        phase = self._draw("phase").uniform(0, 2 * np.pi)
        self.pressing = Pressing(
            phantom.wall, phantom.wave, phantom.contact, near, far, train, phase
        )

    def _draw(self, *subject: str) -> np.random.Generator:
        return generator(*self._names, *subject)

    def draw_pass(self, number: int) -> Pass:
        """Draw the random quantities of a pass; passes count from 1.

        A nodule's height offset stays the same, except for the fraction that each pass draws.
        """
        contact, advance = self._phantom.contact, self._phantom.advance
        redrawn = self._phantom.folding.height_redrawn
        spread_mm = float(np.hypot(contact.series_offset_mm, contact.height_offset_mm))
        bulges, holds = [], [np.empty(0)]
        for which, nodule in enumerate(self._nodules):
            # Each nodule has its own streams, so that another nodule does not change this one.
            kept = self._draw("nodule", str(which)).normal(0.0, spread_mm)
            numbers = self._draw("nodule", str(which), "pass", str(number))
            offset_mm = np.sqrt(1 - redrawn) * kept
            offset_mm += np.sqrt(redrawn) * numbers.normal(0.0, spread_mm)
            offset_mm += stray_offset(contact, numbers)
            coupling = np.exp(numbers.normal(0.0, contact.coupling_spread, self._sensors))
            bulges.append(
                bulge_of(
                    contact, self._phantom.wall, self._phantom.origami,
                    nodule_mm=nodule.diameter_mm, at_mm=nodule.at_mm,
                    height_offset_mm=offset_mm, coupling=coupling,
                )
            )  # fmt: skip
            holds.append(draw_holds(advance, numbers, self._sensors))
        looseness_mm = looseness(contact, self._draw("seat", str(number)))
        return Pass(tuple(bulges), np.concatenate(holds), looseness_mm)


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

    It moves as a `capsule.phantom.advance.Motion`. If the wave stops, it stays where it is.
    """

    def __init__(self, phantom: Phantom, chance: Chance, length_mm: float) -> None:
        self._phantom, self._chance, self._length_mm = phantom, chance, length_mm
        sensors = chance.wander.shape[0]
        self._offsets = sensor_offsets(phantom.origami, sensors)
        self._crest_mm = phantom.wall.wavelength_mm * chance.pressing.phase / (2 * np.pi)
        self._polymer = Polymer(phantom.sensor, phantom.electronics.rate_hz)
        self._sample = 0
        self._stopped_s = np.inf
        self._folding, self._folded = False, 0.0
        self._bent: float | None = None
        self._passes = 1
        self._pass = chance.draw_pass(1)
        self._motion = Motion(
            phantom.advance, chance.strokes, self._pass.holds, chance.slips_mm,
            wave_period(phantom.wall), self._rise, chance.folded_mm, length_mm,
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
        self._folding = True

    def unfold(self) -> None:
        """Begin to unfold; the capsule settles in a new seat, which begins a new pass."""
        if self._folding:
            self._passes += 1
            self._pass = self._chance.draw_pass(self._passes)
            self._motion.holds = self._pass.holds
        self._folding = False

    def stop_wave(self) -> None:
        """Begin to stop the wave; it does not start again."""
        self._stopped_s = min(self._stopped_s, self._sample / self._phantom.electronics.rate_hz)

    def bend(self, folded: float) -> None:
        """Set the degree of folding (0..1) that the next samples reach, for a motor's origami."""
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
        phantom, chance = self._phantom, self._chance
        some = slice(self._sample, self._sample + samples)
        rate_hz = phantom.electronics.rate_hz
        time_s = np.round(np.arange(some.start, some.stop) / rate_hz, 6)
        drive_s = self._drive_time(time_s)
        cams_s = cam_time(chance.pressing.train, drive_s)
        folded = self._fold_on(samples, rate_hz)
        head_mm = self._motion.move(cams_s, folded)
        compression_mm = chance.pressing.compression(
            self._pass.bulges,
            head_mm - self._offsets[:, np.newaxis],
            drive_s,
            reach(phantom.folding, half_width(phantom.origami), folded),
            self._pass.looseness_mm * chance.wander[:, some],
            chance.strength[:, some],
        )
        followed_mm = self._polymer.follow(compression_mm * shown(phantom.folding, folded))
        unloaded = chance.unloaded
        ohms = loaded_resistance(
            phantom.sensor, unloaded.rest_ohm, unloaded.change[:, some], followed_mm
        )
        self._sample = some.stop
        readings = counts(phantom.electronics, ohms)
        wave_mm = phantom.wall.speed_mm_s * cams_s - self._crest_mm
        return Stretch(time_s, readings, wave_mm, folded, head_mm)

    def _rise(self, position_mm: float, stroke_mm: float) -> FloatArray:
        """Return the height that each awn would climb on each nodule in a stroke."""
        return climbs(self._pass.bulges, position_mm - self._offsets, stroke_mm)

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
