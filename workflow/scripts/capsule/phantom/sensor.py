"""Convert compression to counts: piezoresistive substructure, voltage divider and ADC."""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.phantom.response import (
    base_line_jumps,
    crosstalk,
    hysteresis,
    low_pass,
    play,
    release_peak,
)


@dataclass(frozen=True)
class Sensor:
    """Parameters of a substructure as a resistor.

    Attributes
    ----------
    resistance_ohm
        Resistance at rest.
    resistance_spread
        Spread of the logarithm of the resistance at rest, from sensor to sensor.
    gauge_per_mm
        Relative change of resistance per mm of compression (for small compression).
    saturation_mm
        Compression at which the conducting network saturates.
    lag_s
        Time constant of the quick part of the response.
    creep_fraction
        Part of the response that follows slowly.
    creep_s
        Time constant of the slow part.
    settling
        Spread of the relative change of resistance while the sensors settle, after the capsule is
        inserted and the first waves press it. It is common to all sensors.
    settling_s
        Time constant of that settling.
    settling_spread
        Spread of the logarithm of its size, from run to run.
    drift_per_s
        Spread of the relative random walk of the resistance, per square root of a second.
    noise
        Relative noise of a reading.
    hysteresis
        Fraction of the response that has play (`capsule.phantom.response.play`).
    hysteresis_mm
        Width of that play.
    release_peak
        Height of the second peak on release, as a fraction of a compression that is released at
        once.
    release_s
        Time constant of that peak's decay.
    crosstalk
        Fraction of a sensor's response that its neighbours also show.
    jump
        Spread of the jumps of a sensor's base line, relative to its resistance.
    jump_run_spread
        Spread of the logarithm of that size, from run to run.
    jumps_per_s
        Mean number of such jumps per second.
    jump_s
        Time constant with which the base line returns after a jump.
    """

    resistance_ohm: float
    resistance_spread: float
    gauge_per_mm: float
    saturation_mm: float
    lag_s: float
    creep_fraction: float
    creep_s: float
    settling: float
    settling_s: float
    settling_spread: float
    drift_per_s: float
    noise: float
    hysteresis: float
    hysteresis_mm: float
    release_peak: float
    release_s: float
    crosstalk: float
    jump: float
    jump_run_spread: float
    jumps_per_s: float
    jump_s: float


@dataclass(frozen=True)
class Electronics:
    """Parameters of the voltage divider and the converter (ADC).

    Attributes
    ----------
    series_ohm
        Resistor in series with the sensor.
    vref_v
        Supply of the divider and reference of the converter.
    adc_bits
        Resolution of the converter.
    rate_hz
        Sampling rate.
    """

    series_ohm: float
    vref_v: float
    adc_bits: int
    rate_hz: float


class Polymer:
    """The response of the sensors' polymer to its load, with the memory of past loads.

    Compression brings the carbon particles closer together, up to saturation. One part of the
    response is quick, and the other part creeps. Play, a second peak on release, and crosstalk
    add to it if they are switched on.

    Parameters
    ----------
    sensor
        Parameters of the sensor.
    rate_hz
        Sampling rate.
    """

    def __init__(self, sensor: Sensor, rate_hz: float) -> None:
        self._sensor, self._rate_hz = sensor, rate_hz
        nothing: FloatArray | None = None
        self._felt = self._held = self._peak = self._quick = self._slow = nothing

    def follow(self, compression_mm: FloatArray) -> FloatArray:
        """Return the response to the next samples, in mm of compression: shape (S, K).

        Parameters
        ----------
        compression_mm
            Compression of the substructure, both halves together, shape (S, K).
        """
        sensor, rate_hz = self._sensor, self._rate_hz
        strained = crosstalk(compression_mm, sensor.crosstalk)
        felt = sensor.saturation_mm * np.tanh(strained / sensor.saturation_mm)
        before = None
        if self._felt is not None and self._peak is not None:
            before = self._felt, self._peak
        peak = release_peak(felt, sensor.release_peak, sensor.release_s, rate_hz, before)
        load = felt
        if sensor.hysteresis:
            held = play(felt, sensor.hysteresis_mm, self._held)
            load, self._held = hysteresis(felt, held, sensor.hysteresis), held[:, -1:]
        load = load + peak
        quick = low_pass(load, sensor.lag_s, rate_hz, self._quick)
        slow = low_pass(load, sensor.creep_s, rate_hz, self._slow)
        self._felt, self._peak = felt[:, -1:], peak[:, -1:]
        self._quick, self._slow = quick[:, -1:], slow[:, -1:]
        return (1 - sensor.creep_fraction) * quick + sensor.creep_fraction * slow


@dataclass(frozen=True)
class Unloaded:
    """The sensors' resistance without load over one journey.

    Attributes
    ----------
    rest_ohm
        Resistance at rest, shape (S, 1).
    change
        Relative change from drift, settling, noise and jumps, shape (S, K).
    """

    rest_ohm: FloatArray
    change: FloatArray


def draw_unloaded(
    sensor: Sensor,
    generator: np.random.Generator,
    shape: tuple[int, int],
    rate_hz: float,
    drift_return_s: float = 0.0,
) -> Unloaded:
    """Draw the sensors' resistance without load, which drifts with mounting, temperature and wear.

    Parameters
    ----------
    shape
        Sensors S and samples K.
    rate_hz
        Sampling rate.
    drift_return_s
        Time constant with which the drift returns to 0. With 0, the drift is a random walk, which
        suits a run of one or two minutes.
    """
    sensors, samples = shape
    time_s = np.arange(samples) / rate_hz
    rest = sensor.resistance_ohm * np.exp(
        generator.normal(0.0, sensor.resistance_spread, (sensors, 1))
    )
    # All sensors settle alike: same material, same waves, same start.
    size = sensor.settling * np.exp(generator.normal(0.0, sensor.settling_spread))
    settling = generator.normal(0.0, size) * np.exp(-time_s / sensor.settling_s)
    steps = generator.standard_normal((sensors, samples)) * sensor.drift_per_s / np.sqrt(rate_hz)
    noise = sensor.noise * generator.standard_normal((sensors, samples))
    # Draw the jumps last, so that they do not change the other draws.
    size = sensor.jump * np.exp(generator.normal(0.0, sensor.jump_run_spread))
    jumps = base_line_jumps(
        generator, (sensors, samples), sensor.jumps_per_s, size, sensor.jump_s, rate_hz
    )
    if drift_return_s > 0:
        # The low-pass scales a step by 1 - decay. There is no step before the first sample.
        height = 1 - np.exp(-1 / (drift_return_s * rate_hz))
        drift = low_pass(steps, drift_return_s, rate_hz, np.zeros((sensors, 1))) / height
    else:
        drift = np.cumsum(steps, axis=1)
    return Unloaded(rest, settling + drift + noise + jumps)


def loaded_resistance(
    sensor: Sensor, rest_ohm: FloatArray, change: FloatArray, followed_mm: FloatArray
) -> FloatArray:
    """Return the resistance of each sensor in ohm; compression lowers it.

    Parameters
    ----------
    rest_ohm, change
        As in `Unloaded`, shapes (S, 1) and (S, K).
    followed_mm
        From `Polymer.follow`, shape (S, K).
    """
    # Extreme parameters must not give a negative resistance.
    return rest_ohm * np.maximum(1 + (change - sensor.gauge_per_mm * followed_mm), 0.0)


def resistance(
    sensor: Sensor,
    generator: np.random.Generator,
    compression_mm: FloatArray,
    rate_hz: float,
) -> FloatArray:
    """Return the resistance of each sensor over one run, in ohm.

    Parameters
    ----------
    compression_mm
        Compression of the substructure, both halves together, shape (S, K).
    """
    unloaded = draw_unloaded(sensor, generator, compression_mm.shape, rate_hz)
    followed_mm = Polymer(sensor, rate_hz).follow(compression_mm)
    return loaded_resistance(sensor, unloaded.rest_ohm, unloaded.change, followed_mm)


def counts(electronics: Electronics, resistance_ohm: FloatArray) -> IntArray:
    """Return the converter's reading of the voltage across each sensor: integers of shape (S, K).

    The reading is ``floor(V 2^bits / Vref)``, at most the highest code.
    """
    steps = 2**electronics.adc_bits
    voltage_v = electronics.vref_v * resistance_ohm / (resistance_ohm + electronics.series_ohm)
    codes = np.floor(voltage_v * steps / electronics.vref_v)
    readings: IntArray = np.clip(codes, 0, steps - 1).astype(int)
    return readings
