"""The beats of a recording as series on an even grid in time, the input of the taught scorer.

`capsule.detectors.beats` has only the harmonics in phase. The series also have those in
quadrature, because a nodule felt early or late in the wave shifts the phase of the beat.
"""

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.beats import median
from capsule.sensed_wave import find_wave

# Level; first harmonic in phase and in quadrature; second harmonic in phase and in quadrature.
SERIES = ("level", "depth", "swing", "shape", "lean")
WINDOWS_A_WAVE = 4
# In usual depths. A larger beat tells nothing more, so the series are clipped here.
_LIMIT = 30.0


def beat_series(values: FloatArray, *, period: float) -> FloatArray | None:
    """Return the beats of a recording at intervals of a quarter of the configured wave.

    Parameters
    ----------
    values, period
        As in `capsule.sensed_wave.find_wave`.

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
