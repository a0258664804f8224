"""Model the capsule's stick-slip advance: a stroke per wave, less at nodules, and back if folded.

All values of the folded capsule are assumed; nothing was measured.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from capsule.arrays import BoolArray, FloatArray, IntArray
from capsule.phantom.quantities import Limits, MostShare, Positive, PositiveShare, Share, Signed


@dataclass(frozen=True)
class Advance:
    """Parameters of the capsule's advance by the waves."""

    speed_mm_s: Positive
    speed_spread: float
    stroke_spread: float
    stick_probability: MostShare
    slip_probability: Share
    slip_back: float
    grip_fraction: PositiveShare
    snag: Signed
    catch_slope: float
    catch_probability: Share
    hold_waves: float
    lead_mm: float
    lead_spread_mm: float
    longest_samples: Annotated[int, Limits(low=2)]


@dataclass(frozen=True)
class Folding:
    """Parameters of the folded capsule, and of the differences between passes over a place."""

    half_width_mm: float
    speed_mm_s: Signed
    stroke_spread: float
    stick_probability: MostShare
    fold_s: Positive
    signal_left: Share
    height_redrawn: Share
    drift_return_s: Positive


@dataclass(frozen=True)
class Strokes:
    """The random strokes of one journey, in mm.

    Attributes
    ----------
    typical_mm
        Stroke of a typical wave.
    ahead_mm
        Stroke of each wave if nothing holds the capsule, shape (waves,); 0 if it sticks.
    slips_mm
        Slip back at the end of each wave, shape (waves,).
    folded_mm
        Stroke of the folded capsule, shape (waves,).
    """

    typical_mm: float
    ahead_mm: FloatArray
    slips_mm: FloatArray
    folded_mm: FloatArray


def draw_strokes(
    advance: Advance,
    folding: Folding,
    draw: Callable[[str], np.random.Generator],
    period_s: float,
    carried: BoolArray,
) -> Strokes:
    """Draw the strokes of one journey.

    Parameters
    ----------
    draw
        Returns the random numbers of a subject: ``advance``, ``slips`` or ``folded``.
    period_s
        Time from wave to wave.
    carried
        Whether each wave has a crest to carry the capsule, shape (waves,).
    """
    numbers, wave_mm = draw("advance"), advance.speed_mm_s * period_s
    run_factor = np.exp(numbers.normal(0.0, advance.speed_spread))
    # The mean over all waves, including slips back, is the configured speed.
    regained = 1 + advance.slip_probability * advance.slip_back
    typical_mm, ahead_mm = _stick_and_slip(
        numbers,
        wave_mm * run_factor * regained,
        advance.stroke_spread,
        advance.stick_probability,
        carried,
    )
    numbers = draw("slips")
    slipped = numbers.random(carried.size) < advance.slip_probability
    # Awns hold until they lose their grip. The length of a slip is exponentially distributed.
    lengths = numbers.exponential(advance.slip_back, carried.size)
    _, folded_mm = _stick_and_slip(
        draw("folded"),
        folding.speed_mm_s * period_s,
        folding.stroke_spread,
        folding.stick_probability,
        carried,
    )
    return Strokes(typical_mm, ahead_mm, wave_mm * np.where(slipped, lengths, 0.0), folded_mm)


def _stick_and_slip(
    numbers: np.random.Generator,
    mean_mm: float,
    spread: float,
    stick_probability: float,
    carried: BoolArray,
) -> tuple[float, FloatArray]:
    """Draw strokes that vary from wave to wave.

    Parameters
    ----------
    mean_mm
        Mean stroke of the waves that have a crest, including those that do not move the capsule.
    spread
        Spread of the logarithm of a stroke, from wave to wave.
    stick_probability
        Probability that a wave does not move the capsule at all.
    carried
        Whether each wave has a crest, shape (waves,).

    Returns
    -------
    typical_mm : float
        Stroke of a typical wave.
    strokes_mm : array of shape (waves,)
        Stroke of each wave.
    """
    factors = np.exp(numbers.normal(0.0, spread, carried.size))
    moves = carried & (numbers.random(carried.size) >= stick_probability)
    typical_mm = mean_mm / (np.exp(spread**2 / 2) * (1 - stick_probability))
    return typical_mm, np.where(moves, typical_mm * factors, 0.0)


def draw_holds(advance: Advance, generator: np.random.Generator, awns: int) -> FloatArray:
    """Draw the number of waves for which each awn holds the capsule once it catches: shape (awns,).

    With several nodules, an awn has one entry per nodule.
    """
    catches = generator.random(awns) < advance.catch_probability
    return np.rint(catches * advance.hold_waves * generator.uniform(0.0, 2.0, awns))


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
        Strokes of the journey.
    holds
        Number of waves for which each awn holds the capsule once it catches, shape (awns,).
    period_s
        Time from wave to wave.
    rise
        ``rise(position, stroke)`` returns the height in mm that each awn would climb when the
        head moves from ``position`` by ``stroke``, shape (awns,).
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
        period_s: float,
        rise: Callable[[float, float], FloatArray],
        length_mm: float = np.inf,
    ) -> None:
        self._advance, self._strokes, self.holds = advance, strokes, holds
        self._period_s, self._rise, self._length_mm = period_s, rise, length_mm
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
        (wave, folded), strokes = leg, self._strokes
        same_wave = self._leg is not None and self._leg[0] == wave
        # A new wave begins where the previous leg ends with its wave, not at the last sample.
        self._from_mm = self.head_mm if same_wave else self._from_mm + self._rest_mm()
        self._leg, self._part = leg, part if same_wave else 0.0
        self._moved_mm = self._slip_mm = 0.0
        if folded == 0:
            slopes = self._rise(self._from_mm, strokes.typical_mm) / strokes.typical_mm
            caught = (self.holds > 0) & (slopes > self._advance.catch_slope)
            self.holds = self.holds - caught
            if not caught.any():
                snagged = np.exp(-self._advance.snag * slopes.sum())
                self._moved_mm = float(strokes.ahead_mm[wave] * snagged)
            self._slip_mm = float(strokes.slips_mm[wave])
        elif folded == 1:
            self._moved_mm = max(float(strokes.folded_mm[wave]), -self._from_mm)

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
