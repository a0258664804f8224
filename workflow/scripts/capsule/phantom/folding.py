"""Model the folded capsule and its motion. All values are assumed; nothing was measured."""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import BoolArray, FloatArray
from capsule.phantom.advance import stick_and_slip


@dataclass(frozen=True)
class Folding:
    """Parameters of the folded capsule, and of the differences between passes over a place.

    Attributes
    ----------
    half_width_mm
        Distance from the folded capsule's axis to the tips of its awns.
    speed_mm_s
        Mean speed of the folded capsule; negative if the waves push it back.
    stroke_spread
        Spread of the logarithm of a folded stroke, from wave to wave.
    stick_probability
        Probability that a wave slips past the folded capsule without moving it.
    fold_s
        Time in which the origami folds, or unfolds; meanwhile no wave moves it.
    signal_left
        Fraction of the compression that the sensors still show when folded.
    height_redrawn
        Fraction, 0..1, of the variance of a nodule's height offset that is drawn for each pass.
    drift_return_s
        Time constant with which the drift of the sensors returns, over the hours of a session.
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
