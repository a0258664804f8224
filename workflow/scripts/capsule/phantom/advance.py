"""Model the capsule's stick-slip advance: one stroke per wave, reduced by nodules and slips."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar, overload

import numpy as np

from capsule.arrays import BoolArray, FloatArray, IntArray

Numbers = TypeVar("Numbers", float, FloatArray)


@dataclass(frozen=True)
class Advance:
    """Parameters of the capsule's advance by the waves.

    Attributes
    ----------
    speed_mm_s
        Mean speed of advance on a smooth wall.
    speed_spread
        Spread of the logarithm of the speed, from run to run.
    stroke_spread
        Spread of the logarithm of a stroke, from wave to wave.
    stick_probability
        Probability that a wave does not move the capsule at all.
    slip_probability
        Probability that the capsule slips back between one stroke and the next.
    slip_back
        Mean length of such a slip, as a multiple of the mean advance per wave.
    grip_fraction
        Fraction of a wave's period in which the wave grips and moves the capsule.
    snag
        How strongly a slope of the wall under the awns shortens (or, downhill, lengthens) a stroke.
    catch_slope
        Slope of the wall under an awn from which the awn may catch.
    catch_probability
        Probability that an awn can catch on such a slope, drawn once for each awn and run.
    hold_waves
        Mean number of waves for which a caught awn holds the capsule; the number is uniform from
        0 to twice the mean.
    lead_mm
        Distance before sensor 1 meets the nodule, and after the last sensor has left it.
    lead_spread_mm
        Spread of the distance before the nodule, from run to run.
    longest_samples
        Limit of a run's samples, at which a person stops the run.
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


def stroke_positions(
    advance: Advance,
    generator: np.random.Generator,
    period_s: float,
    waves: int,
    rise: Callable[[float, float], FloatArray],
    sensors: int,
    *,
    slips_mm: FloatArray | float = 0.0,
    carried: BoolArray | bool = True,
) -> FloatArray:
    """Return the position of the head at the start of each wave, in mm: shape (waves + 1,).

    Parameters
    ----------
    period_s
        Time from wave to wave.
    waves
        Number of waves.
    rise
        ``rise(position, stroke)`` returns the height in mm that each awn would climb when the
        head moves from ``position`` by ``stroke``, shape (S,).
    sensors
        Number of substructures S, each with an awn.
    slips_mm
        Slip back after each stroke (`slips_back`), shape (waves,).
    carried
        Whether there is a wave to carry the capsule, shape (waves,).
    """
    slips_mm = np.broadcast_to(slips_mm, waves)
    strokes = draw_strokes(advance, generator, period_s, waves, carried)
    holds = draw_holds(advance, generator, sensors)
    positions = np.zeros(waves + 1)
    for wave in range(waves):
        climbs_mm = rise(positions[wave], strokes.stroke_mm)
        moved_mm, holds = one_stroke(advance, strokes, wave, climbs_mm, holds)
        positions[wave + 1] = positions[wave] + moved_mm - slips_mm[wave]
    return positions


def head_position(
    advance: Advance,
    positions_mm: FloatArray,
    period_s: float,
    time_s: FloatArray,
    slips_mm: FloatArray | float = 0.0,
) -> FloatArray:
    """Return the head's position over time, in mm.

    In each period, the capsule moves while the wave grips it. Then it rests, or slips back.

    Parameters
    ----------
    positions_mm
        Position at the start of each wave, shape (waves + 1,).
    time_s
        Times of the samples, from `capsule.phantom.wave.cam_time`, shape (K,).
    slips_mm
        Slip back at the end of each wave, shape (waves,).
    """
    slips_mm = np.broadcast_to(slips_mm, positions_mm.size - 1)
    wave, part = np.divmod(time_s / period_s, 1.0)
    wave = wave.astype(int)
    carried, slipped = carried_part(advance, part), slipped_part(advance, part)
    farthest_mm = positions_mm[wave + 1] + slips_mm[wave]
    advanced_mm = carried * (farthest_mm - positions_mm[wave])
    head_mm: FloatArray = positions_mm[wave] + advanced_mm - slipped * slips_mm[wave]
    return head_mm


def carried_part(advance: Advance, part: Numbers) -> Numbers:
    """Return the fraction of the stroke that is done at a part of the period, 0..1.

    Parameters
    ----------
    part
        Elapsed fraction of the wave's period, 0..1.
    """
    return _smooth_step(part / advance.grip_fraction)


def slipped_part(advance: Advance, part: Numbers) -> Numbers:
    """Return the fraction of the slip back that is done at a part of the period, 0..1."""
    rest = max(1 - advance.grip_fraction, np.finfo(float).eps)
    return _smooth_step((part - advance.grip_fraction) / rest)


@overload
def first_arrival(head_mm: FloatArray, position_mm: float) -> np.intp: ...
@overload
def first_arrival(head_mm: FloatArray, position_mm: FloatArray) -> IntArray: ...
def first_arrival(head_mm: FloatArray, position_mm: FloatArray | float) -> IntArray | np.intp:
    """Return the first sample at which the head reaches each position; K if it never does.

    A capsule that slips back passes a place more than once.
    """
    return np.searchsorted(np.maximum.accumulate(head_mm), position_mm)


def _smooth_step(part: Numbers) -> Numbers:
    part = np.clip(part, 0.0, 1.0)
    return part**2 * (3 - 2 * part)
