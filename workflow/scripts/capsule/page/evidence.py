"""What the page holds of each recording, small enough for a thousand of them.

A signal becomes whole numbers of one or two bytes with a scale, in base64; the page multiplies
them back. Readings that are counts of an ADC come through exactly.
"""

import base64
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from capsule.page import recordings
from capsule.page.provenance import fit_words
from capsule.particles import Particle, render
from capsule.stages import PreprocessedRun, preprocess_run

# A page of this many readings stays below 25 MB; of larger archives every n-th reading is shown.
MAX_READINGS = 5_000_000
# Envelopes and matrices are smooth over the window of the envelope; more points show no more.
SMOOTH_POINTS = 250


@dataclass(frozen=True)
class Stored:
    """What the stages have stored of an accepted recording.

    Attributes
    ----------
    values : (S, K) array
        The readings on an even grid in time; NaN where a sample is missing.
    header : mapping of str to str
        The lines above the readings.
    fit : (mapping, Particle) or None
        The numbers of the fit, and Theta*; None without one.
    """

    values: np.ndarray
    header: Mapping[str, str]
    fit: tuple[Mapping, Particle] | None = None


def pack(values: np.ndarray, bits: int = 16) -> dict:
    """Return an array as whole numbers of 8 or 16 bits in base64.

    Parameters
    ----------
    values : (S, N) array
        NaN where a sample is missing.
    bits : {8, 16}
        Bits a value.

    Returns
    -------
    dict
        ``bits``, ``rows``, ``low``, ``scale`` and ``data``: value = low + scale * number, row after
        row, little-endian; the largest number stands for a missing sample. Whole numbers that
        fit are kept exactly.
    """
    missing = 2**bits - 1
    known = values[~np.isnan(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    whole = bool(np.all(known == np.rint(known))) and high - low < missing
    scale = 1.0 if whole or high == low else (high - low) / (missing - 1)
    numbers = np.where(np.isnan(values), missing, np.rint((values - low) / scale))
    data = numbers.astype(f"<u{bits // 8}").tobytes()
    return {
        "bits": bits,
        "rows": values.shape[0],
        "low": low,
        "scale": scale,
        "data": base64.b64encode(data).decode("ascii"),
    }


def reading_step(total_readings: int) -> int:
    """Return n, such that every n-th reading of an archive fits the page."""
    return max(1, -(-total_readings // MAX_READINGS))


def fitted_matrix(
    particle: Particle, first_peak: float, lag: int, samples: int, length: int
) -> np.ndarray:
    """Return the fitted particle over the recording, shifted to its best lag (eq. RMSE).

    Parameters
    ----------
    particle : Particle
        Theta*.
    first_peak : float
        u.
    lag : int
        tau in 1..2L; at L + 1 both matrices lie on each other.
    samples, length : int
        K and L.

    Returns
    -------
    (S, K) array
    """
    sensors = particle.amplitude.size
    frame = np.zeros((sensors, 3 * length))
    frame[:, lag - 1 : lag - 1 + length] = render(particle, first_peak, length)
    return frame[:, length : length + samples]


def peaks(envelope: np.ndarray, time_s: np.ndarray, threshold: float) -> list[list[float]]:
    """Return the highest value of each sensor's envelope, its time, and the time above threshold.

    Parameters
    ----------
    envelope : (S, K) array
        Standard deviations.
    time_s : (K,) array
        Seconds, evenly spaced.
    threshold : float
        c, in standard deviations.

    Returns
    -------
    list of S lists of 3 floats
        Standard deviations, seconds, seconds; each to three decimals.
    """
    interval = float(time_s[1] - time_s[0])
    rows = []
    for row in envelope:
        highest = int(np.nanargmax(row))
        above_s = float(np.sum(row > threshold)) * interval
        peak = (float(row[highest]), float(time_s[highest]), above_s)
        rows.append([round(number, 3) for number in peak])
    return rows


def recording_evidence(
    run: PreprocessedRun,
    threshold: float,
    step: int,
    fitted: np.ndarray | None,
    verdicts: Sequence[Mapping],
    facts: Mapping[str, str],
) -> dict:
    """Return what the page shows of one recording.

    Parameters
    ----------
    run : PreprocessedRun
        The recording on its way from readings to matrix.
    threshold : float
        c, in standard deviations.
    step : int
        Every n-th reading is kept, of n = step.
    fitted : (S, K) array or None
        From `fitted_matrix`; None without a fit.
    verdicts : sequence of mapping
        ``label``, ``predicted_mm``, ``details`` and ``distances`` of every detector's verdict.
    facts : mapping of str to str
        Names and texts that are listed beside the signals.

    Returns
    -------
    dict
        Ready for `to_json`.
    """
    samples = run.time_s.size
    smooth = max(1, -(-samples // SMOOTH_POINTS))
    interval = float(run.time_s[1] - run.time_s[0])
    return {
        "recording": run.recording,
        "title": run.title,
        "interval_s": interval,
        "threshold": threshold,
        "readings": {"every": step, **pack(run.values[:, ::step])},
        "envelope": {"every": smooth, **pack(run.envelope[:, ::smooth])},
        "matrix": {"every": smooth, **pack(run.matrix[:, ::smooth], 8)},
        "fitted": None if fitted is None else {"every": smooth, **pack(fitted[:, ::smooth], 8)},
        "peaks": peaks(run.envelope, run.time_s, threshold),
        "verdicts": [
            {key: verdict[key] for key in ("label", "predicted_mm", "details", "distances")}
            for verdict in verdicts
        ],
        "facts": dict(facts),
    }


def archive_evidence(
    rows: Iterable[Mapping],
    verdicts: Mapping[str, Sequence[Mapping]],
    load: Callable[[str], Stored],
    settings: Mapping,
) -> Iterator[tuple[str, str]]:
    """Yield what the page shows of each recording, one at a time.

    Parameters
    ----------
    rows : iterable of mapping
        From `capsule.page.recordings.recording_rows`; rejected recordings are left out.
    verdicts : mapping of str to sequence of mapping
        From `capsule.page.recordings.verdicts_by_recording`.
    load : callable
        ``load(name)`` returns what is stored of a recording.
    settings : mapping
        The configuration.

    Yields
    ------
    name : str
        The recording.
    content : str
        From `recording_evidence`, as JSON.
    """
    shape = settings["preprocessing"]
    stages = {key: shape[key] for key in ("window", "threshold")}
    stages["rate_hz"] = settings["recording"]["rate_hz"]
    accepted = [row for row in rows if row["accepted"]]
    total = sum(row["samples"] for row in accepted) * settings["recording"]["sensors"]
    step = reading_step(total)
    for row in accepted:
        name = row["recording"]
        stored = load(name)
        samples = stored.values.shape[1]
        run = preprocess_run(name, recordings.title(row), stored.values, **stages)
        fitted, facts = None, {"File": f"raw/{name}.csv", "SHA-256": row["sha256"]}
        if stored.fit:
            fit, particle = stored.fit
            fitted = fitted_matrix(
                particle, fit["first_peak"], fit["lag"], samples, shape["length"]
            )
            facts["Fit"] = fit_words(fit)
        facts |= {f"# {key}": text for key, text in stored.header.items()}
        content = recording_evidence(
            run, shape["threshold"], step, fitted, verdicts.get(name, []), facts
        )
        yield name, to_json(content)


def to_json(content: object) -> str:
    """Return JSON that can stand inside a script element: no tag can begin in it."""
    text = json.dumps(content, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text
