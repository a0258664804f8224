"""From compression to counts: piezoresistive substructure, voltage divider, analogue converter."""

from dataclasses import dataclass

import numpy as np

from capsule.phantom.response import (
    base_line_jumps,
    crosstalk,
    hysteresis,
    low_pass,
    release_peak,
)


@dataclass(frozen=True)
class Sensor:
    """A substructure as a resistor.

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
        Spread of the relative change of resistance, common to all sensors, while they settle after
        the capsule was set in and the first waves pressed it.
    settling_s
        Time constant of that settling.
    settling_spread
        Spread of the logarithm of its size, from run to run.
    drift_per_s
        Spread of the relative random walk of the resistance, per square root of a second.
    noise
        Relative noise of a reading.
    hysteresis
        Part of the response that has play: it follows a load only after it has turned back.
    hysteresis_mm
        Width of that play.
    release_peak
        Height of the second peak on release, in parts of a compression that is released at once.
    release_s
        Time in which that peak decays.
    crosstalk
        Part of a sensor's response that its neighbours show as well.
    jump
        Spread of the jumps of a sensor's base line, relative to its resistance.
    jump_run_spread
        Spread of the logarithm of that size, from run to run.
    jumps_per_s
        Mean number of such jumps a second.
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
    """The voltage divider and the converter.

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


def resistance(
    sensor: Sensor,
    generator: np.random.Generator,
    compression_mm: np.ndarray,
    rate_hz: float,
) -> np.ndarray:
    """Return the resistance of each sensor over time, in ohm.

    Compression brings the carbon particles closer and lowers the resistance, up to saturation;
    the polymer follows quickly in part and slowly in part; mounting, temperature and wear make
    the rest value drift. Play, a second peak on release, crosstalk and jumps of the base line come
    on top where they are switched on.

    Parameters
    ----------
    compression_mm
        Compression of the substructure, both halves together, shape (S, K).
    """
    sensors, samples = compression_mm.shape
    strained = crosstalk(compression_mm, sensor.crosstalk)
    felt = sensor.saturation_mm * np.tanh(strained / sensor.saturation_mm)
    felt = hysteresis(felt, sensor.hysteresis, sensor.hysteresis_mm) + release_peak(
        felt, sensor.release_peak, sensor.release_s, rate_hz
    )
    quick = low_pass(felt, sensor.lag_s, rate_hz)
    slow = low_pass(felt, sensor.creep_s, rate_hz)
    followed = (1 - sensor.creep_fraction) * quick + sensor.creep_fraction * slow

    time_s = np.arange(samples) / rate_hz
    rest = sensor.resistance_ohm * np.exp(
        generator.normal(0.0, sensor.resistance_spread, (sensors, 1))
    )
    # Of one material and pressed by the same waves from the same moment on, they settle alike.
    size = sensor.settling * np.exp(generator.normal(0.0, sensor.settling_spread))
    settling = generator.normal(0.0, size) * np.exp(-time_s / sensor.settling_s)
    steps = generator.standard_normal((sensors, samples)) * sensor.drift_per_s / np.sqrt(rate_hz)
    noise = sensor.noise * generator.standard_normal((sensors, samples))
    # Drawn last: where nothing jumps, all else is as it was.
    size = sensor.jump * np.exp(generator.normal(0.0, sensor.jump_run_spread))
    jumps = base_line_jumps(
        generator, (sensors, samples), sensor.jumps_per_s, size, sensor.jump_s, rate_hz
    )
    change = -sensor.gauge_per_mm * followed + settling + np.cumsum(steps, axis=1) + noise + jumps
    # No resistance can fall below zero, however wild the parameters.
    return rest * np.maximum(1 + change, 0.0)


def counts(electronics: Electronics, resistance_ohm: np.ndarray) -> np.ndarray:
    """Return the converter's reading of the voltage across each sensor: integers of shape (S, K).

    The silicon converts ``floor(V 2^bits / Vref)`` and stays at its highest code above that.
    """
    steps = 2**electronics.adc_bits
    voltage_v = electronics.vref_v * resistance_ohm / (resistance_ohm + electronics.series_ohm)
    codes = np.floor(voltage_v * steps / electronics.vref_v)
    return np.clip(codes, 0, steps - 1).astype(int)
