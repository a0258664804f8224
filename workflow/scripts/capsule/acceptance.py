"""What makes a recording usable, and where its missing samples are."""

import numpy as np

from capsule.errors import RecordingError
from capsule.recording import Recording


def accept(
    recording: Recording,
    *,
    rate_hz: float,
    rate_tolerance: float,
    max_gap_s: float,
    max_rail_fraction: float,
    window: int,
    length: int,
) -> np.ndarray:
    """Check a recording and lay its samples on an even grid in time.

    Parameters
    ----------
    recording : Recording
        The recording as read.
    rate_hz : float
        Configured sampling rate in Hz.
    rate_tolerance : float
        Allowed relative deviation of the median rate.
    max_gap_s : float
        Longest run of missing samples, in seconds.
    max_rail_fraction : float
        Largest fraction of samples that a sensor may spend at one end of the ADC's range.
    window : int
        Window W of the envelope in samples; a shorter recording is refused.
    length : int
        Number of columns L of the matrix; a longer recording is refused, never cut.

    Returns
    -------
    (S, K) array
        The readings, NaN where a sample is missing.

    Raises
    ------
    RecordingError
        The recording cannot be used; the text says why.
    """
    if recording.time_s.size < 2:
        raise RecordingError(f"{recording.time_s.size} sample is too few")
    places = _places(recording.time_s, rate_hz, rate_tolerance)
    count = int(places[-1]) + 1
    # Length before filling: a wild time stamp must not ask for memory without bound.
    if count > length:
        raise RecordingError(
            f"{count} samples are more than the {length} columns of the matrix; "
            "raise preprocessing.length"
        )
    if count < window:
        raise RecordingError(
            f"{count} samples are fewer than the window of {window} (preprocessing.window)"
        )
    values = np.full((recording.values.shape[0], count), np.nan)
    values[:, places] = recording.values
    _check_gaps(values, recording.time_s, rate_hz, max_gap_s)
    _check_sensors(values, recording.header, max_rail_fraction)
    return values


def _places(time_s: np.ndarray, rate_hz: float, rate_tolerance: float) -> np.ndarray:
    """Give each sample its column, by the time that passed since the one before."""
    steps = np.diff(time_s)
    wrong = np.flatnonzero(steps <= 0)
    if wrong.size:
        earlier, later = time_s[wrong[0]], time_s[wrong[0] + 1]
        what = "repeats" if earlier == later else "runs backwards"
        raise RecordingError(f"time {what}: {later:g} s follows {earlier:g} s")
    interval = float(np.median(steps))
    if abs(1.0 / interval - rate_hz) > rate_tolerance * rate_hz:
        raise RecordingError(
            f"the samples come at {1.0 / interval:.4g} Hz, configured is {rate_hz:g} Hz "
            "(recording.rate_hz)"
        )
    # The recording's own interval: a clock that is 1 % off must not open gaps.
    advance = np.maximum(np.rint(steps / interval), 1.0)
    return np.concatenate([[0], np.cumsum(advance)]).astype(np.int64)


def _check_gaps(values: np.ndarray, time_s: np.ndarray, rate_hz: float, max_gap_s: float) -> None:
    missing = np.isnan(values).all(axis=0)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], missing.astype(np.int8), [0]])))
    starts, ends = edges[::2], edges[1::2]
    if starts.size == 0:
        return
    longest = int(np.argmax(ends - starts))
    duration = (ends[longest] - starts[longest]) / rate_hz
    if duration > max_gap_s:
        begin = time_s[0] + starts[longest] / rate_hz
        raise RecordingError(
            f"{duration:g} s of samples are missing from {begin:g} s on; allowed are "
            f"{max_gap_s:g} s (recording.max_gap_s)"
        )


def _check_sensors(values: np.ndarray, header: object, max_rail_fraction: float) -> None:
    for sensor, readings in enumerate(values, start=1):
        known = readings[~np.isnan(readings)]
        low, high = known.min(), known.max()
        if low == high:
            raise RecordingError(
                f"sensor_{sensor} reads {low:g} throughout: is it connected, and not shorted?"
            )
        rails = _rails(header)
        if rails is None:
            continue
        if low < rails[0] or high > rails[1]:
            outside = low if low < rails[0] else high
            raise RecordingError(
                f"sensor_{sensor} reads {outside:g}, outside the ADC's range "
                f"{rails[0]:g}..{rails[1]:g} (adc_bits in the header)"
            )
        for rail in rails:
            fraction = float(np.mean(known == rail))
            if fraction > max_rail_fraction:
                raise RecordingError(
                    f"sensor_{sensor} is at {rail:g}, the end of the ADC's range, in "
                    f"{100 * fraction:.0f} % of the samples (recording.max_rail_fraction)"
                )


def _rails(header: object) -> tuple[float, float] | None:
    bits = header.get("adc_bits", "") if hasattr(header, "get") else ""
    return (0.0, float(2 ** int(bits) - 1)) if bits.isdecimal() and int(bits) <= 32 else None
