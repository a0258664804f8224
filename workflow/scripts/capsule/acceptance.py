"""What makes a recording usable, and where its missing samples are."""

import re
from collections.abc import Mapping

import numpy as np

from capsule.errors import RecordingError
from capsule.recording import Recording
from capsule.time_axis import columns_by_time

# Where no header says how many bits the ADC has: those of usual ones.
_USUAL_BITS = (8, 10, 12, 14, 16)
# Less variation than this, relative to the reading, is below any ADC's resolution: rounding.
_SMALLEST_VARIATION = 1e-9


def accept(
    recording: Recording,
    *,
    rate_hz: float,
    rate_tolerance: float,
    max_gap_s: float,
    max_missing_fraction: float,
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
        Allowed relative deviation of the recording's rate, and of the rate within it.
    max_gap_s : float
        Longest run of missing samples, in seconds.
    max_missing_fraction : float
        Largest fraction of samples that may be missing.
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
    _check_sensors(values, recording.header, max_rail_fraction)
    return values


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


def _check_missing(values: np.ndarray, max_missing_fraction: float) -> None:
    missing = np.isnan(values).all(axis=0)
    fraction = float(np.mean(missing))
    if fraction > max_missing_fraction:
        raise RecordingError(
            f"{np.count_nonzero(missing)} of {missing.size} samples are missing, "
            f"{100 * fraction:.0f} %; allowed are {100 * max_missing_fraction:g} % "
            "(recording.max_missing_fraction)"
        )


def _check_sensors(values: np.ndarray, header: Mapping[str, str], max_rail_fraction: float) -> None:
    counts, ends = _adc_ends(header, values)
    for sensor, readings in enumerate(values, start=1):
        known = readings[~np.isnan(readings)]
        low, high = known.min(), known.max()
        if high - low <= max(_SMALLEST_VARIATION * max(abs(low), abs(high)), 1e-12):
            raise RecordingError(
                f"sensor_{sensor} reads {low:g} throughout: is it connected, and not shorted?"
            )
        if counts and "adc_bits" in header and (low < 0 or high > ends[-1][1]):
            outside = low if low < 0 else high
            raise RecordingError(
                f"sensor_{sensor} reads {outside:g}, outside the ADC's range "
                f"0..{ends[-1][1]:g} (adc_bits in the header)"
            )
        for below, above in ends:
            fraction = float(np.mean((known >= below) & (known <= above)))
            if fraction > max_rail_fraction:
                unit = "" if counts else " V"
                raise RecordingError(
                    f"sensor_{sensor} is at {below:g}{unit}, the end of the ADC's range, in "
                    f"{100 * fraction:.0f} % of the samples (recording.max_rail_fraction)"
                )


def _adc_ends(
    header: Mapping[str, str], values: np.ndarray
) -> tuple[bool, list[tuple[float, float]]]:
    """Tell whether readings are counts, and which bands of them are an end of the ADC's range.

    The highest band stands last.
    """
    bits, vref_v = _header_number(header, "adc_bits"), _header_number(header, "vref_v")
    if bits is not None and not (bits.is_integer() and 1 <= bits <= 32):
        raise RecordingError(
            f"the header says adc_bits: {header['adc_bits']!r}; allowed is a whole number, 1 to 32"
        )
    whole = bool(np.all((values % 1.0 == 0) | np.isnan(values)))
    # Averaged counts are no whole numbers; volts never exceed the reference.
    counts = whole or (bool(np.nanmax(values) > 2 * vref_v) if vref_v else bits is not None)
    if counts:
        # A reading of 2^n - 1 for most of a run is no coincidence, even where no header tells n.
        tops = [float(2 ** int(n) - 1) for n in ([bits] if bits else _USUAL_BITS)]
        return True, [(0.0, 0.0), *((top, top) for top in tops)]
    step = (vref_v or 0.0) / 2 ** (bits or 10)
    # Converted by 2^n or by 2^n - 1, the highest count is within one step of the reference.
    top = [(vref_v - 1.5 * step, vref_v + step)] if vref_v else []
    return False, [(0.0, step / 2), *top]


def _header_number(header: Mapping[str, str], key: str) -> float | None:
    text = header.get(key, "")
    if not text:
        return None
    if not re.fullmatch(r"[0-9]{1,6}(\.[0-9]{1,6})?", text):
        raise RecordingError(f"the header says {key}: {text[:60]!r}, which is no number")
    return float(text)
