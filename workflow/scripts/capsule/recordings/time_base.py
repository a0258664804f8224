"""Place the samples of a recording on an even grid in time, with gaps as NaN.

The column of a sample is computed from the time since the first one. It is not the number of
samples before: one lost sample would shift all later samples. The grid is that of the configured
rate: readings of a clock that runs at another rate, within the tolerance, are interpolated to it.
"""

import numpy as np
from numpy.polynomial import Polynomial

from capsule.arrays import FloatArray, IntArray
from capsule.errors import RecordingError

# Largest relative deviation of a single interval from the usual step; larger steps span a gap.
_NEAR_STEP = 0.4
# Frequencies tried in the width of a periodogram's peak.
_TRIED_PER_PEAK = 4
# Straight lines fitted to the remainders one after the other.
_LINES = 3
# Half the width, in samples, of the running median that removes jitter from the columns.
_HALF_MEDIAN = 4
# In intervals. A smaller surplus of time is jitter, not a missing sample.
_HALF_MISSING = 0.75
# In intervals. Readings whose clock runs away by less until the end stay as they are.
_SAME_RATE = 0.5
# In intervals. If the samples are ahead of the time by more than this, there are too many.
_TOO_MANY = 1.0


def columns_by_time(
    time_s: FloatArray, *, rate_hz: float, rate_tolerance: float, stretch: int, length: int
) -> IntArray:
    """Return the column of each sample.

    Parameters
    ----------
    time_s : (K,) array
        Time of each sample in seconds, two samples at least.
    rate_hz : float
        Configured sampling rate in Hz.
    rate_tolerance : float
        Allowed relative deviation of the recording's rate from the configured one, and of the
        rate of any stretch from the recording's.
    stretch : int
        Number of samples over which the rate must hold.
    length : int
        Number of columns of the matrix.

    Returns
    -------
    (K,) array of int
        Columns, counted from 0; each is larger than the one before.

    Raises
    ------
    RecordingError
        Time does not run forward, the rate is wrong or changes, there are too many samples for
        the time, or more columns than `length`.
    """
    steps = np.diff(time_s)
    _check_forward(time_s, steps)
    interval_s, error = _usual_step(steps, float(np.median(steps)))
    # The checks that take long follow the check of the length, because a wild time stamp could
    # make them run without limit.
    if time_s.size <= length:
        _check_stretches(time_s, interval_s, rate_tolerance, min(stretch, steps.size))
    _check_rate(interval_s, rate_hz, rate_tolerance)
    check_length((time_s[-1] - time_s[0]) / interval_s + 1, length, slack=1.1)
    elapsed = _on_own_clock(time_s - time_s[0], interval_s, min(2.0 * error, 2.0 * rate_tolerance))
    missing = _missing_before(elapsed - np.arange(time_s.size), time_s, interval_s)
    columns: IntArray = np.arange(time_s.size) + missing - missing[0]
    check_length(columns[-1] + 1, length)
    return columns


def _check_forward(time_s: FloatArray, steps: FloatArray) -> None:
    wrong = np.flatnonzero(steps <= 0)
    if wrong.size:
        earlier, later = time_s[wrong[0]], time_s[wrong[0] + 1]
        what = "repeats" if earlier == later else "runs backwards"
        raise RecordingError(f"time {what}: {later:g} s follows {earlier:g} s; correct time_s")


def _usual_step(steps: FloatArray, expected: float) -> tuple[float, float]:
    """Return the mean of the steps without a gap, and three times its relative standard error.

    Steps without a gap are near the expected step. If most are not, they are near the median.
    """
    near = steps[np.abs(steps - expected) <= _NEAR_STEP * expected]
    if 2 * near.size < steps.size:
        median = float(np.median(steps))
        near = steps[np.abs(steps - median) <= _NEAR_STEP * median]
        if not near.size:  # Two steps differ so much that their median is near neither.
            return median, 1.0
    mean = float(np.mean(near))
    return mean, 3.0 * float(np.std(near / mean)) / float(np.sqrt(near.size))


def _check_rate(interval_s: float, rate_hz: float, rate_tolerance: float) -> None:
    if abs(1.0 / interval_s - rate_hz) > rate_tolerance * rate_hz:
        scale = next((s for s in (1e3, 1e6, 1e9) if 0.5 < rate_hz * interval_s / s < 2), None)
        hint = f"; is time_s in 1/{scale:.0f} of a second?" if scale else ""
        raise RecordingError(
            f"the sampling rate is {1.0 / interval_s:.4g} Hz, but recording.rate_hz is "
            f"{rate_hz:g}{hint}"
        )


def check_length(columns: float, length: int, slack: float = 1.0) -> None:
    """Raise an error if there are more columns than the matrix has."""
    if columns > length * slack:
        raise RecordingError(
            f"{np.rint(columns):.15g} samples are more than the {length} columns of the matrix; "
            "raise preprocessing.length"
        )


def _check_stretches(
    time_s: FloatArray, interval_s: float, rate_tolerance: float, stretch: int
) -> None:
    """Raise an error if the rate changes by more than the tolerance plus the jitter."""
    steps = np.diff(time_s)
    starts = [*range(0, steps.size - stretch, stretch), steps.size - stretch]
    usual = np.array([_usual_step(steps[each : each + stretch], interval_s) for each in starts])
    interval_s = float(np.sort(usual[:, 0])[usual.shape[0] // 2])
    beyond = np.abs(interval_s / usual[:, 0] - 1.0) - rate_tolerance - usual[:, 1]
    worst = int(np.argmax(beyond))
    if beyond[worst] > 0:
        raise RecordingError(
            f"the sampling rate changes: {1.0 / usual[worst, 0]:.4g} Hz in the {stretch} samples "
            f"from {time_s[starts[worst]]:g} s on, {1.0 / interval_s:.4g} Hz in most others "
            "(recording.rate_tolerance); record it again at one rate, or cut the file there"
        )


def _on_own_clock(elapsed_s: FloatArray, interval_s: float, error: float) -> FloatArray:
    """Return time in the recording's own intervals, so that a clock 1 % off opens no gaps.

    The interval is at the peak of the periodogram of the time stamps, which neither gaps nor jitter
    move. The search starts from the mean step. Then lines fitted to the remainders correct the
    error of trying single frequencies.
    """
    rough = elapsed_s / interval_s
    tried = int(np.ceil(error * rough[-1] * _TRIED_PER_PEAK))
    factors = 1.0 + np.arange(-tried, tried + 1) / (rough[-1] * _TRIED_PER_PEAK)
    peaks = [abs(np.exp(2j * np.pi * factor * rough).sum()) for factor in factors]
    elapsed: FloatArray = rough * factors[int(np.argmax(peaks))]
    for _ in range(_LINES):
        phase = np.angle(np.exp(2j * np.pi * elapsed).sum()) / (2.0 * np.pi)
        remainders = (elapsed - phase + 0.5) % 1.0 - 0.5
        elapsed = elapsed - phase - Polynomial.fit(elapsed, remainders, 1)(elapsed)
    return elapsed


def _missing_before(surplus: FloatArray, time_s: FloatArray, interval_s: float) -> IntArray:
    """Return how many samples are missing before each sample, (K,), never decreasing.

    `surplus` (K,) is the elapsed time in intervals, minus the number of samples before. It grows by
    1 at a missing sample; jitter moves it up and down.
    """
    smooth = _running_median(surplus)
    missing = np.empty(surplus.size, dtype=np.int64)
    current = round(float(smooth[0]))
    for index, value in enumerate(smooth.tolist()):
        if value - current > _HALF_MISSING:
            current = round(value)
        elif value - current < -_TOO_MANY:
            room = round((time_s[index] - time_s[0]) / interval_s) + 1
            raise RecordingError(
                f"too many samples for their time: {index + 1} samples up to "
                f"{time_s[index]:g} s, but {1.0 / interval_s:.4g} Hz give {room}; "
                "record it again, or correct time_s"
            )
        missing[index] = current
    return missing


def _running_median(values: FloatArray) -> FloatArray:
    """Return the median of each value and its neighbours; rising values stay as they are.

    Near both ends the windows become smaller and stay centred, so that no gap there is lost.
    """
    smooth = values.copy()
    width = 2 * _HALF_MEDIAN + 1
    if values.size >= width:
        windows = np.lib.stride_tricks.sliding_window_view(values, width)
        smooth[_HALF_MEDIAN:-_HALF_MEDIAN] = np.median(windows, axis=1)
    for index in range(1, min(_HALF_MEDIAN, values.size // 2)):
        reach = 2 * index + 1
        smooth[index] = np.median(values[:reach])
        smooth[-1 - index] = np.median(values[-reach:])
    return smooth


def at_rate(own: FloatArray, step: float) -> FloatArray:
    """Return readings at the configured rate, from readings (S, K) on the recording's own grid.

    Parameters
    ----------
    own : (S, K) array
        The readings; NaN where a sample is missing.
    step : float
        Their interval, in intervals of the configured rate.
    """
    last = own.shape[1] - 1
    if abs(last * (step - 1)) < _SAME_RATE:
        return own
    at = np.arange(int(last * step + 1e-9) + 1) / step
    before = np.minimum(at.astype(int), last - 1)
    part = np.minimum(at - before, 1.0)
    first, second = own[:, before], own[:, before + 1]
    between: FloatArray = first + part * (second - first)
    # Beside a gap the nearer reading stands in, so that no gap grows.
    return np.where(np.isnan(between), np.where(part < 0.5, first, second), between)


def longest_gap(values: FloatArray) -> tuple[int, int]:
    """Return first sample and length of the longest gap in readings (S, K); length 0 without one.

    In a gap, the samples of all sensors are missing (NaN).
    """
    missing = np.isnan(values).all(axis=0)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], missing.astype(np.int8), [0]])))
    starts, lengths = edges[::2], edges[1::2] - edges[::2]
    if not starts.size:
        return 0, 0
    longest = int(np.argmax(lengths))
    return int(starts[longest]), int(lengths[longest])
