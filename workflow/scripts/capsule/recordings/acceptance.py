"""Check one recording: from the bytes of its file to readings and matrix, or a reason why not."""

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
from capsule.recordings.time_base import at_rate, check_length, columns_by_time, longest_gap
from capsule.recordings.units import adc_ends, on_full_scale, share_between, shares_at_ends
from capsule.seeding import readings_checksum

# Relative to the reading. A smaller variation is rounding error, below any ADC's resolution.
_SMALLEST_VARIATION = 1e-9
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
    values = at_rate(own, interval_s * rules["rate_hz"])
    count = values.shape[1]
    if count < window:
        raise RecordingError(
            f"{count} samples are fewer than the window of {window} (preprocessing.window)"
        )
    check_length(count, length)
    _check_missing(values, recording.time_s[0], rules)
    # As recorded: between two readings at the end of a range none is.
    _check_sensors(own, recording.header, rules)
    _check_alike(values, window, rules["max_sensor_correlation"])
    return values


def _check_missing(values: FloatArray, first_s: float, rules: Settings) -> None:
    missing, (start, longest) = np.isnan(values).all(axis=0), longest_gap(values)
    duration = longest / rules["rate_hz"]
    if duration > rules["max_gap_s"]:
        begin = first_s + start / rules["rate_hz"]
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
