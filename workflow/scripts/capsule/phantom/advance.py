"""Stick-slip advance of the capsule: a stroke a wave, held back by nodules and by slips back."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar, overload

import numpy as np

from capsule.arrays import BoolArray, FloatArray, IntArray

Numbers = TypeVar("Numbers", float, FloatArray)


@dataclass(frozen=True)
class Advance:
    """How the waves carry the capsule.

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
        Mean length of such a slip, in parts of the mean way of a wave; it may exceed 1.
    grip_fraction
        Part of a wave's period in which the wave grips and moves the capsule.
    snag
        How strongly a slope of the wall under the awns shortens (or, downhill, lengthens) a stroke.
    catch_slope
        Slope of the wall under an awn from which the awn may catch.
    catch_probability
        Probability that an awn catches on such a slope at all, drawn once for each awn and run.
    hold_waves
        Mean number of waves for which a caught awn holds the capsule; some hold hardly at all,
        some twice as long.
    lead_mm
        Way before sensor 1 meets the nodule, and after sensor 4 has left it.
    lead_spread_mm
        Spread of the way before the nodule, from run to run.
    longest_samples
        The run is stopped by hand at this many samples.
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
    """What chance makes of the strokes of one journey.

    Attributes
    ----------
    stroke_mm
        Stroke of a usual wave.
    factors
        Factor on it, from wave to wave, shape (waves,).
    moves
        Whether a wave moves the capsule where nothing holds it, shape (waves,).
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
    """Draw how the strokes of some waves differ.

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
        Whether it moves the capsule.
    mean : float
        Mean factor over the waves that move it and those that do not.
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
    # The mean over sticking and slipping waves is the speed that is set, slips back included.
    factors, moves, mean_factor = stick_and_slip(
        generator, advance.stroke_spread, advance.stick_probability, carried, waves
    )
    regained = 1 + advance.slip_probability * advance.slip_back
    stroke = advance.speed_mm_s * period_s * run_factor * regained / mean_factor
    return Strokes(stroke, factors, moves)


def draw_holds(advance: Advance, generator: np.random.Generator, awns: int) -> FloatArray:
    """Draw for how many waves each awn will hold the capsule once it catches: shape (awns,).

    Where several nodules lie along the way, an awn has a chance of its own at each.
    """
    catches = generator.random(awns) < advance.catch_probability
    return np.rint(catches * advance.hold_waves * generator.uniform(0.0, 2.0, awns))


def one_stroke(
    advance: Advance, strokes: Strokes, wave: int, climbs_mm: FloatArray, holds: FloatArray
) -> tuple[float, FloatArray]:
    """Return how far a wave carries the capsule, in mm, and the waves that its awns still hold.

    Parameters
    ----------
    wave
        Number of the wave.
    climbs_mm
        By how much each awn would climb during a usual stroke, shape (awns,).
    holds
        For how many waves each awn still holds the capsule once it catches, shape (awns,).
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
    """Return how far the capsule slips back after each wave's stroke, in mm: shape (waves,).

    Awns hold until they lose their grip; how far the capsule then falls back has no typical
    length (it is exponentially distributed).
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
    """Return where the capsule's head stands at the start of each wave, in mm: shape (waves + 1,).

    Parameters
    ----------
    period_s
        Time from wave to wave.
    waves
        Number of waves.
    rise
        ``rise(position, stroke)``: by how much, in mm, each awn would climb when the head moves
        from ``position`` by ``stroke``; shape (S,).
    sensors
        Number of substructures S, each with an awn.
    slips_mm
        How far the capsule slips back after each stroke (`slips_back`), shape (waves,).
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
    """Return the head's position over time, in mm: it moves with each wave's grip, then rests.

    A capsule that slips back does so while it would rest.

    Parameters
    ----------
    positions_mm
        Position at the start of each wave, shape (waves + 1,).
    time_s
        Times to evaluate, as the cams count them, shape (K,).
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
    """Return how much of its stroke a wave has carried the capsule by then, 0..1.

    Parameters
    ----------
    part
        Part of the wave's period that is over, 0..1.
    """
    return _smooth_step(part / advance.grip_fraction)


def slipped_part(advance: Advance, part: Numbers) -> Numbers:
    """Return how much of the way back after a wave the capsule has slipped by then, 0..1."""
    rest = max(1 - advance.grip_fraction, np.finfo(float).eps)
    return _smooth_step((part - advance.grip_fraction) / rest)


@overload
def first_arrival(head_mm: FloatArray, position_mm: float) -> np.intp: ...
@overload
def first_arrival(head_mm: FloatArray, position_mm: FloatArray) -> IntArray: ...
def first_arrival(head_mm: FloatArray, position_mm: FloatArray | float) -> IntArray | np.intp:
    """Return the sample at which the head first stands at each position; K where it never does.

    A capsule that slips back passes a place more than once.
    """
    return np.searchsorted(np.maximum.accumulate(head_mm), position_mm)


def _smooth_step(part: Numbers) -> Numbers:
    part = np.clip(part, 0.0, 1.0)
    return part**2 * (3 - 2 * part)
