"""Convert compression to counts: piezoresistive substructure, voltage divider and ADC.

The sensor lags, and may have hysteresis, crosstalk and jumps. With a strength of 0, each of these
leaves its signal unchanged or adds nothing.
"""

from dataclasses import dataclass
from itertools import accumulate
from typing import Annotated

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.phantom.quantities import Limits, Positive, Share, Signed


@dataclass(frozen=True)
class Sensor:
    """Parameters of a substructure as a resistor."""

    resistance_ohm: Positive
    resistance_spread: float
    gauge_per_mm: Signed
    saturation_mm: Positive
    lag_s: float
    creep_fraction: Share
    creep_s: float
    settling: float
    settling_s: Positive
    settling_spread: float
    drift_per_s: float
    noise: float
    hysteresis: Share
    hysteresis_mm: float
    release_peak: float
    release_s: float
    crosstalk: Share
    jump: float
    jump_run_spread: float
    jumps_per_s: float
    jump_s: Positive


@dataclass(frozen=True)
class Electronics:
    """Parameters of the voltage divider and the converter (ADC)."""

    series_ohm: Positive
    vref_v: Positive
    adc_bits: Annotated[int, Limits(1, 32)]
    rate_hz: Positive


class Sensors:
    """The sensors of one capsule: their resistance without load, and their polymer under load.

    The resistance without load drifts with mounting, temperature and wear. Compression brings the
    polymer's carbon particles closer together, up to saturation. One part of the response is quick,
    and the other part creeps. Play, a second peak on release, and crosstalk add to it if they are
    switched on.

    Parameters
    ----------
    generator
        Random numbers of the resistance without load.
    shape
        Sensors S, and all samples that they will feel.
    rate_hz
        Sampling rate.
    drift_return_s
        Time constant with which the drift returns to 0. With 0, the drift is a random walk, which
        suits a run of one or two minutes.
    """

    def __init__(
        self,
        sensor: Sensor,
        generator: np.random.Generator,
        shape: tuple[int, int],
        rate_hz: float,
        drift_return_s: float = 0.0,
    ) -> None:
        self._sensor, self._rate_hz, self._sample = sensor, rate_hz, 0
        time_s = np.arange(shape[1]) / rate_hz
        spread = generator.normal(0.0, sensor.resistance_spread, (shape[0], 1))
        self._rest_ohm = sensor.resistance_ohm * np.exp(spread)
        # All sensors settle alike: same material, same waves, same start.
        size = sensor.settling * np.exp(generator.normal(0.0, sensor.settling_spread))
        settling = generator.normal(0.0, size) * np.exp(-time_s / sensor.settling_s)
        drift = generator.standard_normal(shape) * sensor.drift_per_s / np.sqrt(rate_hz)
        noise = sensor.noise * generator.standard_normal(shape)
        # Draw the jumps last, so that they do not change the other draws.
        size = sensor.jump * np.exp(generator.normal(0.0, sensor.jump_run_spread))
        jumps = base_line_jumps(generator, shape, sensor.jumps_per_s, size, sensor.jump_s, rate_hz)
        if drift_return_s > 0:
            # The low-pass scales a step by 1 - decay. There is no step before the first sample.
            height = 1 - np.exp(-1 / (drift_return_s * rate_hz))
            drift = low_pass(drift, drift_return_s, rate_hz, np.zeros((shape[0], 1))) / height
        else:
            drift = np.cumsum(drift, axis=1)
        # Relative to the resistance at rest.
        self._change = settling + drift + noise + jumps
        nothing: FloatArray | None = None
        self._felt = self._held = self._peak = self._quick = self._slow = nothing

    def resistance(self, compression_mm: FloatArray) -> FloatArray:
        """Return the resistance at the next samples, in ohm: shape (S, K); compression lowers it.

        Parameters
        ----------
        compression_mm
            Compression of the substructure, both halves together, shape (S, K).
        """
        some = slice(self._sample, self._sample + compression_mm.shape[1])
        self._sample = some.stop
        change = self._change[:, some] - self._sensor.gauge_per_mm * self._follow(compression_mm)
        # Extreme parameters must not give a negative resistance.
        ohms: FloatArray = self._rest_ohm * np.maximum(1 + change, 0.0)
        return ohms

    def _follow(self, compression_mm: FloatArray) -> FloatArray:
        """Return the polymer's response to the next samples, in mm of compression: (S, K)."""
        sensor, rate_hz = self._sensor, self._rate_hz
        strained = crosstalk(compression_mm, sensor.crosstalk)
        felt = sensor.saturation_mm * np.tanh(strained / sensor.saturation_mm)
        peak = release_peak(
            felt, sensor.release_peak, sensor.release_s, rate_hz, self._felt, self._peak
        )
        load = felt
        if sensor.hysteresis:
            held = play(felt, sensor.hysteresis_mm, self._held)
            load = (1 - sensor.hysteresis) * felt + sensor.hysteresis * held
            self._held = held[:, -1:]
        load = load + peak
        quick = low_pass(load, sensor.lag_s, rate_hz, self._quick)
        slow = low_pass(load, sensor.creep_s, rate_hz, self._slow)
        self._felt, self._peak = felt[:, -1:], peak[:, -1:]
        self._quick, self._slow = quick[:, -1:], slow[:, -1:]
        return (1 - sensor.creep_fraction) * quick + sensor.creep_fraction * slow


def counts(electronics: Electronics, resistance_ohm: FloatArray) -> IntArray:
    """Return the converter's reading of the voltage across each sensor: integers of shape (S, K).

    The reading is ``floor(V 2^bits / Vref)``, at most the highest code.
    """
    steps = 2**electronics.adc_bits
    voltage_v = electronics.vref_v * resistance_ohm / (resistance_ohm + electronics.series_ohm)
    codes = np.floor(voltage_v * steps / electronics.vref_v)
    readings: IntArray = np.clip(codes, 0, steps - 1).astype(int)
    return readings


def low_pass(
    signal: FloatArray, time_constant_s: float, rate_hz: float, before: FloatArray | None = None
) -> FloatArray:
    """Return the first-order response to a signal (S, K).

    Parameters
    ----------
    before
        Response at the previous sample, shape (S, 1). If it is not given, the signal was constant
        before.
    """
    samples = signal.shape[-1]
    if time_constant_s <= 0:
        return signal
    decay = np.exp(-1 / (rate_hz * time_constant_s))
    kernel = (1 - decay) * decay ** np.arange(samples)
    rest = signal[..., :1] if before is None else before
    length = 2 * samples
    spectrum = np.fft.rfft(signal - rest, length) * np.fft.rfft(kernel, length)
    return rest + np.fft.irfft(spectrum, length)[..., :samples]


def play(
    compression_mm: FloatArray, width_mm: float, before: FloatArray | None = None
) -> FloatArray:
    """Return the output of a play operator (backlash) that follows a load, in mm: shape (S, K).

    After the load turns back, the output moves only once the load has moved by the whole width. So
    loading and unloading take different paths, at any speed (M. A. Krasnosel'skii and
    A. V. Pokrovskii, Systems with Hysteresis, 1989).

    Parameters
    ----------
    compression_mm
        Compression, shape (S, K).
    width_mm
        Width of the play: the loop's width along the load.
    before
        Output at the previous sample, shape (S, 1); the first compression if not given.
    """
    half = width_mm / 2

    def follow(held: float, load: float) -> float:
        return max(load - half, min(load + half, held))

    begin = compression_mm[:, :1] if before is None else before
    rows = zip(compression_mm.tolist(), begin[:, 0].tolist(), strict=True)
    return np.array([list(accumulate(row, follow, initial=held))[1:] for row, held in rows])


def release_peak(
    compression_mm: FloatArray,
    strength: float,
    time_s: float,
    rate_hz: float,
    load: FloatArray | None = None,
    peak: FloatArray | None = None,
) -> FloatArray:
    """Return the second peak that a sensor shows when it is released, in mm: shape (S, K).

    When the polymer springs back, its carbon network is disturbed again, in proportion to the speed
    of release. It recovers with a time constant.

    Parameters
    ----------
    compression_mm
        Compression, shape (S, K).
    strength
        Height of the second peak, as a fraction of a compression that is released at once.
    time_s
        Time constant of its decay.
    rate_hz
        Sampling rate.
    load, peak
        Compression and second peak at the previous sample, each of shape (S, 1).
    """
    if strength == 0:
        return np.zeros_like(compression_mm)
    before = compression_mm[:, :1] if load is None else load
    released = np.maximum(-np.diff(compression_mm, prepend=before), 0.0)
    # The low-pass turns a sudden release into a peak of height 1 - decay; scale it to 1.
    height = 1 - np.exp(-1 / (rate_hz * time_s))
    rest = None if peak is None else peak * height / strength
    peaks: FloatArray = strength * low_pass(released, time_s, rate_hz, rest) / height
    return peaks


def crosstalk(signal: FloatArray, share: float) -> FloatArray:
    """Return the signals with a share of each neighbour's signal added: shape (S, K).

    Neighbours are glued together, so a pressed substructure strains the next one.
    """
    mixed = signal.copy()
    mixed[1:] += share * signal[:-1]
    mixed[:-1] += share * signal[1:]
    return mixed


def base_line_jumps(
    generator: np.random.Generator,
    shape: tuple[int, int],
    jumps_per_s: float,
    size: float,
    recovery_s: float,
    rate_hz: float,
) -> FloatArray:
    """Return the jumps of each sensor's base line, relative to its resistance: shape (S, K).

    A joint that loosens or a crack that opens changes the resistance at once. The polymer then
    creeps back. Jumps are random (Poisson) and independent between sensors.

    Parameters
    ----------
    shape
        Sensors S and samples K.
    jumps_per_s
        Mean number of jumps per sensor and second.
    size
        Standard deviation of a jump.
    recovery_s
        Time constant with which the base line returns.
    """
    jumped = generator.random(shape) < jumps_per_s / rate_hz
    steps = np.where(jumped, generator.normal(0.0, size, shape), 0.0)
    decay = np.exp(-1 / (rate_hz * recovery_s))
    # The low-pass scales a sudden step by 1 - decay. There is no jump before the run.
    steps[:, 0] = 0.0
    jumps: FloatArray = low_pass(steps, recovery_s, rate_hz) / (1 - decay)
    return jumps
