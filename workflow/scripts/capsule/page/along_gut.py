"""Find what the page draws of the search for a nodule: beats, and the evidence along the gut."""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.beats import CHANNELS, beats_of
from capsule.detectors.search import search_beats
from capsule.kinds import Settings


@dataclass(frozen=True)
class AlongGut:
    """The beats of a recording, and the evidence for a nodule at each place along the gut.

    Attributes
    ----------
    first, step : float
        Centre of the first beat, and the distance from beat to beat, in samples.
    depth : (S, N) array
        Depth of each sensor's beats in units of its usual depth, which is 1.
    step_mm : float
        Distance from place to place, in mm; the first place is the recording's start.
    evidence : (P,) array
        The largest evidence over all mean speeds at each place. The detector's score is the
        largest of these values.
    passed : (S,) array
        Time at which each sensor passes the place with the most evidence, in samples; NaN for a
        sensor that stays farther from it than the extent of a place.
    """

    first: float
    step: float
    depth: FloatArray
    step_mm: float
    evidence: FloatArray
    passed: FloatArray


def along_gut(values: FloatArray, rate_hz: float, settings: Settings) -> AlongGut | None:
    """Return the beats, and the evidence from which the diagonal detector chooses the best place.

    Parameters and None are as in `capsule.detectors.beats.beats_of`.
    """
    beats = beats_of(values, rate_hz, settings)
    if beats is None:
        return None
    _, evidence, beyond_mm = search_beats(beats, settings)
    depth = 1.0 + beats.channels[CHANNELS.index("depth")]
    behind_mm = settings["pitch_mm"] * np.arange(len(depth))
    off_mm = np.abs(beyond_mm - behind_mm[:, np.newaxis])
    passed = beats.centre[off_mm.argmin(axis=1)]
    return AlongGut(
        first=float(beats.centre[0]),
        step=beats.step,
        depth=depth,
        step_mm=settings["step_mm"],
        evidence=evidence,
        passed=np.where(off_mm.min(axis=1) <= settings["width_mm"], passed, np.nan),
    )
