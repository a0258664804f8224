"""From readings to beats: the peristaltic wave as each sensor's own calibration and odometer.

Every wave presses every sensor once. Within one wave the signal is a few harmonics of the wave's
phase; a nodule makes the beats deeper and changes their shape while it passes a sensor. Taken
relative to the sensor's usual beat, this needs neither the sensor's gain nor its resistance, and
slow drift does not enter. The phase itself tells how far the capsule has moved: a capsule that
advances by one wavelength meets one wave less.
"""

from dataclasses import dataclass

import numpy as np

CHANNELS = ("level", "depth", "shape")
# Two harmonics need few samples a wave, and the windows of one wave change slowly.
_SAMPLES_A_WAVE, _WINDOWS_A_WAVE = 16, 4


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

    channels: np.ndarray
    centre: np.ndarray
    irregular_mm: np.ndarray


def fill_missing(values: np.ndarray) -> np.ndarray:
    """Bridge missing samples (NaN) by straight lines; the ends take the nearest reading.

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


def thinned(values: np.ndarray, period: float) -> tuple[np.ndarray, int]:
    """Average neighbouring samples, so that a quickly sampled recording takes no longer.

    Parameters
    ----------
    values : (S, K) array
        Readings without gaps.
    period : float
        Samples a wave.

    Returns
    -------
    values : (S, K // stride) array
        At least `_SAMPLES_A_WAVE` to a wave, where there were as many.
    stride : int
        How many samples became one. What remains at the end is left out.
    """
    stride = max(int(period // _SAMPLES_A_WAVE), 1)
    count = values.shape[1] // stride
    whole = values[:, : count * stride]
    return whole.reshape(values.shape[0], count, stride).mean(axis=2), stride


def wave_period(values: np.ndarray, expected: float) -> float:
    """Find the wave's period: the strongest line of the spectrum within a factor of two.

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
    # A power of two is fast for every number of samples; four lines to each natural one are
    # enough for a parabola through the highest and its neighbours.
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
    return padded / (low - 1 + highest + min(max(off, -0.5), 0.5))


def wave_phase(values: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Follow the phase of the wave, which all sensors share up to a constant.

    Parameters
    ----------
    values : (S, K) array
        Readings without gaps.
    period : float
        Mean period in samples.

    Returns
    -------
    irregular : (K,) array
        What the common phase deviates from that of a wave of the mean period, in radians.
    offset : (S,) array
        Phase of each sensor against the first, in radians.
    """
    samples = np.arange(values.shape[1])
    wave = round(period)
    taper = _taper(2 * wave + 1)
    # Only windows that lie wholly inside: a cut one would lean to its side.
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
    # Towards the ends, where no whole window fits, the motion counts as steady.
    known = inside[(taper.size - 1) // 2 :][: irregular.size]
    return np.interp(samples, known, irregular), offset


def find_beats(values: np.ndarray, *, period: float, wavelength_mm: float) -> Beats | None:
    """Take a recording apart into beats.

    Parameters
    ----------
    values : (S, K) array
        How hard each sensor is pressed, in any unit and from any rest; NaN where a sample is
        missing.
    period : float
        Configured time from wave to wave, in samples; the recording's own may be half or twice it.
    wavelength_mm : float
        Length of the wave in mm.

    Returns
    -------
    Beats or None
        None for a recording of fewer than four waves, or without a wave on some sensor.
    """
    pressed, stride = thinned(fill_missing(values), period)
    count = pressed.shape[1]
    if count * stride < 4 * period:
        return None
    own_period = wave_period(pressed, period / stride)
    window = round(own_period)
    if count < 4 * window:
        return None
    irregular, offset = wave_phase(pressed, own_period)
    samples = np.arange(count)
    phase = irregular + 2 * np.pi / own_period * samples + offset[:, np.newaxis]
    centred = pressed - pressed.mean(axis=1, keepdims=True)
    level = window_mean(centred, window)
    # A sensor that drifts during a wave would seem to beat.
    steady = centred - level_line(level, window)
    turn = np.cos(phase)
    turns = np.stack([turn, 2 * turn**2 - 1])  # cos(phase) and cos(2 phase)
    rest = window_mean(steady, window) * window_mean(turns, window)
    harmonics = 2 * (window_mean(steady * turns, window) - rest)
    usual_depth = median(harmonics[0])
    if np.any(usual_depth <= 0):
        return None
    step = max(window // _WINDOWS_A_WAVE, 1)
    channels = np.concatenate([level[np.newaxis], harmonics])[..., ::step]
    channels = (channels - median(channels)) / usual_depth
    centre = np.arange(0, level.shape[1], step) + (window - 1) / 2
    # Ahead of steady motion, the capsule meets the wave late: the phase falls behind.
    ahead = np.interp(centre, samples, -irregular) * wavelength_mm / (2 * np.pi)
    # A thinned sample lies in the middle of those that became it.
    return Beats(channels, stride * centre + (stride - 1) / 2, _without_line(centre, ahead))


def median(values: np.ndarray) -> np.ndarray:
    """Give the median along the last axis, which stays with length 1."""
    return quantile(np.sort(values, axis=-1), 0.5)


def quantile(ordered: np.ndarray, share: float) -> np.ndarray:
    """Give a quantile along the last axis, which is sorted and stays with length 1.

    As by ``np.quantile(ordered, share, axis=-1, keepdims=True)``, which takes ten times as long for
    a few short rows.
    """
    rank = share * (ordered.shape[-1] - 1)
    below, above = int(np.floor(rank)), int(np.ceil(rank))
    low, high = ordered[..., below : below + 1], ordered[..., above : above + 1]
    return low + (rank - below) * (high - low)


def _taper(count: int) -> np.ndarray:
    """Give a Hann window of so many samples, none of them zero."""
    return 0.5 - 0.5 * np.cos(2 * np.pi / (count + 1) * np.arange(1, count + 1))


def level_line(level: np.ndarray, window: int) -> np.ndarray:
    """Draw the windows' level (S, N) out to every sample (S, K); the ends go on at their slope."""
    wave = min(window, level.shape[1] - 1)
    first, last = level[:, :1], level[:, -1:]
    first_slope = (level[:, wave : wave + 1] - first) / wave
    last_slope = (last - level[:, -1 - wave :][:, :1]) / wave
    # The centre of an even window lies between two samples.
    middle = level if window % 2 else (level[:, :-1] + level[:, 1:]) / 2
    before = np.arange(window // 2) - (window - 1) / 2
    after = -before[::-1]
    return np.concatenate([first + before * first_slope, middle, last + after * last_slope], axis=1)


def _without_line(at: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Take the straight line of least squares through values (N,) off them."""
    off = at - at.mean()
    return values - values.mean() - off * (off @ values) / (off @ off)


def window_mean(values: np.ndarray, window: int) -> np.ndarray:
    """Average the last axis over each window that lies wholly inside."""
    running = np.zeros((*values.shape[:-1], values.shape[-1] + 1))
    np.cumsum(values, axis=-1, out=running[..., 1:])
    return (running[..., window:] - running[..., :-window]) / window
