"""Candidates: the places and mean speeds at which a nodule may pass all sensors, with evidence."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray, IntArray, RealArray
from capsule.detectors.beats import CHANNELS, Beats, quantile

# Candidates that are tried at a time, so that the arrays fit into the processor's cache.
_BLOCK = 250
# In windows. Above 0, so that a sensor that never meets a place contributes 0, even without dwell.
_LEAST_DWELL = float(np.finfo(np.float32).tiny)


def standardised_beats(
    beats: Beats, weights: Mapping[str, float], least_spread: float, limit: float
) -> FloatArray:
    """Return the weighted sum of the channels, in units of each sensor's spread over the run.

    Dividing by the spread gives less weight to a sensor whose seat shifts all the time. No single
    beat counts more than `limit`.

    Parameters
    ----------
    beats : Beats
        From `find_beats`.
    weights : mapping of str to float
        Weight of each channel.
    least_spread : float
        Added to the spread in quadrature, in usual depths. It limits the weight of any sensor.
    limit : float
        Largest magnitude, in spreads.

    Returns
    -------
    (S, N) array
    """
    weighted = sum(weights[name] * beats.channels[channel] for channel, name in enumerate(CHANNELS))
    # A nodule raises the beats for part of the run, so the spread is measured on the lower half. In
    # a normal distribution, the lower quartile is 0.6745 standard deviations below the median.
    ordered = np.sort(weighted, axis=1)
    spread = (quantile(ordered, 0.5) - quantile(ordered, 0.25)) / 0.6745
    bounded: FloatArray = np.clip(weighted / np.hypot(least_spread, spread), -limit, limit)
    return bounded


@dataclass(frozen=True)
class Candidates:
    """All places and mean speeds that were tried, and the evidence for each.

    Attributes
    ----------
    weighted : (S, N) array
        From `standardised_beats`.
    head_mm : (V, N) array
        Way of the first sensor at each speed, in mm.
    behind_mm : (S,) array
        Distance of each sensor behind the first, in mm.
    lag_samples : (V,) array
        Mean time from sensor to sensor at each speed, in samples.
    speed : (G,) array of int
        Index of each candidate's speed.
    place_mm, evidence : (G,) array
        Each candidate's place in mm, and its evidence as in `capsule.detectors.passage.Passage`.
    dwell : float
        As in `try_candidates`, but in windows.
    unit_mm : float
        Unit of length in which the Gaussian of a place is exp(-x^2), in mm.
    """

    weighted: FloatArray
    head_mm: FloatArray
    behind_mm: RealArray
    lag_samples: FloatArray
    speed: IntArray
    place_mm: FloatArray
    evidence: RealArray
    dwell: float
    unit_mm: float

    @property
    def best(self) -> int:
        """Index of the candidate with the most evidence."""
        return int(self.evidence.argmax())

    def beyond_mm(self) -> FloatArray:
        """Return how far the first sensor is beyond the best place at each moment, (N,) in mm."""
        beyond_mm: FloatArray = self.head_mm[self.speed[self.best]] - self.place_mm[self.best]
        return beyond_mm


def try_candidates(
    beats: Beats,
    *,
    level_weight: float,
    depth_weight: float,
    shape_weight: float,
    least_spread: float,
    limit: float,
    pitch_mm: float,
    lag_range: tuple[float, float],
    lags: int,
    step_mm: float,
    width_mm: float,
    dwell: float,
) -> Candidates:
    """Search all places and mean speeds for a passage.

    For a candidate place, each sensor's beats are averaged over the time that the sensor spends
    there (a Gaussian of `width_mm`). The evidence is the mean of these averages over the sensors.
    The wave's phase gives the irregular part of the capsule's motion; the search gives its mean
    speed.

    Parameters
    ----------
    beats : Beats
        From `find_beats`.
    level_weight, depth_weight, shape_weight : float
        Weights of the channels of the beats.
    least_spread, limit : float
        As in `standardised_beats`.
    pitch_mm : float
        Distance from sensor to sensor in mm.
    lag_range : pair of float
        Shortest and longest mean time from sensor to sensor, in samples.
    lags : int
        Number of mean speeds that are tried, evenly spaced.
    step_mm : float
        Distance between the places tried, in mm.
    width_mm : float
        Standard deviation of a place, in mm.
    dwell : float
        Number of samples of usual beats that are mixed into each average. They reduce the evidence
        of a place that a sensor passes quickly or never meets.

    Returns
    -------
    Candidates
    """
    weights = dict(zip(CHANNELS, (level_weight, depth_weight, shape_weight), strict=True))
    weighted = standardised_beats(beats, weights, least_spread, limit)
    behind_mm = pitch_mm * np.arange(weighted.shape[0])
    dwell = max(dwell / float(beats.centre[1] - beats.centre[0]), _LEAST_DWELL)
    speeds = np.linspace(pitch_mm / lag_range[1], pitch_mm / lag_range[0], lags)
    head_mm = beats.irregular_mm - beats.irregular_mm[0] + np.outer(speeds, beats.centre)
    # Places that at least half the sensors can meet.
    farthest_mm = head_mm.max(axis=1) - behind_mm[behind_mm.size // 2]
    speed, place_mm = _candidates(farthest_mm, step_mm)
    unit_mm = float(np.sqrt(2) * width_mm)
    head, behind, place = head_mm / unit_mm, behind_mm / unit_mm, place_mm / unit_mm
    evidence = _evidence(weighted, head, behind, speed, place, dwell)
    lag_samples = pitch_mm / speeds
    return Candidates(
        weighted, head_mm, behind_mm, lag_samples, speed, place_mm, evidence, dwell, unit_mm
    )


def _candidates(farthest_mm: FloatArray, step_mm: float) -> tuple[IntArray, FloatArray]:
    """Return all candidates: at each speed (V,), every place from the start to the farthest.

    Returns
    -------
    speed : (G,) array of int
        Index of each candidate's speed.
    place_mm : (G,) array
    """
    places = np.ceil(np.maximum(farthest_mm, 0.0) / step_mm + 0.5).astype(int)
    speed = np.repeat(np.arange(places.size), places)
    before = np.repeat(np.cumsum(places) - places, places)
    return speed, step_mm * (np.arange(speed.size) - before)


def _evidence(
    weighted: RealArray,
    head: RealArray,
    behind: RealArray,
    speed: IntArray,
    place: RealArray,
    dwell: float,
) -> RealArray:
    """Return the evidence of every candidate (G,), with an error of about a millionth.

    Single precision is enough to choose a candidate and takes half the time.

    Parameters
    ----------
    weighted : (S, N) array
        From `standardised_beats`.
    head : (V, N) array
        Way of the first sensor at each speed, in units in which the Gaussian is exp(-x^2).
    behind, dwell
        As in `averages`.
    speed, place : (G,) arrays
        From `_candidates`, the places in the same units.
    """
    channels, head, behind, place = (
        values.astype(np.float32) for values in (weighted[np.newaxis], head, behind, place)
    )
    evidence = np.empty(place.size, dtype=np.float32)
    for start in range(0, place.size, _BLOCK):
        some = slice(start, start + _BLOCK)
        beyond = head.take(speed[some], axis=0)
        beyond -= place[some, np.newaxis]
        evidence[some] = averages(channels, beyond, behind, dwell)[0]
    return evidence


def averages(channels: RealArray, beyond: RealArray, behind: RealArray, dwell: float) -> RealArray:
    """Return the beats' averages at places: over each sensor's time there, then over the sensors.

    Parameters
    ----------
    channels : (C, S, N) array
        The values to average.
    beyond : (G, N) array
        Distance of the first sensor beyond each place at each moment, in units in which the
        Gaussian is exp(-x^2).
    behind : (S,) array
        Distance of each sensor behind the first, in the same units.
    dwell : float
        As in `try_candidates`, but in windows, and above 0.

    Returns
    -------
    (C, G) array
        The averages, in the precision of `beyond`.
    """
    precision = beyond.dtype.type
    moments = np.ones(beyond.shape[1], dtype=precision)
    presence = np.empty_like(beyond)
    total = np.zeros((channels.shape[0], beyond.shape[0]), dtype=precision)
    for sensor in range(behind.size):
        np.subtract(beyond, behind[sensor], out=presence)
        np.square(presence, out=presence)
        np.negative(presence, out=presence)
        np.exp(presence, out=presence)
        total += channels[:, sensor] @ presence.T / (presence @ moments + precision(dwell))
    return total / behind.size
