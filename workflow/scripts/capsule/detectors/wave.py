"""The peristaltic wave in the readings: its period, level and phase, and whether it is there.

Every wave presses every sensor once, so the wave calibrates each sensor. The phase tells how far
the capsule has moved: a capsule that advances by one wavelength meets one wave less. If a sensor
shows no wave, no detector judges the recording.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from capsule.arrays import BoolArray, ComplexArray, FloatArray
from capsule.kinds import Settings
from capsule.recordings.units import pressed_and_period

# Samples of a wave after thinning: enough for two harmonics.
_SAMPLES_A_WAVE = 16
# Smallest share of the expected delay between sensors; a pulsating bench makes the wave look fast.
_LEAST_TRAVEL = 0.25


@dataclass(frozen=True)
class Wave:
    """A recording cut into windows of one wave, and the phase of the wave.

    Attributes
    ----------
    pressed : (S, R) array
        How hard each sensor is pressed in each sample of the recording; NaN where it is missing.
    expected : float
        The configured time from wave to wave, in samples of the recording.
    values : (S, K) array
        The same, thinned and without gaps.
    stride : int
        Number of samples of the recording that were averaged into one of these.
    period : float
        The recording's own time from wave to wave, in these samples.
    window : int
        The period, rounded to whole samples.
    level : (S, N) array
        Mean of each window of one wave.
    steady : (S, K) array
        Readings minus the level. Without this, a drift during a wave would look like a beat.
    """

    pressed: FloatArray
    expected: float
    values: FloatArray
    stride: int
    period: float
    window: int
    level: FloatArray
    steady: FloatArray

    @cached_property
    def _phases(self) -> tuple[FloatArray, FloatArray]:
        return wave_phase(self.values, self.period)

    @property
    def irregular(self) -> FloatArray:
        """Deviation of the common phase from that of a wave of the mean period, (K,), radians."""
        return self._phases[0]

    @property
    def offset(self) -> FloatArray:
        """Phase of each sensor against the first, (S,), in radians."""
        return self._phases[1]

    @cached_property
    def phase(self) -> FloatArray:
        """Phase of the wave under each sensor, (S, K), in radians."""
        samples = np.arange(self.values.shape[1])
        steady = 2 * np.pi / self.period * samples
        return self.irregular + steady + self.offset[:, np.newaxis]

    def harmonics(self, turns: FloatArray) -> FloatArray:
        """Return twice the mean of readings times turns (H, S, K) in each window, (H, S, N)."""
        rest = window_mean(self.steady, self.window) * window_mean(turns, self.window)
        return 2 * (window_mean(self.steady * turns, self.window) - rest)

    def centre(self, windows: FloatArray) -> FloatArray:
        """Return the centres of windows in samples of the recording."""
        # A thinned sample lies in the middle of the samples that it averages.
        return self.stride * (windows + (self.window - 1) / 2) + (self.stride - 1) / 2


def fill_missing(values: FloatArray) -> FloatArray:
    """Return readings with missing samples (NaN) filled by straight lines.

    Missing samples at the ends take the nearest reading.

    Parameters
    ----------
    values : (S, K) array
        Readings, at least one known for each sensor.

    Returns
    -------
    (S, K) array
    """
    if not np.isnan(values).any():
        return values
    place = np.arange(values.shape[1])
    known = ~np.isnan(values)
    return np.stack(
        [np.interp(place, place[k], row[k]) for row, k in zip(values, known, strict=True)]
    )


def thinned(values: FloatArray, period: float) -> tuple[FloatArray, int]:
    """Average neighbouring samples, so that a high sampling rate costs no extra time.

    Parameters
    ----------
    values : (S, K) array
        Readings without gaps.
    period : float
        Samples a wave.

    Returns
    -------
    values : (S, K // stride) array
        At least `_SAMPLES_A_WAVE` samples a wave, unless `values` has fewer.
    stride : int
        Number of samples averaged into one. A remainder at the end is left out.
    """
    stride = max(int(period // _SAMPLES_A_WAVE), 1)
    count = values.shape[1] // stride
    whole = values[:, : count * stride]
    return whole.reshape(values.shape[0], count, stride).mean(axis=2), stride


def wave_period(values: FloatArray, expected: float) -> float:
    """Return the wave's period: the strongest line of the spectrum within a factor of two.

    Parameters
    ----------
    values : (S, K) array
        Readings without gaps.
    expected : float
        The configured period in samples.

    Returns
    -------
    float
        Period in samples, interpolated between the lines.
    """
    count = values.shape[1]
    centred = values - values.mean(axis=1, keepdims=True)
    scale = centred.std(axis=1, keepdims=True)
    tapered = centred / np.where(scale > 0, scale, 1.0) * _taper(count)
    # The FFT of a power of two is fast. Padding gives at least four lines for each line of the
    # plain spectrum: enough for a parabola through the highest line and its neighbours.
    padded = 4 << (count - 1).bit_length()
    low, high = int(np.ceil(padded / (2 * expected))), int(padded / (expected / 2))
    # The lines within the range, and one more at each end.
    lines = np.fft.rfft(tapered, padded, axis=1)[:, low - 1 : high + 2]
    power = (np.abs(lines) ** 2).sum(axis=0)
    highest = 1 + int(power[1:-1].argmax())
    before, peak, after = power[highest - 1 : highest + 2]
    bend = before - 2 * peak + after
    # At an end of the range the highest line need not be a peak.
    off = 0.5 * (before - after) / bend if bend < 0 else 0.0
    own: float = padded / (low - 1 + highest + min(max(off, -0.5), 0.5))
    return own


def wave_phase(values: FloatArray, period: float) -> tuple[FloatArray, FloatArray]:
    """Return the phase of the wave, which all sensors share up to a constant.

    Parameters
    ----------
    values : (S, K) array
        Readings without gaps.
    period : float
        Mean period in samples.

    Returns
    -------
    irregular : (K,) array
        Deviation of the common phase from that of a wave of the mean period, in radians.
    offset : (S,) array
        Phase of each sensor against the first, in radians.
    """
    samples = np.arange(values.shape[1])
    wave = round(period)
    taper = _taper(2 * wave + 1)
    # Only whole windows: the mean over a cut window is biased.
    level = window_mean(values, wave)
    inside = samples[(wave - 1) // 2 :][: level.shape[1]]
    steady = values[:, inside[0] : inside[-1] + 1] - level
    demodulated = steady * np.exp(-2j * np.pi / period * inside)
    phasors = np.stack([np.convolve(row, taper, "valid") for row in demodulated])
    phasors /= np.maximum(np.abs(phasors), 1e-300)
    offset = np.angle(phasors @ np.conj(phasors[0]))
    common = np.exp(-1j * offset) @ phasors
    # From sample to sample the phase moves by less than half a turn.
    steps = np.angle(common[1:] * np.conj(common[:-1]))
    irregular = np.angle(common[0]) + np.concatenate([[0.0], np.cumsum(steps)])
    # Near the ends no whole window fits, so the deviation is assumed to stay constant there.
    known = inside[(taper.size - 1) // 2 :][: irregular.size]
    return np.interp(samples, known, irregular), offset


def find_wave(values: FloatArray, period: float) -> Wave | None:
    """Find the period of a recording's wave and cut the recording into windows of one wave.

    Parameters
    ----------
    values : (S, K) array
        How hard each sensor is pressed, in any unit and from any rest value; NaN where a sample is
        missing.
    period : float
        Configured time from wave to wave, in samples; the recording's own may be half or twice it.

    Returns
    -------
    Wave or None
        None for a recording of fewer than four waves.
    """
    pressed, stride = thinned(fill_missing(values), period)
    count = pressed.shape[1]
    if count * stride < 4 * period:
        return None
    own_period = wave_period(pressed, period / stride)
    window = round(own_period)
    if count < 4 * window:
        return None
    centred = pressed - pressed.mean(axis=1, keepdims=True)
    level = window_mean(centred, window)
    steady = centred - level_line(level, window)
    return Wave(values, period, pressed, stride, own_period, window, level, steady)


def wave_of(values: FloatArray, rate_hz: float, settings: Settings) -> Wave | None:
    """Return the wave of a recording; None if it has fewer than four.

    All that detectors see of a recording is computed from its wave, which is found once. The
    parameters are as in `capsule.recordings.units.pressed_and_period`.
    """
    return find_wave(*pressed_and_period(values, rate_hz, settings))


def level_line(level: FloatArray, window: int) -> FloatArray:
    """Return the windows' level (S, N) at every sample (S, K); the ends continue at their slope.

    The slope is that over a window, of which a recording has four.
    """
    first, last = level[:, :1], level[:, -1:]
    first_slope = (level[:, window : window + 1] - first) / window
    last_slope = (last - level[:, -1 - window :][:, :1]) / window
    # The centre of an even window lies between two samples.
    middle = level if window % 2 else (level[:, :-1] + level[:, 1:]) / 2
    before = np.arange(window // 2) - (window - 1) / 2
    after = -before[::-1]
    return np.concatenate([first + before * first_slope, middle, last + after * last_slope], axis=1)


def window_mean(values: FloatArray, window: int) -> FloatArray:
    """Return the mean along the last axis over each whole window."""
    running = np.zeros((*values.shape[:-1], values.shape[-1] + 1))
    np.cumsum(values, axis=-1, out=running[..., 1:])
    return (running[..., window:] - running[..., :-window]) / window


def _taper(count: int) -> FloatArray:
    """Return a Hann window of `count` samples, none of them zero."""
    taper: FloatArray = 0.5 - 0.5 * np.cos(2 * np.pi / (count + 1) * np.arange(1, count + 1))
    return taper


def missing_wave(wave: Wave | None, settings: Settings, false_rate: float) -> str:
    """Return why a recording cannot be judged, such as which sensor shows no wave.

    Two properties tell a wave from noise or interference. First, the beats of a sensor keep step
    with those of the other sensors; the test of Rayleigh checks this for each sensor
    (`phase_tests`). Second, the wave travels: it reaches one sensor after the other. Interference
    reaches all sensors at once.

    Parameters
    ----------
    wave : Wave or None
        From `wave_of`.
    settings : mapping
        Section ``diagonal`` of the configuration, which describes wave and sensors.
    false_rate : float
        How often a sensor with white noise may pass; if 1, every recording passes. Of 0.01, a
        random walk passes at 0.03, and noise in a narrow band around the wave's frequency at 0.25.

    Returns
    -------
    str
        Empty if every sensor shows a wave that travels, and for a single sensor, which cannot be
        compared with others.
    """
    wavelength_mm, pitch_mm = settings["wavelength_mm"], settings["pitch_mm"]
    if false_rate >= 1:
        return ""
    if wave is None:
        wave_s = wavelength_mm / settings["wave_speed_mm_s"]
        return f"the recording is shorter than four waves of {wave_s:g} s"
    sensors = len(wave.values)
    if sensors < 2:
        return ""
    chances, travel = phase_tests(wave)
    # Several sensors are tested, so each gets an equal part of the rate.
    without = np.flatnonzero(~(chances <= false_rate / sensors)) + 1
    if without.size:
        names = " and ".join(f"sensor_{sensor}" for sensor in without)
        return f"no wave on {names}"
    expected = 2 * np.pi * pitch_mm / wavelength_mm * (sensors - 1)
    if pitch_mm < wavelength_mm / 2 and abs(travel) < _LEAST_TRAVEL * expected:
        return "all sensors respond at the same time: interference, not a travelling wave"
    return ""


def phase_tests(wave: Wave) -> tuple[FloatArray, float]:
    """Test whether each of several sensors' beats keep step with those of the others.

    Returns
    -------
    chances : (S,) array
        Probability, by `rayleigh`, that independent beats keep step as well as this sensor's.
    travel : float
        Phase by which the last sensor is behind the first, in radians, summed from sensor to
        sensor.
    """
    sensors, count = wave.values.shape
    whole = count // wave.window
    turns = wave.steady * np.exp(-2j * np.pi / wave.period * np.arange(count))

    def directions(of: BoolArray | slice, irregular: FloatArray) -> ComplexArray:
        """Return the direction of each wave's beat relative to a common phase, for some sensors."""
        against = (turns[of] * np.exp(-1j * irregular))[:, : whole * wave.window]
        sums = against.reshape(-1, whole, wave.window).sum(axis=2)
        unit: ComplexArray = sums / np.maximum(np.abs(sums), 1e-300)
        return unit

    chances = []
    for alone in np.eye(sensors, dtype=bool):
        irregular, _ = wave_phase(wave.values[~alone], wave.period)
        chances.append(rayleigh(directions(alone, irregular)[0]))
    together = directions(slice(None), wave.irregular)
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
