"""Acceptance of a recording: checks of its samples, and an even time grid with gaps as NaN."""

from collections.abc import Mapping

import numpy as np

from capsule.arrays import FloatArray
from capsule.errors import RecordingError
from capsule.recording import Recording
from capsule.time_axis import columns_by_time
from capsule.units import adc_ends, share_between
from capsule.wave import fill_missing, window_mean

# Relative to the reading. A smaller variation is rounding error, below any ADC's resolution.
_SMALLEST_VARIATION = 1e-9


def accept(
    recording: Recording,
    *,
    rate_hz: float,
    rate_tolerance: float,
    max_gap_s: float,
    max_missing_fraction: float,
    max_rail_fraction: float,
    max_constant_fraction: float,
    max_sensor_correlation: float,
    window: int,
    length: int,
) -> FloatArray:
    """Check a recording and place its samples on an even grid in time.

    Parameters
    ----------
    recording : Recording
        The recording as read.
    rate_hz : float
        Configured sampling rate in Hz.
    rate_tolerance : float
        Allowed relative deviation of the recording's rate, and of the rate within it.
    max_gap_s : float
        Longest run of missing samples, in seconds.
    max_missing_fraction : float
        Largest fraction of samples that may be missing.
    max_rail_fraction : float
        Largest fraction of samples that a sensor may spend at one end of the ADC's range.
    max_constant_fraction : float
        Largest fraction of samples in which a sensor may read the same.
    max_sensor_correlation : float
        Largest correlation of two sensors' readings. The mean over a window around each reading is
        subtracted first.
    window : int
        Window W of the envelope in samples; a shorter recording is rejected.
    length : int
        Number of columns L of the matrix; a longer recording is rejected, never cut.

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
        raise RecordingError(
            f"a recording needs at least 2 samples; this one has {recording.time_s.size}"
        )
    columns = columns_by_time(
        recording.time_s,
        rate_hz=rate_hz,
        rate_tolerance=rate_tolerance,
        stretch=window,
        length=length,
    )
    count = int(columns[-1]) + 1
    if count < window:
        raise RecordingError(
            f"{count} samples are fewer than the window of {window} (preprocessing.window)"
        )
    values = np.full((recording.values.shape[0], count), np.nan)
    values[:, columns] = recording.values
    _check_gaps(values, recording.time_s, rate_hz, max_gap_s)
    _check_missing(values, max_missing_fraction)
    _check_sensors(values, recording.header, max_rail_fraction, max_constant_fraction)
    _check_alike(values, window, max_sensor_correlation)
    return values


def _check_gaps(values: FloatArray, time_s: FloatArray, rate_hz: float, max_gap_s: float) -> None:
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
            f"samples are missing for {duration:g} s, from {begin:g} s on; at most "
            f"{max_gap_s:g} s are allowed (recording.max_gap_s)"
        )


def _check_missing(values: FloatArray, max_missing_fraction: float) -> None:
    missing = np.isnan(values).all(axis=0)
    fraction = float(np.mean(missing))
    if fraction > max_missing_fraction:
        raise RecordingError(
            f"{np.count_nonzero(missing)} of {missing.size} samples ({100 * fraction:.0f} %) are "
            f"missing; at most {100 * max_missing_fraction:g} % are allowed "
            "(recording.max_missing_fraction)"
        )


def _check_sensors(
    values: FloatArray,
    header: Mapping[str, str],
    max_rail_fraction: float,
    max_constant_fraction: float,
) -> None:
    counts, ends = adc_ends(header, values)
    for sensor, readings in enumerate(values, start=1):
        known = readings[~np.isnan(readings)]
        low, high = known.min(), known.max()
        if high - low <= max(_SMALLEST_VARIATION * max(abs(low), abs(high)), 1e-12):
            raise RecordingError(
                f"sensor_{sensor} reads {low:g} in all samples; check its connection, and check "
                "it for a short circuit"
            )
        if counts and "adc_bits" in header and (low < 0 or high > ends[-1][1]):
            outside = low if low < 0 else high
            raise RecordingError(
                f"sensor_{sensor} reads {outside:g}, outside the ADC's range "
                f"0..{ends[-1][1]:g} (adc_bits in the header)"
            )
        for below, above in ends:
            fraction = share_between(known, below, above)
            if fraction > max_rail_fraction:
                unit = "" if counts else " V"
                raise RecordingError(
                    f"sensor_{sensor} is at {below:g}{unit}, the end of the ADC's range, in "
                    f"{100 * fraction:.0f} % of the samples; at most "
                    f"{100 * max_rail_fraction:g} % are allowed (recording.max_rail_fraction)"
                )
        levels, times = np.unique(known, return_counts=True)
        constant = times.max() / known.size
        if constant > max_constant_fraction:
            raise RecordingError(
                f"sensor_{sensor} reads {levels[times.argmax()]:g} in {100 * constant:.0f} % of "
                f"the samples, so it is stuck or loose; at most {100 * max_constant_fraction:g} % "
                "are allowed (recording.max_constant_fraction)"
            )


def _check_alike(values: FloatArray, window: int, max_sensor_correlation: float) -> None:
    """Raise an error if two channels show one sensor.

    A wave reaches two different sensors one after the other, so their readings differ.
    """
    if max_sensor_correlation >= 1:
        return
    filled = fill_missing(values)
    level = window_mean(filled, window)
    before = (window - 1) // 2
    # The level is subtracted, so that a drift common to all sensors adds no correlation.
    moving = filled[:, before : before + level.shape[1]] - level
    length = np.sqrt((moving**2).sum(axis=1))
    moving /= np.where(length > 0, length, 1.0)[:, np.newaxis]
    alike = np.triu(moving @ moving.T, 1)
    first, second = np.unravel_index(alike.argmax(), alike.shape)
    if alike[first, second] > max_sensor_correlation:
        raise RecordingError(
            f"sensor_{first + 1} and sensor_{second + 1} give nearly the same readings "
            f"(correlation {alike[first, second]:.3f}); check the channels for a short circuit "
            "(recording.max_sensor_correlation)"
        )
