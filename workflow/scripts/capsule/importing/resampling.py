"""Resample a laboratory's readings to the configured sampling rate.

The low-pass filter is a symmetric finite impulse response, so it moves no peak. The detectors use
the positions of the four sensors' peaks; a recursive filter would delay each frequency differently.

The filter's length is Kaiser's for 60 dB, a factor of 1000: aliases stay below one step of a 10-bit
converter. The filter passes all below a quarter of the new rate, and stops all above half of it. At
10 Hz, it passes eight harmonics of a wave of 3.2 s.

The filter is 1.5 s long at 10 Hz. Within half of that from an end or a gap, the readings are
continued with their own slope.
"""

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import firwin, kaiserord, oaconvolve

from capsule.errors import CapsuleError
from capsule.importing.times import mean_step

STOP_DB = 60.0
# End of the passband and start of the stopband, as fractions of the new rate.
_PASS = 0.25
_STOP = 0.5
# Two samples enclose a gap if they are more than this many intervals of the slower rate apart.
_GAP = 1.5
# A new sample exists if an old one is at most this many intervals of the new rate away ...
_NEAR_NEW = 0.49
# ... or of the old rate, if that distance is larger.
_NEAR_OLD = 0.6
# Degree of the spline between samples: its images decay with the sixth power of frequency ...
DEGREE = 5
# ... so on a grid of this many times the new rate, their aliases are below those of the filter.
_LEAST_FACTOR = 12
# Significant digits that are kept.
_DIGITS = 6
_LEAST_RATIO = 0.5
# Samples of nearly the same rate that are off by less than this share of an interval are taken as
# they are: a filter would smooth them.
_SAME = 1e-3
# Most samples of the fine grid, and of the filter on it: readings of an hour at 10 kHz.
_MOST_FINE = 36_000_000
# Most new samples: a day at 10 Hz. A month between two lines would fill the memory.
_MOST_NEW = 864_000
_TOO_FAST = (
    "the sampling rate is {:.4g} Hz, too much for {:.4g} s; if the time is in another unit, give "
    "--time-unit; otherwise give --time none and --rate"
)


def usual_rate(time_s: np.ndarray) -> float:
    """Return the sampling rate in Hz of times (K,) in s, which may have gaps and jitter.

    Raises
    ------
    CapsuleError
        If time does not run forward, or there are fewer than two samples.
    """
    steps = np.diff(time_s)
    if steps.size == 0:
        raise CapsuleError("there are fewer than two samples; is the table cut off?")
    wrong = np.flatnonzero(steps <= 0)
    if wrong.size:
        at = int(wrong[0])
        what, remedy = "runs backwards", "if another run begins there, give --run-gap-s 5"
        if at and time_s[at + 1] > time_s[at - 1]:
            remedy = "if one time is wrong, correct it, or give --time none and --rate"
        if steps[at] == 0:
            what, remedy = "repeats", "if its clock is too coarse, give --time none and --rate"
        raise CapsuleError(
            f"sample {at + 2}: time {what}, {time_s[at + 1]:g} s follows {time_s[at]:g} s; {remedy}"
        )
    return 1.0 / mean_step(steps)


def resample(
    time_s: np.ndarray, values: np.ndarray, rate_hz: float, start_s: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return readings at another sampling rate.

    Parameters
    ----------
    time_s : (K,) array
        Time of each sample in seconds.
    values : (S, K) array
        Readings; a sample with any NaN counts as missing.
    rate_hz : float
        The new rate.
    start_s : float, optional
        Time of the first new sample; that of the first sample if not given.

    Returns
    -------
    time_s : (M,) array
        Times of the new samples, from 0 on.
    values : (S, M) array
        Readings; NaN if no sample is near. So missing samples stay missing.

    Raises
    ------
    CapsuleError
        If the old rate is too low, or time does not run forward.
    """
    old_hz = usual_rate(time_s)
    if old_hz < _LEAST_RATIO * rate_hz:
        raise CapsuleError(
            f"the sampling rate is {old_hz:.4g} Hz, less than half of recording.rate_hz "
            f"{rate_hz:g}, and import cannot restore what was not sampled; record faster, or "
            "configure another rate"
        )
    known = ~np.isnan(values).any(axis=0)
    at, kept = time_s[known], values[:, known]
    start = float(time_s[0] if start_s is None else start_s)
    count = int(np.floor((time_s[-1] - start) * rate_hz + 1e-6)) + 1
    if count < 2:
        raise CapsuleError(_TOO_FAST.format(old_hz, time_s[-1] - start))
    if count > _MOST_NEW:
        raise CapsuleError(
            f"its times span {time_s[-1] - start:.4g} s, too long for one run; correct them, or "
            "give --run-gap-s if another run begins behind a gap"
        )
    instants = start + np.arange(count) / rate_hz
    new = np.full((values.shape[0], count), np.nan)
    interval = max(1.0 / rate_hz, 1.0 / old_hz)
    reach = max(_NEAR_NEW / rate_hz, _NEAR_OLD / old_hz)
    nearest = np.searchsorted((at[:-1] + at[1:]) / 2, instants)
    is_near = np.abs(instants - at[nearest]) <= reach if at.size else np.zeros(count, dtype=bool)
    breaks = np.flatnonzero(np.diff(at) > _GAP * interval) + 1
    for part in np.split(np.arange(at.size), breaks):
        wanted = np.flatnonzero(is_near & np.isin(nearest, part))
        if wanted.size:
            new[:, wanted] = _within(at[part], kept[:, part], instants[wanted], old_hz, rate_hz)
    # Precise far below the noise, and short to write.
    largest = np.nanmax(np.abs(new), initial=1e-12, where=~np.isnan(new))
    new = np.round(new, _DIGITS - int(np.ceil(np.log10(largest))))
    return np.round(np.arange(count) / rate_hz, 9), new


def _within(
    at: np.ndarray, values: np.ndarray, instants: np.ndarray, old_hz: float, rate_hz: float
) -> np.ndarray:
    """Return readings (S, K) without gaps, filtered, at other times (M,)."""
    if at.size <= DEGREE:
        return np.array([np.interp(instants, at, row) for row in values])
    nearest = np.searchsorted((at[:-1] + at[1:]) / 2, instants)
    off = np.abs(instants - at[nearest]).max() * rate_hz
    if abs(old_hz / rate_hz - 1) < _SAME and off < _SAME:
        return values[:, nearest]
    # The clock may jitter and the rates may have no common multiple, so first interpolate on a fine
    # even grid, whose rate is a multiple of the new rate.
    spline = make_interp_spline(at, values, k=DEGREE, axis=1)
    inside = np.clip(instants, at[0], at[-1])
    if old_hz <= rate_hz:
        return np.asarray(spline(inside))
    fine_hz = max(int(np.ceil(old_hz / rate_hz)), _LEAST_FACTOR) * rate_hz
    if fine_hz * max(at[-1] - at[0], 1.0 / rate_hz) > _MOST_FINE:
        raise CapsuleError(_TOO_FAST.format(old_hz, at[-1] - at[0]))
    taps = low_pass(fine_hz, rate_hz)
    half = taps.size // 2
    before = int(np.floor((instants[0] - at[0]) * fine_hz + 1e-9))
    after = int(np.floor((at[-1] - instants[0]) * fine_hz + 1e-9))
    grid = instants[0] + np.arange(-before, after + 1) / fine_hz
    # Odd reflection at both ends continues the readings with their own slope.
    widths = ((0, 0), (half, half))
    even = spline(np.clip(grid, at[0], at[-1]))
    padded = np.pad(even, widths, mode="reflect", reflect_type="odd")
    smooth = oaconvolve(padded, taps[None], mode="valid", axes=1)
    columns = np.rint((inside - grid[0]) * fine_hz).astype(int)
    return np.asarray(smooth[:, np.clip(columns, 0, smooth.shape[1] - 1)])


def low_pass(fine_hz: float, rate_hz: float) -> np.ndarray:
    """Return the taps of the low-pass filter before decimation.

    Parameters
    ----------
    fine_hz : float
        Sampling rate before.
    rate_hz : float
        Sampling rate after.

    Returns
    -------
    (N,) array
        Taps; their number is odd, and their sum is 1.
    """
    width = (_STOP - _PASS) * rate_hz / (fine_hz / 2)
    number, beta = kaiserord(STOP_DB, width)
    cutoff = (_STOP + _PASS) / 2 * rate_hz
    return np.asarray(firwin(number | 1, cutoff, window=("kaiser", beta), fs=fine_hz))
