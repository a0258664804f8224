"""The beats of a recording: the effect of each wave on each sensor, relative to its usual effect.

Within one wave the signal is a sum of a few harmonics of the wave's phase. While a nodule passes a
sensor, the beats become deeper and change their shape. A beat is measured relative to the sensor's
usual beat, so the sensor's gain, its resistance and slow drift do not matter.

The search for the best place uses only the harmonics in phase. The taught network also sees those
in quadrature, because a nodule felt early or late in the wave shifts the phase of the beat.
"""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
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
