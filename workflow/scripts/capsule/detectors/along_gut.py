"""The evidence of the diagonal detector along the gut, for the report's figures."""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray, RealArray
from capsule.detectors.beats import CHANNELS
from capsule.detectors.candidates import try_candidates
from capsule.detectors.passage import beats_of
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
    evidence: RealArray
    passed: FloatArray


def along_gut(values: FloatArray, rate_hz: float, settings: Settings) -> AlongGut | None:
    """Return the beats and evidence from which `passage_of` chooses the best candidate.

    Parameters
    ----------
    values : (S, K) array
        Readings on an even grid in time; NaN where a sample is missing.
    rate_hz : float
        Sampling rate.
    settings : mapping
        Section ``diagonal`` of the configuration.

    Returns
    -------
    AlongGut or None
        None without a peristaltic wave on every sensor.
    """
    beats, options = beats_of(values, rate_hz, settings)
    if beats is None:
        return None
    tried = try_candidates(beats, **options)
    step_mm = options["step_mm"]
    number = np.rint(tried.place_mm / step_mm).astype(int)
    evidence = np.full(number.max() + 1, -np.inf)
    np.maximum.at(evidence, number, tried.evidence)
    beyond_mm = np.abs(tried.beyond_mm() - tried.behind_mm[:, np.newaxis])
    passed = beats.centre[beyond_mm.argmin(axis=1)]
    return AlongGut(
        first=float(beats.centre[0]),
        step=float(beats.centre[1] - beats.centre[0]),
        depth=1.0 + beats.channels[CHANNELS.index("depth")],
        step_mm=step_mm,
        evidence=evidence,
        passed=np.where(beyond_mm.min(axis=1) <= options["width_mm"], passed, np.nan),
    )
