"""One nodule passes all sensors in turn: the place and speed where their beats agree on it."""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from capsule.detectors.beats import CHANNELS, Beats


@dataclass(frozen=True)
class Passage:
    """The best candidate for a nodule in one recording.

    Attributes
    ----------
    evidence : float
        How much the weighted beats exceed the usual there, in units of their spread, mean over the
        sensors; the detector's score.
    level, depth, shape : float
        The channels at the candidate, mean over the sensors, in usual depths.
    location_mm : float
        Way of the first sensor from the recording's start to the candidate, in mm.
    location_samples : float
        When the first sensor passes it, in samples from the recording's start.
    lag_samples : float
        Mean time from sensor to sensor, in samples.
    level_spread, depth_spread, shape_spread : float
        Standard deviation of the channels over the whole run, mean over the sensors, in usual
        depths; they belong to no place, and say much about the size.
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


def standardised_beats(
    beats: Beats, weights: Mapping[str, float], least_spread: float, limit: float
) -> np.ndarray:
    """Weigh the channels, in units of each sensor's own spread over the run.

    A sensor whose seat shifts all the time says less than one that sits firm, and no single beat
    says more than `limit`.

    Parameters
    ----------
    beats : Beats
        From `find_beats`.
    weights : mapping of str to float
        Weight of each channel.
    least_spread : float
        Added to the spread in quadrature, in usual depths: no sensor is trusted beyond it.
    limit : float
        Largest magnitude, in spreads.

    Returns
    -------
    (S, N) array
    """
    weighted = np.tensordot([weights[name] for name in CHANNELS], beats.channels, axes=1)
    # A nodule raises the beats for part of the run, so the spread is that of the lower half. From
    # the median to the lower quartile it is 0.6745 standard deviations of a normal distribution.
    quartile, median = np.quantile(weighted, [0.25, 0.5], axis=1)[..., np.newaxis]
    spread = (median - quartile) / 0.6745
    return np.clip(weighted / np.hypot(least_spread, spread), -limit, limit)


def find_passage(
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
) -> Passage:
    """Search all places and mean speeds for the passage with the most evidence.

    At a candidate place each sensor's beats are averaged over the time that the sensor spends
    there (a Gaussian of `width_mm`), and the sensors' averages are averaged. The capsule's
    irregular motion is known from the wave's phase; its mean speed is searched.

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
        How many mean speeds are tried, evenly spaced.
    step_mm : float
        Distance between the places tried, in mm.
    width_mm : float
        Standard deviation of a place, in mm.
    dwell : float
        Samples' worth of usual beats that are mixed into each average, so that a place that a
        sensor hurries through, or never meets, says little.

    Returns
    -------
    Passage
    """
    weights = dict(zip(CHANNELS, (level_weight, depth_weight, shape_weight), strict=True))
    weighted = standardised_beats(beats, weights, least_spread, limit)
    sensors = weighted.shape[0]
    behind_mm = pitch_mm * np.arange(sensors)
    dwell /= float(beats.centre[1] - beats.centre[0])
    best, best_place, best_speed = -np.inf, 0.0, 0.0
    speeds = np.linspace(pitch_mm / lag_range[1], pitch_mm / lag_range[0], lags)
    for speed in speeds:
        head_mm = _head(beats, speed)
        # Places that at least half the sensors can meet.
        farthest = float(head_mm.max()) - behind_mm[sensors // 2]
        places = np.arange(0.0, max(farthest, 0.0) + step_mm / 2, step_mm)
        evidence = np.zeros(places.size)
        for sensor in range(sensors):
            presence = _presence(places, head_mm - behind_mm[sensor], width_mm)
            evidence += presence @ weighted[sensor] / (presence.sum(axis=1) + dwell)
        evidence /= sensors
        place = int(evidence.argmax())
        if evidence[place] > best:
            best, best_place, best_speed = float(evidence[place]), float(places[place]), speed
    return _describe(beats, behind_mm, best_place, best_speed, best, pitch_mm, width_mm, dwell)


def _head(beats: Beats, speed: float) -> np.ndarray:
    """Give the way of the first sensor (N,) at a mean speed in mm a sample."""
    return beats.irregular_mm - beats.irregular_mm[0] + speed * beats.centre


def _presence(places: np.ndarray, position_mm: np.ndarray, width_mm: float) -> np.ndarray:
    """Weigh each moment (N,) by how near a sensor then is to each place (G,): (G, N)."""
    return np.exp(-0.5 * ((places[:, np.newaxis] - position_mm) / width_mm) ** 2)


def _describe(
    beats: Beats,
    behind_mm: np.ndarray,
    place: float,
    speed: float,
    evidence: float,
    pitch_mm: float,
    width_mm: float,
    dwell: float,
) -> Passage:
    head_mm = _head(beats, speed)
    averages = np.zeros(len(CHANNELS))
    for sensor, behind in enumerate(behind_mm):
        (presence,) = _presence(np.array([place]), head_mm - behind, width_mm)
        averages += beats.channels[:, sensor] @ presence / (presence.sum() + dwell)
    averages /= behind_mm.size
    moment = float(beats.centre[np.abs(head_mm - place).argmin()])
    spreads = beats.channels.std(axis=2).mean(axis=1)
    return Passage(
        evidence, *map(float, averages), place, moment, pitch_mm / speed, *map(float, spreads)
    )
