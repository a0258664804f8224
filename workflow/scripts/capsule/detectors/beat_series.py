"""The beats of a recording as series on an even grid in time, as the taught scorer sees them.

Beside the harmonics in phase of `capsule.detectors.beats` stand those across: a nodule that is felt
early or late in the wave turns the beat.
"""

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.beats import median
from capsule.sensed_wave import find_wave

# Level, first harmonic in phase and across, second harmonic in phase and across.
SERIES = ("level", "depth", "swing", "shape", "lean")
WINDOWS_A_WAVE = 4
# In usual depths: beyond it a beat says no more.
_LIMIT = 30.0


def beat_series(values: FloatArray, *, period: float) -> FloatArray | None:
    """Take a recording apart into beats, a quarter of the configured wave apart.

    Parameters
    ----------
    values, period
        As `capsule.sensed_wave.find_wave` takes them.

    Returns
    -------
    (S, 5, N) array, or None
        `SERIES` of each sensor, each minus the sensor's median, in units of the sensor's median
        depth. None for a recording of fewer than four waves, or without a wave on some sensor.
    """
    wave = find_wave(values, period)
    if wave is None:
        return None
    turn = np.exp(-1j * wave.phase)
    turns = np.stack([turn.real, -turn.imag, (turn**2).real, -(turn**2).imag])
    harmonics = wave.harmonics(turns)
    usual_depth = median(harmonics[0])
    if np.any(usual_depth <= 0):
        return None
    series = np.concatenate([wave.level[np.newaxis], harmonics])
    series = (series - median(series)) / usual_depth
    centre = wave.centre(np.arange(wave.level.shape[1], dtype=float))
    wanted = np.arange(centre[0], centre[-1] + 1e-9, period / WINDOWS_A_WAVE)
    below = np.minimum(np.searchsorted(centre, wanted, side="right") - 1, centre.size - 2)
    share = (wanted - centre[below]) / (centre[below + 1] - centre[below])
    even = series[..., below] * (1 - share) + series[..., below + 1] * share
    even_series: FloatArray = np.clip(even, -_LIMIT, _LIMIT).transpose(1, 0, 2)
    return even_series
