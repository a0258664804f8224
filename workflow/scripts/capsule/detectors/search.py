"""The search for a nodule: the place and mean speed at which the beats of all sensors agree.

A candidate is a place and a mean speed of the capsule. Each sensor's beats are averaged over the
time that the sensor spends at the place, and the evidence is the mean of these averages over the
sensors. The wave's phase gives the irregular part of the capsule's motion; the search gives its
mean speed. All settings are those of section ``diagonal`` of the configuration.
"""

from dataclasses import dataclass, fields

import numpy as np

from capsule.arrays import FloatArray, RealArray
from capsule.detectors.beats import CHANNELS, Beats, beats_of, quantile
from capsule.detectors.wave import Wave
from capsule.kinds import Settings

# Candidates that are tried at a time, so that the arrays fit into the processor's cache.
_BLOCK = 250
# In windows. Above 0, so that a sensor that never meets a place contributes 0, even without dwell.
_LEAST_DWELL = float(np.finfo(np.float32).tiny)


@dataclass(frozen=True)
class Passage:
    """The best candidate for a nodule in one recording.

    Attributes
    ----------
    evidence : float
        Excess of the weighted beats over the usual ones, in units of their spread, averaged over
        the sensors. This is the detector's score.
    level, depth, shape : float
        The channels at the candidate, averaged over the sensors, in usual depths.
    location_mm : float
        Way of the first sensor from the recording's start to the candidate, in mm.
    location_samples : float
        Time at which the first sensor passes it, in samples from the recording's start.
    lag_samples : float
        Mean time from sensor to sensor, in samples.
    level_spread, depth_spread, shape_spread : float
        Standard deviation of the channels over the whole run, averaged over the sensors, in usual
        depths. They do not depend on the place, but help to estimate the size.
    """

    evidence: float
    level: float
    depth: float
    shape: float
    location_mm: float
    location_samples: float
    lag_samples: float
    level_spread: float
    depth_spread: float
    shape_spread: float


UNKNOWN = Passage(*[float("nan")] * len(fields(Passage)))


def passage_of(wave: Wave | None, settings: Settings) -> Passage:
    """Return the best candidate for a nodule; `UNKNOWN` if a sensor shows no peristaltic wave.

    The parameters are as in `capsule.detectors.beats.beats_of`.
    """
    beats = beats_of(wave, settings)
    return UNKNOWN if beats is None else search_beats(beats, settings)[0]


def search_beats(beats: Beats, settings: Settings) -> tuple[Passage, FloatArray, FloatArray]:
    """Search for the candidate with the most evidence.

    Returns
    -------
    Passage
        That candidate.
    evidence : (P,) array
        The largest evidence over all mean speeds at each place, from the recording's start on.
    beyond_mm : (N,) array
        How far the first sensor is beyond the candidate's place at each beat.
    """
    weighted = standardised_beats(beats, settings)
    pitch_mm, step_mm, unit_mm = settings["pitch_mm"], settings["step_mm"], unit_of_place(settings)
    behind_mm = pitch_mm * np.arange(len(weighted))
    dwell = max(settings["dwell"] / beats.step, _LEAST_DWELL)
    shortest, longest = settings["lag_range"]
    speeds = np.linspace(pitch_mm / longest, pitch_mm / shortest, settings["lags"])
    head_mm = beats.irregular_mm - beats.irregular_mm[0] + np.outer(speeds, beats.centre)
    # At each speed, every place from the start to the farthest that half the sensors can meet.
    farthest_mm = head_mm.max(axis=1) - behind_mm[behind_mm.size // 2]
    places = np.ceil(np.maximum(farthest_mm, 0.0) / step_mm + 0.5).astype(int)
    speed = np.repeat(np.arange(places.size), places)
    place = np.concatenate([np.arange(count) for count in places])
    place_mm = step_mm * place
    # Single precision is enough to choose a candidate, and takes half the time.
    double = weighted[np.newaxis], head_mm / unit_mm, place_mm / unit_mm, behind_mm / unit_mm
    values, head, at, behind = (each.astype(np.float32) for each in double)
    blocks = [slice(start, start + _BLOCK) for start in range(0, place.size, _BLOCK)]
    tried = np.concatenate(
        [
            averages(values, head[speed[some]] - at[some, np.newaxis], behind, dwell)[0]
            for some in blocks
        ]
    )
    best = tried.argmax()
    beyond_mm = head_mm[speed[best]] - place_mm[best]
    channels = np.concatenate([weighted[np.newaxis], beats.channels])
    means = averages(channels, beyond_mm[np.newaxis] / unit_mm, behind_mm / unit_mm, dwell)
    evidence, level, depth, shape = means[:, 0].tolist()
    passage = Passage(
        evidence,
        level,
        depth,
        shape,
        float(place_mm[best]),
        float(beats.centre[np.abs(beyond_mm).argmin()]),
        float(pitch_mm / speeds[speed[best]]),
        *beats.channels.std(axis=2).mean(axis=1).tolist(),
    )
    along = np.full(places.max(), -np.inf)
    np.maximum.at(along, place, tried)
    return passage, along, beyond_mm


def standardised_beats(beats: Beats, settings: Settings) -> FloatArray:
    """Return the weighted sum of the channels (S, N), in units of each sensor's spread.

    Dividing by the spread over the run gives less weight to a sensor whose seat shifts all the
    time; `least_spread`, added in quadrature, limits that weight. No single beat counts more than
    `limit`.
    """
    weighted = sum(
        settings[f"{name}_weight"] * channel
        for name, channel in zip(CHANNELS, beats.channels, strict=True)
    )
    # A nodule raises the beats for part of the run, so the spread is measured on the lower half. In
    # a normal distribution, the lower quartile is 0.6745 standard deviations below the median.
    ordered = np.sort(weighted, axis=1)
    spread = (quantile(ordered, 0.5) - quantile(ordered, 0.25)) / 0.6745
    limit = settings["limit"]
    bounded: FloatArray = np.clip(
        weighted / np.hypot(settings["least_spread"], spread), -limit, limit
    )
    return bounded


def unit_of_place(settings: Settings) -> float:
    """Return the length in mm by which the Gaussian of a place is exp(-x^2)."""
    return float(np.sqrt(2) * settings["width_mm"])


def averages(channels: RealArray, beyond: RealArray, behind: RealArray, dwell: float) -> RealArray:
    """Return the beats' averages at places: over each sensor's time there, then over the sensors.

    Parameters
    ----------
    channels : (C, S, N) array
        The values to average.
    beyond : (G, N) array
        Distance of the first sensor beyond each place at each moment, in `unit_of_place`.
    behind : (S,) array
        Distance of each sensor behind the first, in the same units.
    dwell : float
        Number of windows of usual beats that are mixed into each average, above 0. They reduce the
        evidence of a place that a sensor passes quickly or never meets.

    Returns
    -------
    (C, G) array
        The averages, in the precision of `beyond`.
    """
    precision = beyond.dtype.type
    moments = np.ones(beyond.shape[1], dtype=precision)
    total = np.zeros((channels.shape[0], beyond.shape[0]), dtype=precision)
    for sensor, distance in enumerate(behind):
        presence = np.exp(-np.square(beyond - distance))
        total += channels[:, sensor] @ presence.T / (presence @ moments + precision(dwell))
    return total / behind.size
