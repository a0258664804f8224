"""From readings to beats: what the wave does to each sensor, relative to what it usually does.

Within one wave the signal is a few harmonics of the wave's phase; a nodule makes the beats deeper
and changes their shape while it passes a sensor. Taken relative to the sensor's usual beat, this
needs neither the sensor's gain nor its resistance, and slow drift does not enter.
"""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.sensed_wave import find_wave

CHANNELS = ("level", "depth", "shape")
# The windows of one wave change slowly.
_WINDOWS_A_WAVE = 4


@dataclass(frozen=True)
class Beats:
    """What a recording holds of the wave, in windows of one wave.

    Attributes
    ----------
    channels : (3, S, N) array
        Level, depth and shape of the beats as `CHANNELS` names them: the mean, the first and the
        second harmonic (in phase) of one wave, each minus the sensor's median, in units of the
        sensor's median depth. Pressing raises level and depth.
    centre : (N,) array
        Centre of each window, in samples from the first reading; evenly spaced.
    irregular_mm : (N,) array
        How far the capsule is ahead of steady motion at these moments, in mm, from the phase.
    """

    channels: FloatArray
    centre: FloatArray
    irregular_mm: FloatArray


def find_beats(values: FloatArray, *, period: float, wavelength_mm: float) -> Beats | None:
    """Take a recording apart into beats.

    Parameters
    ----------
    values, period
        As `find_wave` takes them.
    wavelength_mm : float
        Length of the wave in mm.

    Returns
    -------
    Beats or None
        None for a recording of fewer than four waves, or without a wave on some sensor.
    """
    wave = find_wave(values, period)
    if wave is None:
        return None
    turn = np.cos(wave.phase)
    harmonics = wave.harmonics(np.stack([turn, 2 * turn**2 - 1]))  # cos(phase) and cos(2 phase)
    usual_depth = median(harmonics[0])
    if np.any(usual_depth <= 0):
        return None
    step = max(wave.window // _WINDOWS_A_WAVE, 1)
    channels = np.concatenate([wave.level[np.newaxis], harmonics])[..., ::step]
    channels = (channels - median(channels)) / usual_depth
    windows = np.arange(0, wave.level.shape[1], step, dtype=float)
    thinned_centre = windows + (wave.window - 1) / 2
    # Ahead of steady motion, the capsule meets the wave late: the phase falls behind.
    behind = np.interp(thinned_centre, np.arange(wave.irregular.size), -wave.irregular)
    ahead = behind * wavelength_mm / (2 * np.pi)
    return Beats(channels, wave.centre(windows), _without_line(thinned_centre, ahead))


def median(values: FloatArray) -> FloatArray:
    """Give the median along the last axis, which stays with length 1."""
    return quantile(np.sort(values, axis=-1), 0.5)


def quantile(ordered: FloatArray, share: float) -> FloatArray:
    """Give a quantile along the last axis, which is sorted and stays with length 1.

    As by ``np.quantile(ordered, share, axis=-1, keepdims=True)``, which takes ten times as long for
    a few short rows.
    """
    rank = share * (ordered.shape[-1] - 1)
    below, above = int(np.floor(rank)), int(np.ceil(rank))
    low, high = ordered[..., below : below + 1], ordered[..., above : above + 1]
    quantiles: FloatArray = low + (rank - below) * (high - low)
    return quantiles


def _without_line(at: FloatArray, values: FloatArray) -> FloatArray:
    """Take the straight line of least squares through values (N,) off them."""
    off = at - at.mean()
    rest: FloatArray = values - values.mean() - off * (off @ values) / (off @ off)
    return rest
