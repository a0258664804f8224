"""Draw all random quantities of one journey in advance, so that no decision changes them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.phantom import contact as touch
from capsule.phantom.advance import Strokes, draw_holds, draw_strokes, slips_back
from capsule.phantom.bulge import Bulge, bulge_of
from capsule.phantom.folding import folded_strokes
from capsule.phantom.parameters import Phantom
from capsule.phantom.pressing import Pressing, UnevenWalls
from capsule.phantom.seat import reseated_strength, wandering_strength
from capsule.phantom.sensor import Unloaded, draw_unloaded
from capsule.phantom.wall import draw_unevenness, roughness, wave_period
from capsule.phantom.wave import cam_time, wave_train
from capsule.seeding import generator


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

    Parameters
    ----------
    phantom
        The bench.
    seed
        The session's seed.
    name
        The session's name; the same seed and name give the same journey.
    nodules
        The nodules under the wall.
    sensors
        Number of sensors S.
    samples
        Number of samples K of the longest journey.

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
        self.wander = touch.seat_wander(
            phantom.contact, self._draw("wander"), sensors, samples, rate_hz
        )
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
        walls = UnevenWalls(
            rough, *(draw_unevenness(phantom.wall, self._draw(side)) for side in ("near", "far"))
        )
        phase = self._draw("phase").uniform(0, 2 * np.pi)
        self.pressing = Pressing(phantom.wall, phantom.wave, phantom.contact, walls, train, phase)

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
            offset_mm += touch.stray_offset(contact, numbers)
            coupling = np.exp(numbers.normal(0.0, contact.coupling_spread, self._sensors))
            bulges.append(
                bulge_of(
                    contact, self._phantom.wall, self._phantom.origami,
                    nodule_mm=nodule.diameter_mm, at_mm=nodule.at_mm,
                    height_offset_mm=offset_mm, coupling=coupling,
                )
            )  # fmt: skip
            holds.append(draw_holds(advance, numbers, self._sensors))
        looseness_mm = touch.looseness(contact, self._draw("seat", str(number)))
        return Pass(tuple(bulges), np.concatenate(holds), looseness_mm)
