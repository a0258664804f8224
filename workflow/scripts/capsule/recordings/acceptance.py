"""Check of one recording: from the bytes of its file to readings and matrix, or a reason why not.

The samples are placed on an even grid in time, with gaps as NaN. The column of a sample is computed
from the time since the first one. It is not the number of samples before: one lost sample would
shift all later samples. The grid is that of the configured rate: readings of a clock that runs at
another rate, within the tolerance, are interpolated to it.
"""

import hashlib
import io
import shlex
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from capsule.arrays import FloatArray, IntArray, NumberArray
from capsule.detectors.wave import fill_missing, missing_wave, wave_of, window_mean
from capsule.errors import RecordingError
from capsule.kinds import Settings
from capsule.method.preprocessing import preprocess
from capsule.recordings.names import size_mm
from capsule.recordings.recording import (
    WAVE_UNTIL,
    ForeignFileError,
    Recording,
    header_number,
    read_recording,
    too_large,
    wave_until_s,
)
from capsule.recordings.units import adc_ends, on_full_scale, share_between, shares_at_ends
from capsule.seeding import readings_checksum

# Relative to the reading. A smaller variation is rounding error, below any ADC's resolution.
_SMALLEST_VARIATION = 1e-9
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
# One mark of the fingerprint is the pattern of 2^5 = 32 successive rises and falls.
_DOUBLINGS = 5
# Only marks are kept whose hash is divisible by this.
_KEPT_OF = 8


def check_recording(
    name: str, content: bytes | None, max_bytes: int, settings: Settings, path: str = ""
) -> tuple[dict[str, Any], FloatArray, FloatArray]:
    """Check a recording, place its readings on an even grid and make its matrix V.

    Parameters
    ----------
    name : str
        Its name, such as ``3mm/r07``.
    content : bytes or None
        Content of its file; None for a file that is larger than allowed.
    max_bytes : int
        Size of the largest file allowed.
    settings : mapping
        Sections ``recording`` and ``preprocessing`` of the configuration, and the keys of the
        section ``diagonal`` that `capsule.engine.configuration.BENCH` lists.
    path : str
        The file, if it does not lie in raw/ under its name.

    Returns
    -------
    check : dict
        The outcome, as results/checks/ keeps it.
    values : (S, K) array
        The readings, on the configured full scale; (S, L) of NaN for a rejected recording.
    matrix : (S, L) array
        V; NaN for a rejected recording.
    """
    shape, sensors = settings["preprocessing"], settings["recording"]["sensors"]
    check: dict[str, Any] = {"recording": name, "size_mm": size_mm(name), "header": {}}
    check |= {"samples": None, "duration_s": None, "status": "rejected", "reason": ""}
    check |= {"sha256": None, "readings_sha256": None, "marks": []}
    check |= {"at_ends": [], "no_verdict": ""}
    values = matrix = np.full((sensors, shape["length"]), np.nan)
    try:
        if content is None:
            raise too_large(max_bytes)
        check["sha256"] = hashlib.sha256(content).hexdigest()
        recording = read_recording(io.BytesIO(content), sensors, max_bytes)
        check["header"] = dict(recording.header)
        check["samples"] = recording.time_s.size
        check["duration_s"] = float(recording.time_s[-1] - recording.time_s[0])
        values, check["no_verdict"] = readings_of(recording, settings)
        check["reason"] = no_evidence_after(recording)
        # The readings as recorded: on another full scale the ends of the ADC's range are unknown.
        check["at_ends"] = shares_at_ends(recording.values, recording.header)
        check["readings_sha256"] = readings_checksum(values)
        # As recorded too: a copy with another clock is a copy.
        check["marks"] = fingerprint(recording.values).tolist()
        matrix = preprocess(values, **shape)
        check["status"] = "accepted"
    except ForeignFileError as reason:
        check["reason"] = f"{reason}; if another program wrote it: {_import_line(name, path)}"
    except RecordingError as reason:
        check["reason"] = str(reason)
    return check, values, matrix


def _import_line(name: str, path: str) -> str:
    """Return the command that shows how the import would read a file."""
    size = size_mm(name)
    condition = "--unlabelled" if size is None else f"--size {size:g}"
    # In raw/ the name is taken by the file itself.
    other_name = "" if path else f" --name {name.partition('/')[2]}-imported"
    file = shlex.quote(path or f"raw/{name}.csv")
    return f"capsule import {file} {condition}{other_name} --dry-run"


def readings_of(recording: Recording, settings: Settings) -> tuple[FloatArray, str]:
    """Check a recording that is already read, with the workflow's rules.

    Parameters
    ----------
    recording : Recording
        The recording as read.
    settings : mapping
        As in `check_recording`.

    Returns
    -------
    values : (S, K) array
        The readings on an even grid in time and on the configured full scale.
    no_verdict : str
        The reason why no detector can judge it; empty if each sensor shows a wave.

    Raises
    ------
    RecordingError
        The recording cannot be used.
    """
    rules, shape, bench = (settings[key] for key in ("recording", "preprocessing", "diagonal"))
    recording = _while_the_wave_ran(recording, shape["window"])
    accepted = accept(recording, rules=rules, window=shape["window"], length=shape["length"])
    values = on_full_scale(
        accepted, recording.header, bench["full_scale"], bench["pressing_lowers_reading"]
    )
    wave = wave_of(values, rules["rate_hz"], bench)
    return values, missing_wave(wave, bench, rules["wave_false_rate"])


def no_evidence_after(recording: Recording) -> str:
    """Return that a recording is no evidence to its end, and why; empty if it is."""
    until_s = wave_until_s(recording.header)
    if recording.time_s[-1] < until_s:
        return ""
    return f"no wave ran from {until_s:g} s on ({WAVE_UNTIL}), so only what came before is evidence"


def _while_the_wave_ran(recording: Recording, window: int) -> Recording:
    """Return a recording without the samples after its wave stopped."""
    kept = recording.time_s < wave_until_s(recording.header)
    if kept.all():
        return recording
    if np.count_nonzero(kept) < window:
        raise RecordingError(
            f"{no_evidence_after(recording)}: {np.count_nonzero(kept)} samples, fewer than the "
            f"window of {window} (preprocessing.window); record it again"
        )
    return replace(recording, time_s=recording.time_s[kept], values=recording.values[:, kept])


def accept(recording: Recording, *, rules: Settings, window: int, length: int) -> FloatArray:
    """Check a recording and place its samples on an even grid in time.

    Parameters
    ----------
    recording : Recording
        The recording as read.
    rules : mapping
        Section ``recording`` of the configuration.
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
        rate_hz=rules["rate_hz"],
        rate_tolerance=rules["rate_tolerance"],
        stretch=window,
        length=length,
    )
    own = np.full((recording.values.shape[0], int(columns[-1]) + 1), np.nan)
    own[:, columns] = recording.values
    interval_s = float(np.polyfit(columns, recording.time_s - recording.time_s[0], 1)[0])
    _check_header(recording.header, 1 / interval_s, rules["rate_tolerance"])
    values = _at_rate(own, interval_s * rules["rate_hz"])
    count = values.shape[1]
    if count < window:
        raise RecordingError(
            f"{count} samples are fewer than the window of {window} (preprocessing.window)"
        )
    _check_length(count, length)
    _check_missing(values, recording.time_s[0], rules)
    # As recorded: between two readings at the end of a range none is.
    _check_sensors(own, recording.header, rules)
    _check_alike(values, window, rules["max_sensor_correlation"])
    return values


def _at_rate(own: FloatArray, step: float) -> FloatArray:
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


def _check_missing(values: FloatArray, first_s: float, rules: Settings) -> None:
    missing = np.isnan(values).all(axis=0)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], missing.astype(np.int8), [0]])))
    starts, ends = edges[::2], edges[1::2]
    if starts.size == 0:
        return
    longest = int(np.argmax(ends - starts))
    duration = (ends[longest] - starts[longest]) / rules["rate_hz"]
    if duration > rules["max_gap_s"]:
        begin = first_s + starts[longest] / rules["rate_hz"]
        raise RecordingError(
            f"samples are missing for {duration:g} s, from {begin:g} s on; at most "
            f"{rules['max_gap_s']:g} s are allowed (recording.max_gap_s)"
        )
    fraction = float(np.mean(missing))
    if fraction > rules["max_missing_fraction"]:
        raise RecordingError(
            f"{np.count_nonzero(missing)} of {missing.size} samples ({100 * fraction:.0f} %) are "
            f"missing; at most {100 * rules['max_missing_fraction']:g} % are allowed "
            "(recording.max_missing_fraction)"
        )


def _check_header(header: Mapping[str, str], rate_hz: float, tolerance: float) -> None:
    """Raise an error if the header contradicts the samples, or states a place in words."""
    header_number(header, "nodule_at_mm", may_be_negative=True)
    stated = header_number(header, "rate_hz")
    if stated and abs(rate_hz - stated) > tolerance * rate_hz:
        raise RecordingError(
            f"the header says rate_hz: {stated:g}, but the samples come at {rate_hz:.4g} Hz; "
            "correct the one that is wrong"
        )


def _check_sensors(values: FloatArray, header: Mapping[str, str], rules: Settings) -> None:
    rail, constant = rules["max_rail_fraction"], rules["max_constant_fraction"]
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
            if fraction > rail:
                unit = "" if counts else " V"
                raise RecordingError(
                    f"sensor_{sensor} is at {below:g}{unit}, the end of the ADC's range, in "
                    f"{100 * fraction:.0f} % of the samples; at most "
                    f"{100 * rail:g} % are allowed (recording.max_rail_fraction)"
                )
        levels, times = np.unique(known, return_counts=True)
        fraction = times.max() / known.size
        if fraction > constant:
            raise RecordingError(
                f"sensor_{sensor} reads {levels[times.argmax()]:g} in {100 * fraction:.0f} % of "
                f"the samples, so it is stuck or loose; at most {100 * constant:g} % "
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


def fingerprint(values: NumberArray) -> IntArray:
    """Return marks of the readings that do not depend on unit, order of sensors or length.

    A mark encodes which of 32 successive changes of a sensor go up and which go down. A pattern
    and its inverse have the same mark.

    Parameters
    ----------
    values : (S, K) array
        Readings; NaN where a sample is missing.

    Returns
    -------
    (F,) array of uint64
        The distinct marks, ascending.
    """
    marks = [np.zeros(0, dtype=np.uint64)]
    for row in values:
        steps = np.diff(row[~np.isnan(row)])
        rising = (steps[steps != 0] > 0).astype(np.uint64)
        if rising.size < 2**_DOUBLINGS:
            continue
        for power in range(_DOUBLINGS):
            width = 2**power
            rising = (rising[:-width] << np.uint64(width)) | rising[width:]
        turned = rising ^ np.uint64(2 ** (2**_DOUBLINGS) - 1)
        marks.append(np.minimum(rising, turned))
    found = np.concatenate(marks)
    # The multiplication (golden ratio of 2^64) makes the high bits depend on all bits. Whether a
    # mark is kept depends on the mark alone, so all recordings keep the same ones.
    hashed = (found * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(32)
    kept: IntArray = np.unique(found[hashed % np.uint64(_KEPT_OF) == 0])
    return kept


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
    _check_length((time_s[-1] - time_s[0]) / interval_s + 1, length, slack=1.1)
    elapsed = _on_own_clock(time_s - time_s[0], interval_s, min(2.0 * error, 2.0 * rate_tolerance))
    missing = _missing_before(elapsed - np.arange(time_s.size), time_s, interval_s)
    columns: IntArray = np.arange(time_s.size) + missing - missing[0]
    _check_length(columns[-1] + 1, length)
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


def _check_length(columns: float, length: int, slack: float = 1.0) -> None:
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
        slope, offset = np.polyfit(elapsed / elapsed[-1], remainders, 1)
        elapsed = elapsed - phase - offset - slope * elapsed / elapsed[-1]
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
