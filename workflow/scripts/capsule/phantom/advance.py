"""Stick-slip advance of the capsule: one stroke a wave, held back where an awn climbs a nodule."""

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
    grip_fraction: float
    snag: float
    catch_slope: float
    catch_probability: float
    hold_waves: float
    lead_mm: float
    lead_spread_mm: float
    longest_samples: int


def stroke_positions(
    advance: Advance,
    generator: np.random.Generator,
    period_s: float,
    waves: int,
    rise: Callable[[float, float], np.ndarray],
    sensors: int,
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
    """
    run_factor = np.exp(generator.normal(0.0, advance.speed_spread))
    stroke_factors = np.exp(generator.normal(0.0, advance.stroke_spread, waves))
    chances = generator.random(waves)
    catches = generator.random(sensors) < advance.catch_probability
    holds = np.rint(catches * advance.hold_waves * generator.uniform(0.0, 2.0, sensors))
    # The mean over sticking and slipping waves is the speed that is set.
    mean_factor = np.exp(advance.stroke_spread**2 / 2) * (1 - advance.stick_probability)
    stroke = advance.speed_mm_s * period_s * run_factor / mean_factor
    positions = np.zeros(waves + 1)
    for wave in range(waves):
        slopes = rise(positions[wave], stroke) / stroke
        caught = (holds > 0) & (slopes > advance.catch_slope)
        holds -= caught
        slips = chances[wave] >= advance.stick_probability and not caught.any()
        moved = stroke * stroke_factors[wave] * np.exp(-advance.snag * slopes.sum())
        positions[wave + 1] = positions[wave] + (moved if slips else 0.0)
    return positions


def head_position(
    advance: Advance, positions_mm: np.ndarray, period_s: float, time_s: np.ndarray
) -> np.ndarray:
    """Return the head's position over time, in mm: it rests, then moves with each wave's grip.

    Parameters
    ----------
    positions_mm
        Position at the start of each wave, shape (waves + 1,).
    time_s
        Times to evaluate, shape (K,).
    """
    wave, part = np.divmod(time_s / period_s, 1.0)
    wave = wave.astype(int)
    gripped = np.clip(part / advance.grip_fraction, 0.0, 1.0)
    smooth = gripped**2 * (3 - 2 * gripped)
    return positions_mm[wave] + smooth * (positions_mm[wave + 1] - positions_mm[wave])
