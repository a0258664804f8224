"""How the origami folds, and what peristalsis then does to it: assumed, nothing was measured."""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import BoolArray, FloatArray
from capsule.phantom.advance import stick_and_slip


@dataclass(frozen=True)
class Folding:
    """The folded capsule, and what differs from one pass over a place to the next.

    Attributes
    ----------
    half_width_mm
        Distance from the capsule's axis to the tips of its awns when it is folded.
    speed_mm_s
        Mean speed of the folded capsule; below 0 the waves push it back.
    stroke_spread
        Spread of the logarithm of a folded stroke, from wave to wave.
    stick_probability
        Probability that a wave does not move the folded capsule: it slips past.
    fold_s
        Time in which the origami folds, or unfolds; meanwhile no wave moves it.
    signal_left
        Part of the compression that the sensors still show when folded.
    height_redrawn
        Part of a nodule's height against the capsule that is drawn anew in each pass, 0..1.
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
    """Return the half width of an origami that is folded in part, in mm.

    Parameters
    ----------
    unfolded_mm
        Half width of the unfolded origami.
    folded
        Part of the way to folded, 0..1, any shape.
    """
    return unfolded_mm + folded * (folding.half_width_mm - unfolded_mm)


def shown(folding: Folding, folded: FloatArray) -> FloatArray:
    """Return the part of its compression that an origami shows that is folded in part."""
    return 1 - folded * (1 - folding.signal_left)


def folded_strokes(
    folding: Folding,
    generator: np.random.Generator,
    period_s: float,
    waves: int,
    carried: BoolArray | bool = True,
) -> FloatArray:
    """Draw how far each wave would push the folded capsule, in mm: shape (waves,).

    Parameters
    ----------
    period_s
        Time from wave to wave.
    waves
        Number of waves.
    carried
        Whether there is a wave at all, shape (waves,).
    """
    factors, moves, mean = stick_and_slip(
        generator, folding.stroke_spread, folding.stick_probability, carried, waves
    )
    return np.where(moves, folding.speed_mm_s * period_s * factors / mean, 0.0)
