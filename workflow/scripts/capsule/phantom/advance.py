"""Model the capsule's stick-slip advance: a stroke per wave, less at nodules, and back if folded.

All values of the folded capsule are assumed; nothing was measured.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from capsule.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class Advance:
    """Parameters of the capsule's advance by the waves.

    ``config/phantom.yaml`` explains each parameter.
    """

    speed_mm_s: float
    speed_spread: float
    stroke_spread: float
    stick_probability: float
    slip_probability: float
    slip_back: float
    grip_fraction: float
    snag: float
    catch_slope: float
    catch_probability: float
    hold_waves: float
    lead_mm: float
    lead_spread_mm: float
    longest_samples: int


@dataclass(frozen=True)
class Strokes:
    """The random strokes of one journey.

    Attributes
    ----------
    stroke_mm
        Stroke of a typical wave.
    factors
        Factor of each wave on that stroke, shape (waves,).
    moves
        Whether each wave moves the capsule if nothing holds it, shape (waves,).
    """

    stroke_mm: float
    factors: FloatArray
    moves: BoolArray


def stick_and_slip(
    generator: np.random.Generator,
    spread: float,
    stick_probability: float,
    carried: BoolArray | bool,
    waves: int,
) -> tuple[FloatArray, BoolArray, float]:
    """Draw the variation of strokes from wave to wave.

    Parameters
    ----------
    spread
        Spread of the logarithm of a stroke, from wave to wave.
    stick_probability
        Probability that a wave does not move the capsule at all.
    carried
        Whether there is a wave to carry the capsule, shape (waves,).
    waves
        Number of waves.

    Returns
    -------
    factors : array of shape (waves,)
        Factor on the stroke of each wave.
    moves : array of shape (waves,)
        Whether each wave moves the capsule.
    mean : float
        Mean factor over all waves; a wave that does not move the capsule counts as 0.
    """
    factors = np.exp(generator.normal(0.0, spread, waves))
    moves: BoolArray = carried & (generator.random(waves) >= stick_probability)
    return factors, moves, np.exp(spread**2 / 2) * (1 - stick_probability)


def draw_strokes(
    advance: Advance,
    generator: np.random.Generator,
    period_s: float,
    waves: int,
    carried: BoolArray | bool = True,
) -> Strokes:
    """Draw the strokes of one journey.

    Parameters
    ----------
    period_s
        Time from wave to wave.
    waves
        Number of waves.
    carried
        Whether there is a wave to carry the capsule, shape (waves,).
    """
    run_factor = np.exp(generator.normal(0.0, advance.speed_spread))
    # The mean over all waves, including slips back, is the configured speed.
    factors, moves, mean_factor = stick_and_slip(
        generator, advance.stroke_spread, advance.stick_probability, carried, waves
    )
    regained = 1 + advance.slip_probability * advance.slip_back
    stroke = advance.speed_mm_s * period_s * run_factor * regained / mean_factor
    return Strokes(stroke, factors, moves)


def draw_holds(advance: Advance, generator: np.random.Generator, awns: int) -> FloatArray:
    """Draw the number of waves for which each awn holds the capsule once it catches: shape (awns,).

    With several nodules, an awn has one entry per nodule.
    """
    catches = generator.random(awns) < advance.catch_probability
    return np.rint(catches * advance.hold_waves * generator.uniform(0.0, 2.0, awns))


def one_stroke(
    advance: Advance, strokes: Strokes, wave: int, climbs_mm: FloatArray, holds: FloatArray
) -> tuple[float, FloatArray]:
    """Return a wave's stroke in mm, and the number of waves that each awn still holds.

    Parameters
    ----------
    wave
        Number of the wave.
    climbs_mm
        Height that each awn would climb during a typical stroke, shape (awns,).
    holds
        Number of waves for which each awn still holds the capsule once it catches, shape (awns,).
    """
    slopes = climbs_mm / strokes.stroke_mm
    caught = (holds > 0) & (slopes > advance.catch_slope)
    left = holds - caught
    if caught.any() or not strokes.moves[wave]:
        return 0.0, left
    factor = strokes.factors[wave] * np.exp(-advance.snag * slopes.sum())
    return float(strokes.stroke_mm * factor), left


def slips_back(
    advance: Advance, generator: np.random.Generator, period_s: float, waves: int
) -> FloatArray:
    """Return the slip back after each wave's stroke, in mm: shape (waves,).

    Awns hold until they lose their grip. The length of a slip is exponentially distributed.
    """
    slipped = generator.random(waves) < advance.slip_probability
    lengths = generator.exponential(advance.slip_back, waves)
    return advance.speed_mm_s * period_s * np.where(slipped, lengths, 0.0)


class Motion:
    """The motion of a capsule's head, from leg to leg.

    A leg lasts as long as one wave carries the capsule in one way. Each wave carries the unfolded
    capsule forward by a stroke while it grips. Then the capsule rests, or slips back. A wave
    carries the folded capsule by a stroke of another length, usually backward. While the capsule
    folds or unfolds, no wave moves it. It cannot leave the gut at its start, and it stops at its
    end.

    Parameters
    ----------
    advance
        Parameters of the advance.
    strokes
        Strokes of the unfolded capsule.
    holds
        Number of waves for which each awn holds the capsule once it catches, shape (awns,).
    slips_mm
        Slip back at the end of each wave (`slips_back`), shape (waves,).
    period_s
        Time from wave to wave.
    rise
        ``rise(position, stroke)`` returns the height in mm that each awn would climb when the
        head moves from ``position`` by ``stroke``, shape (awns,).
    folded_mm
        Stroke of the folded capsule (`folded_strokes`), shape (waves,).
    length_mm
        Position of the gut's end.

    Attributes
    ----------
    head_mm : float
        Position of the head at the last sample.
    holds : array of shape (awns,)
        Number of waves for which each awn still holds the capsule.
    """

    def __init__(
        self,
        advance: Advance,
        strokes: Strokes,
        holds: FloatArray,
        slips_mm: FloatArray,
        period_s: float,
        rise: Callable[[float, float], FloatArray],
        folded_mm: FloatArray | None = None,
        length_mm: float = np.inf,
    ) -> None:
        self._advance, self._strokes, self.holds = advance, strokes, holds
        self._slips_mm, self._period_s, self._rise = slips_mm, period_s, rise
        self._folded_mm, self._length_mm = folded_mm, length_mm
        # The current leg: its wave and degree of folding, its start, and its distances.
        self._leg: tuple[int, float] | None = None
        self._from_mm = self.head_mm = self._moved_mm = self._slip_mm = self._part = 0.0

    def move(self, cams_s: FloatArray, folded: FloatArray | float = 0.0) -> FloatArray:
        """Return the position of the head at the next samples, in mm: shape (K,).

        Parameters
        ----------
        cams_s
            Times of the samples, from `capsule.phantom.wall.cam_time`, shape (K,).
        folded
            Degree of folding, from 0 (unfolded) to 1 (folded), shape (K,) or a number.
        """
        number, part = np.divmod(cams_s / self._period_s, 1.0)
        number = number.astype(int)
        # Waves move the capsule only if it is fully unfolded (0) or fully folded (1).
        way = np.broadcast_to(folded, number.shape)
        way = np.where((way > 0) & (way < 1), 0.5, way)
        begins = np.flatnonzero((np.diff(number) != 0) | (np.diff(way) != 0)) + 1
        head_mm = np.empty(cams_s.size)
        for some in np.split(np.arange(cams_s.size), begins):
            leg = int(number[some[0]]), float(way[some[0]])
            if leg != self._leg:
                self._begin_leg(leg, float(part[some[0]]))
            carried = _carried_part(self._advance, part[some])
            carried = carried - _carried_part(self._advance, self._part)
            slipped = _slipped_part(self._advance, part[some])
            here_mm = self._from_mm + carried * self._moved_mm - slipped * self._slip_mm
            head_mm[some] = np.clip(here_mm, None, self._length_mm)
            self.head_mm = float(head_mm[some[-1]])
        return head_mm

    def _begin_leg(self, leg: tuple[int, float], part: float) -> None:
        """Begin a new leg: at a new wave, or when folding changes the motion within a wave."""
        wave, folded = leg
        same_wave = self._leg is not None and self._leg[0] == wave
        # A new wave begins where the previous leg ends with its wave, not at the last sample.
        self._from_mm = self.head_mm if same_wave else self._from_mm + self._rest_mm()
        self._leg, self._part = leg, part if same_wave else 0.0
        self._moved_mm = self._slip_mm = 0.0
        if folded == 0:
            climbs_mm = self._rise(self._from_mm, self._strokes.stroke_mm)
            self._moved_mm, self.holds = one_stroke(
                self._advance, self._strokes, wave, climbs_mm, self.holds
            )
            self._slip_mm = float(self._slips_mm[wave])
        elif folded == 1 and self._folded_mm is not None:
            self._moved_mm = max(float(self._folded_mm[wave]), -self._from_mm)

    def _rest_mm(self) -> float:
        """Return the distance that remains in the current leg until the end of its wave, in mm."""
        begun = float(_carried_part(self._advance, self._part))
        return (1 - begun) * self._moved_mm - self._slip_mm


def _carried_part(advance: Advance, part: FloatArray | float) -> FloatArray:
    """Return the fraction of the stroke that is done at a part of the wave's period, 0..1."""
    return _smooth_step(part / advance.grip_fraction)


def _slipped_part(advance: Advance, part: FloatArray | float) -> FloatArray:
    """Return the fraction of the slip back that is done at a part of the wave's period, 0..1."""
    rest = max(1 - advance.grip_fraction, np.finfo(float).eps)
    return _smooth_step((part - advance.grip_fraction) / rest)


def _smooth_step(part: FloatArray | float) -> FloatArray:
    part = np.clip(part, 0.0, 1.0)
    return part**2 * (3 - 2 * part)


def first_arrival(head_mm: FloatArray, position_mm: FloatArray | float) -> IntArray:
    """Return the first sample at which the head reaches each position; K if it never does.

    A capsule that slips back passes a place more than once.
    """
    return np.asarray(np.searchsorted(np.maximum.accumulate(head_mm), position_mm))


@dataclass(frozen=True)
class Folding:
    """Parameters of the folded capsule, and of the differences between passes over a place.

    ``config/phantom.yaml`` explains each parameter.
    """

    half_width_mm: float
    speed_mm_s: float
    stroke_spread: float
    stick_probability: float
    fold_s: float
    signal_left: float
    height_redrawn: float
    drift_return_s: float


def reach(folding: Folding, unfolded_mm: float, folded: FloatArray) -> FloatArray:
    """Return the half width of a partly folded origami, in mm.

    Parameters
    ----------
    unfolded_mm
        Half width of the unfolded origami.
    folded
        Degree of folding, from 0 (unfolded) to 1 (folded), any shape.
    """
    return unfolded_mm + folded * (folding.half_width_mm - unfolded_mm)


def shown(folding: Folding, folded: FloatArray) -> FloatArray:
    """Return the fraction of its compression that a partly folded origami shows."""
    return 1 - folded * (1 - folding.signal_left)


def folded_strokes(
    folding: Folding,
    generator: np.random.Generator,
    period_s: float,
    waves: int,
    carried: BoolArray | bool = True,
) -> FloatArray:
    """Draw the distance that each wave moves the folded capsule, in mm: shape (waves,).

    Parameters
    ----------
    period_s
        Time from wave to wave.
    waves
        Number of waves.
    carried
        Whether each wave has a crest, shape (waves,).
    """
    factors, moves, mean = stick_and_slip(
        generator, folding.stroke_spread, folding.stick_probability, carried, waves
    )
    return np.where(moves, folding.speed_mm_s * period_s * factors / mean, 0.0)
