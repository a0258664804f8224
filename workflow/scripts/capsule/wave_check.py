"""Check that every sensor shows the wave. Otherwise no detector judges the recording."""

import numpy as np

from capsule.arrays import BoolArray, ComplexArray, FloatArray
from capsule.divider import pressed_and_period
from capsule.kinds import Settings
from capsule.sensed_wave import cut_into_waves, wave_phase

# Smallest share of the expected delay between sensors; a pulsating bench makes the wave look fast.
_LEAST_TRAVEL = 0.25


def missing_wave(values: FloatArray, rate_hz: float, settings: Settings, false_rate: float) -> str:
    """Return why a recording cannot be judged, such as which sensor shows no wave.

    Two properties tell a wave from noise or interference. First, the beats of a sensor keep step
    with those of the other sensors; the test of Rayleigh checks this for each sensor
    (`phase_tests`). Second, the wave travels: it reaches one sensor after the other. Interference
    reaches all sensors at once.

    Parameters
    ----------
    values : (S, K) array
        Readings on an even grid in time; NaN where a sample is missing.
    rate_hz : float
        Sampling rate.
    settings : mapping
        Section ``diagonal`` of the configuration, which describes wave and sensors.
    false_rate : float
        How often a sensor without a wave may pass; if 1, every recording passes.

    Returns
    -------
    str
        Empty if every sensor shows a wave that travels.
    """
    # A single sensor cannot be compared with others.
    if false_rate >= 1 or len(values) < 2:
        return ""
    pressed, period = pressed_and_period(values, rate_hz, settings)
    tested = phase_tests(pressed, period)
    if tested is None:
        return f"the recording is shorter than four waves of {period / rate_hz:g} s"
    chances, travel = tested
    # Several sensors are tested, so each gets an equal part of the rate.
    without = np.flatnonzero(~(chances <= false_rate / len(values))) + 1
    if without.size:
        names = " and ".join(f"sensor_{sensor}" for sensor in without)
        return f"no wave on {names}"
    wavelength_mm, pitch_mm = settings["wavelength_mm"], settings["pitch_mm"]
    expected = 2 * np.pi * pitch_mm / wavelength_mm * (len(values) - 1)
    if pitch_mm < wavelength_mm / 2 and abs(travel) < _LEAST_TRAVEL * expected:
        return "all sensors respond at the same time: interference, not a travelling wave"
    return ""


def phase_tests(pressed: FloatArray, period: float) -> tuple[FloatArray, float] | None:
    """Test whether each sensor's beats keep step with those of the others.

    Parameters
    ----------
    pressed : (S, K) array
        How hard each sensor is pressed, in any unit and from any rest value; NaN where a sample is
        missing. S >= 2.
    period : float
        Configured time from wave to wave, in samples.

    Returns
    -------
    chances : (S,) array
        Probability, by `rayleigh`, that independent beats keep step as well as this sensor's.
    travel : float
        Phase by which the last sensor is behind the first, in radians, summed from sensor to
        sensor. For fewer than four waves, the function returns None instead.
    """
    waves = cut_into_waves(pressed, period)
    if waves is None:
        return None
    sensors, count = waves.values.shape
    whole = count // waves.window
    turns = waves.steady * np.exp(-2j * np.pi / waves.period * np.arange(count))

    def directions(of: BoolArray | slice, irregular: FloatArray) -> ComplexArray:
        """Return the direction of each wave's beat relative to a common phase, for some sensors."""
        against = (turns[of] * np.exp(-1j * irregular))[:, : whole * waves.window]
        sums = against.reshape(-1, whole, waves.window).sum(axis=2)
        unit: ComplexArray = sums / np.maximum(np.abs(sums), 1e-300)
        return unit

    chances = []
    for alone in np.eye(sensors, dtype=bool):
        irregular, _ = wave_phase(waves.values[~alone], waves.period)
        chances.append(rayleigh(directions(alone, irregular)[0]))
    together = directions(slice(None), wave_phase(waves.values, waves.period)[0])
    steps = np.angle((together[1:] * together[:-1].conj()).sum(axis=1))
    return np.array(chances), float(steps.sum())


def rayleigh(directions: ComplexArray) -> float:
    """Return the probability that random directions agree this well (the test of Rayleigh).

    Parameters
    ----------
    directions : (n,) array of complex
        Complex numbers of length 1, or 0 for a wave without a direction.

    Returns
    -------
    float
        By the approximation of Greenwood and Durand (1955) as in Zar (2010), equation 27.4.
    """
    count, length = directions.size, min(abs(directions.sum()), directions.size)
    return float(np.exp(np.sqrt(1 + 4 * count + 4 * (count**2 - length**2)) - (1 + 2 * count)))
