"""The beats of a recording, and the search for the place at which those of all sensors agree.

A beat is the effect of one wave on one sensor. Within a wave the signal is a sum of a few harmonics
of the wave's phase. While a nodule passes a sensor, the beats become deeper and change their shape.
A beat is measured relative to the sensor's usual beat, so the sensor's gain, its resistance and
slow drift do not matter. The search uses only the harmonics in phase. The taught network also sees
those in quadrature, because a nodule felt early or late in the wave shifts the phase of the beat.

A candidate is a place and a mean speed of the capsule. Each sensor's beats are averaged over the
time that the sensor spends at the place, and the evidence is the mean of these averages over the
sensors. The wave's phase gives the irregular part of the capsule's motion; the search gives its
mean speed. All settings are those of section ``diagonal`` of the configuration.
"""

from dataclasses import dataclass, fields

import numpy as np

from capsule.arrays import FloatArray, RealArray
from capsule.detectors.wave import Wave
from capsule.kinds import Settings

CHANNELS = ("level", "depth", "shape")
# Level; first harmonic in phase and in quadrature; second harmonic in phase and in quadrature.
SERIES = ("level", "depth", "swing", "shape", "lean")
# Windows that are kept for each wave. The mean over a window changes slowly, so more windows
# would add little.
WINDOWS_A_WAVE = 4
# In usual depths. A larger beat tells the network nothing more, so its series are clipped here.
_LIMIT = 30.0
# Candidates that are tried at a time, so that the arrays fit into the processor's cache.
_BLOCK = 250
# In windows. Above 0, so that a sensor that never meets a place contributes 0, even without dwell.
_LEAST_DWELL = float(np.finfo(np.float32).tiny)


@dataclass(frozen=True)
class Beats:
    """The beats of a recording, in windows of one wave.

    Attributes
    ----------
    channels : (3, S, N) array
        Level, depth and shape of the beats, in the order of `CHANNELS`. They are the mean, the
        first and the second harmonic (in phase) of one wave. Each is reduced by the sensor's median
        and divided by the sensor's median depth. Pressing raises level and depth.
    centre : (N,) array
        Centre of each window, in samples from the first reading; evenly spaced.
    irregular_mm : (N,) array
        Distance by which the capsule is ahead of steady motion at the centres, in mm. It is
        computed from the phase of the wave.
    """

    channels: FloatArray
    centre: FloatArray
    irregular_mm: FloatArray

    @property
    def step(self) -> float:
        """Distance from window to window, in samples."""
        return float(self.centre[1] - self.centre[0])


def beats_of(wave: Wave | None, settings: Settings) -> Beats | None:
    """Return the beats of a recording; parameters as in `capsule.detectors.wave.missing_wave`.

    None for a recording without a wave on each sensor.
    """
    if wave is None:
        return None
    turn = np.cos(wave.phase)
    turns = np.stack([turn, 2 * turn**2 - 1])  # cos(phase) and cos(2 phase)
    step = max(wave.window // WINDOWS_A_WAVE, 1)
    channels = _in_usual_depths(wave, turns, step)
    if channels is None:
        return None
    windows = np.arange(0, wave.level.shape[1], step, dtype=float)
    thinned_centre = windows + (wave.window - 1) / 2
    # A capsule ahead of steady motion meets the wave later, so the phase is behind.
    behind = np.interp(thinned_centre, np.arange(wave.irregular.size), -wave.irregular)
    ahead = behind * settings["wavelength_mm"] / (2 * np.pi)
    return Beats(channels, wave.centre(windows), _without_line(thinned_centre, ahead))


def series_of(wave: Wave | None) -> FloatArray | None:
    """Return the beats of a recording at intervals of a quarter of the configured wave.

    None is as in `beats_of`. The result is an array (S, 5, N) of the `SERIES` of
    each sensor, in units of the sensor's usual depth as in `Beats`.
    """
    if wave is None:
        return None
    turn = np.exp(-1j * wave.phase)
    turns = np.stack([turn.real, -turn.imag, (turn**2).real, -(turn**2).imag])
    series = _in_usual_depths(wave, turns)
    if series is None:
        return None
    centre = wave.centre(np.arange(wave.level.shape[1], dtype=float))
    wanted = np.arange(centre[0], centre[-1] + 1e-9, wave.expected / WINDOWS_A_WAVE)
    below = np.minimum(np.searchsorted(centre, wanted, side="right") - 1, centre.size - 2)
    share = (wanted - centre[below]) / (centre[below + 1] - centre[below])
    even = series[..., below] * (1 - share) + series[..., below + 1] * share
    even_series: FloatArray = np.clip(even, -_LIMIT, _LIMIT).transpose(1, 0, 2)
    return even_series


def _in_usual_depths(wave: Wave, turns: FloatArray, step: int = 1) -> FloatArray | None:
    """Return level and harmonics (1 + H, S, N) of every `step`-th window, as in `Beats`.

    None if a sensor has no usual depth, which the first harmonic gives.
    """
    harmonics = wave.harmonics(turns)
    usual_depth = median(harmonics[0])
    if np.any(usual_depth <= 0):
        return None
    series = np.concatenate([wave.level[np.newaxis], harmonics])[..., ::step]
    relative: FloatArray = (series - median(series)) / usual_depth
    return relative


def median(values: FloatArray) -> FloatArray:
    """Return the median along the last axis, which keeps length 1."""
    return quantile(np.sort(values, axis=-1), 0.5)


def quantile(ordered: FloatArray, share: float) -> FloatArray:
    """Return a quantile along the last axis, which is sorted and keeps length 1.

    The result equals ``np.quantile(ordered, share, axis=-1, keepdims=True)``, which takes ten times
    as long for a few short rows.
    """
    rank = share * (ordered.shape[-1] - 1)
    below, above = int(np.floor(rank)), int(np.ceil(rank))
    low, high = ordered[..., below : below + 1], ordered[..., above : above + 1]
    quantiles: FloatArray = low + (rank - below) * (high - low)
    return quantiles


def _without_line(at: FloatArray, values: FloatArray) -> FloatArray:
    """Return values (N,) minus their straight line of least squares."""
    off = at - at.mean()
    rest: FloatArray = values - values.mean() - off * (off @ values) / (off @ off)
    return rest


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

    The parameters are as in `capsule.detectors.search.beats_of`.
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
