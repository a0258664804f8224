"""Plain traits of the wave in a recording. A recording of another kind differs in them.

A nodule hardly moves these traits: most of them come from the phase of the wave, and the nodule
lies under a sensor for a part of the run only.
"""

from dataclasses import dataclass, fields

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.wave import Wave

# In units of the wave's own frequency: the harmonics that count as the wave, how far from each, and
# the band to which their power is compared (0.1 to 2 Hz for the paper's wave).
_HARMONICS = (1, 2, 3)
_NEAR = 0.1
_BAND = (0.3, 6.4)


@dataclass(frozen=True)
class WaveTraits:
    """The traits of the wave in one recording; NaN if unknown.

    Attributes
    ----------
    period_s : float
        Time from wave to wave.
    step_s : float
        Mean time by which the wave reaches each sensor before the sensor in front of it.
    step_spread_s : float
        Largest deviation of one of these times from their mean.
    unsteadiness : float
        Standard deviation of the time from one wave to the next, in periods.
    wave_share : float
        Share of a sensor's power in the band of 0.3 to 6.4 times the wave's frequency that lies
        near the wave and its first two overtones; that of the sensor with the least.
    noise : float
        Mean absolute second difference of a sensor's readings, in depths of its wave; the median
        over the sensors.
    """

    period_s: float
    step_s: float
    step_spread_s: float
    unsteadiness: float
    wave_share: float
    noise: float


UNKNOWN_TRAITS = WaveTraits(*[float("nan")] * len(fields(WaveTraits)))


def wave_traits(wave: Wave | None, rate_hz: float) -> WaveTraits:
    """Return the traits of the wave in a recording, from `capsule.detectors.wave.wave_of`.

    They are `UNKNOWN_TRAITS` without a wave on each sensor. A single sensor has neither `step_s`
    nor `step_spread_s`.
    """
    if wave is None:
        return UNKNOWN_TRAITS
    depth = depths(wave)
    if not (depth > 0).all():
        return UNKNOWN_TRAITS
    period_s = wave.period * wave.stride / rate_hz
    # A single sensor has no neighbour.
    alone = wave.offset.size < 2
    steps = np.array([np.nan]) if alone else np.angle(np.exp(1j * np.diff(wave.offset)))
    steps_s = steps * period_s / (2 * np.pi)
    change = wave.irregular[wave.window :] - wave.irregular[: -wave.window]
    return WaveTraits(
        period_s=period_s,
        step_s=float(steps_s.mean()),
        step_spread_s=float(np.abs(steps_s - steps_s.mean()).max()),
        unsteadiness=float(change.std()) / (2 * np.pi),
        wave_share=float(wave_shares(wave).min()),
        noise=float(np.median(noises(wave) / depth)),
    )


def log_odds(share: FloatArray) -> FloatArray:
    """Return the logarithm of the odds of shares, which stays finite at 0 and 1."""
    bounded = np.clip(share, 0.001, 0.999)
    odds: FloatArray = np.log(bounded / (1 - bounded))
    return odds


def depths(wave: Wave) -> FloatArray:
    """Return the depth of the wave under each sensor, (S,), in the unit of the readings."""
    depth: FloatArray = 2 * np.abs((wave.steady * np.exp(-1j * wave.phase)).mean(axis=1))
    return depth


def noises(wave: Wave) -> FloatArray:
    """Return the mean absolute second difference of each sensor's readings, (S,)."""
    bend = np.abs(np.diff(wave.pressed, n=2))
    # Some samples are missing; a sensor may miss every second one.
    mean: FloatArray = np.nansum(bend, axis=1) / np.maximum(np.count_nonzero(bend >= 0, axis=1), 1)
    return mean


def wave_shares(wave: Wave) -> FloatArray:
    """Return the share of each sensor's power near the wave and its overtones, (S,)."""
    centred = wave.steady - wave.steady.mean(axis=1, keepdims=True)
    tapered = centred * np.hanning(wave.steady.shape[1] + 2)[1:-1]
    power = np.abs(np.fft.rfft(tapered, axis=1)) ** 2
    line = wave.period / (2 * (power.shape[1] - 1))
    frequency = np.arange(power.shape[1]) * line
    # A taper spreads a pure tone over two lines on each side.
    near = [np.abs(frequency - harmonic) < _NEAR + 2 * line for harmonic in _HARMONICS]
    band = (frequency > _BAND[0]) & (frequency < _BAND[1])
    inside = power[:, np.any(near, axis=0) & band].sum(axis=1)
    shares: FloatArray = inside / power[:, band].sum(axis=1)
    return shares
