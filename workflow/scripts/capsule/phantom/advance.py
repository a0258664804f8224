"""Stick-slip advance of the capsule: a stroke a wave, held back by nodules and by slips back."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


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


def slips_back(
    advance: Advance, generator: np.random.Generator, period_s: float, waves: int
) -> np.ndarray:
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
    rise: Callable[[float, float], np.ndarray],
    sensors: int,
    *,
    slips_mm: np.ndarray | float = 0.0,
    carried: np.ndarray | bool = True,
) -> np.ndarray:
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
    slips_mm, carried = np.broadcast_to(slips_mm, waves), np.broadcast_to(carried, waves)
    run_factor = np.exp(generator.normal(0.0, advance.speed_spread))
    stroke_factors = np.exp(generator.normal(0.0, advance.stroke_spread, waves))
    chances = generator.random(waves)
    catches = generator.random(sensors) < advance.catch_probability
    holds = np.rint(catches * advance.hold_waves * generator.uniform(0.0, 2.0, sensors))
    # The mean over sticking and slipping waves is the speed that is set, slips back included.
    mean_factor = np.exp(advance.stroke_spread**2 / 2) * (1 - advance.stick_probability)
    regained = 1 + advance.slip_probability * advance.slip_back
    stroke = advance.speed_mm_s * period_s * run_factor * regained / mean_factor
    positions = np.zeros(waves + 1)
    for wave in range(waves):
        slopes = rise(positions[wave], stroke) / stroke
        caught = (holds > 0) & (slopes > advance.catch_slope)
        holds -= caught
        moves = carried[wave] and chances[wave] >= advance.stick_probability and not caught.any()
        moved = stroke * stroke_factors[wave] * np.exp(-advance.snag * slopes.sum())
        positions[wave + 1] = positions[wave] + (moved if moves else 0.0) - slips_mm[wave]
    return positions


def head_position(
    advance: Advance,
    positions_mm: np.ndarray,
    period_s: float,
    time_s: np.ndarray,
    slips_mm: np.ndarray | float = 0.0,
) -> np.ndarray:
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
    carried = _smooth_step(part / advance.grip_fraction)
    rest = max(1 - advance.grip_fraction, np.finfo(float).eps)
    slipped = _smooth_step((part - advance.grip_fraction) / rest)
    farthest_mm = positions_mm[wave + 1] + slips_mm[wave]
    advanced_mm = carried * (farthest_mm - positions_mm[wave])
    return positions_mm[wave] + advanced_mm - slipped * slips_mm[wave]


def first_arrival(head_mm: np.ndarray, position_mm: np.ndarray | float) -> np.ndarray:
    """Return the sample at which the head first stands at each position; K where it never does.

    A capsule that slips back passes a place more than once.
    """
    return np.searchsorted(np.maximum.accumulate(head_mm), position_mm)


def _smooth_step(part: np.ndarray) -> np.ndarray:
    part = np.clip(part, 0.0, 1.0)
    return part**2 * (3 - 2 * part)
