"""The diagonal detector's evidence at places along the gut, while the capsule travels.

Beats, weights and averages are those of `capsule.detectors`. One thing differs: the
odometer measures the capsule's way, so no mean speeds are tried.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray, RealArray
from capsule.detectors.search import averages, beats_of, standardised_beats, unit_of_place
from capsule.detectors.wave import wave_of
from capsule.kinds import Settings

# Half the width of the range that counts as the top of the evidence.
_TOP_MM = 4.0


@dataclass(frozen=True)
class GutEvidence:
    """The evidence of the last samples at the places that the capsule has passed.

    Attributes
    ----------
    place_mm : (P,) array
        Places along the gut, on a grid that stays the same.
    evidence : (P,) array
        Evidence for a nodule at each place.
    """

    place_mm: FloatArray
    evidence: RealArray

    def within(self, low_mm: float, high_mm: float) -> "GutEvidence":
        """Return the evidence at places from `low_mm` to `high_mm`."""
        some = (self.place_mm >= low_mm) & (self.place_mm <= high_mm)
        return GutEvidence(self.place_mm[some], self.evidence[some])

    def without(self, places_mm: list[float], reach_mm: float) -> "GutEvidence":
        """Return the evidence without everything within reach of some places."""
        off = np.ones(self.place_mm.size, dtype=bool)
        for place_mm in places_mm:
            off &= np.abs(self.place_mm - place_mm) > reach_mm
        return GutEvidence(self.place_mm[off], self.evidence[off])

    def best(self) -> tuple[float, float]:
        """Return the place with the most evidence, and its evidence; NaN if there is no place."""
        if self.place_mm.size == 0:
            return float("nan"), float("nan")
        largest = float(self.evidence.max())
        top_mm = float(self.place_mm[self.evidence.argmax()])
        if largest <= 0:
            return top_mm, largest
        # The middle of the top, because the highest point may be on a flank, and the place may be
        # between two points of the grid.
        top = (np.abs(self.place_mm - top_mm) <= _TOP_MM) & (self.evidence > largest / 2)
        weights = np.where(top, self.evidence, 0.0)
        return float(np.average(self.place_mm, weights=weights)), largest


def evidence_along(
    values: FloatArray,
    rate_hz: float,
    settings: Settings,
    way: Callable[[FloatArray], FloatArray],
) -> GutEvidence | None:
    """Return the evidence at all places that at least half the sensors have passed.

    Parameters
    ----------
    values : (S, K) array
        The last readings on an even grid in time; NaN where a sample is missing.
    rate_hz : float
        Sampling rate.
    settings : mapping
        Section ``diagonal`` of the configuration.
    way : callable
        Function that returns the head's position in mm at samples of `values`, counted from the
        first.

    Returns
    -------
    GutEvidence or None
        None if a sensor shows no peristaltic wave.
    """
    if np.any(np.isnan(values).all(axis=1)):
        return None
    beats = beats_of(wave_of(values, rate_hz, settings), settings)
    if beats is None:
        return None
    weighted = standardised_beats(beats, settings)
    behind_mm = settings["pitch_mm"] * np.arange(weighted.shape[0])
    head_mm = way(beats.centre)
    step_mm = settings["step_mm"]
    farthest_mm = head_mm.max() - behind_mm[behind_mm.size // 2]
    numbers = np.arange(np.ceil(head_mm.min() / step_mm), np.floor(farthest_mm / step_mm) + 1)
    place_mm = step_mm * numbers
    unit_mm = unit_of_place(settings)
    beyond = (head_mm - place_mm[:, np.newaxis]) / unit_mm
    dwell = settings["dwell"] / beats.step
    evidence = averages(weighted[np.newaxis], beyond, behind_mm / unit_mm, dwell)[0]
    return GutEvidence(place_mm, evidence)
