"""Collect what the page shows of each recording, small enough for a thousand recordings.

Signals are packed (`capsule.page.packing`). The page draws particles from their parameters.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from capsule.arrays import FloatArray
from capsule.converter import reading_unit
from capsule.detectors.along_gut import along_gut
from capsule.detectors.stretches import Stretches
from capsule.kinds import Cells, Row, Settings
from capsule.page import judged_by, recordings
from capsule.page.nearest_templates import NearestTemplate, nearest_templates
from capsule.page.packing import pack
from capsule.page.provenance import fit_words
from capsule.particles import Particle
from capsule.preprocessing import extend
from capsule.sliding import SlidingComparison
from capsule.stages import PreprocessedRun, preprocess_run

VERDICT_KEYS = (
    *("detector", "scheme", "predicted_mm", "details", "distances"),
    *("score", "threshold", "location_mm"),
)
# Envelopes and matrices are smooth over the window of the envelope, so more points add no detail.
SMOOTH_POINTS = 250


@dataclass(frozen=True)
class Stored:
    """The stored results of an accepted recording.

    Attributes
    ----------
    values : (S, K) array
        The readings on an even grid in time; NaN where a sample is missing.
    header : mapping of str to str
        The lines above the readings.
    fit : (mapping, Particle) or None
        The numbers of the fit, and Theta*; None without a fit.
    templates : mapping of str to mapping of float to Particle
        For each scheme that judged the recording: the averaged particles of its fold, by size in
        mm.
    stretches : Stretches or None
        What the taught score loses without each stretch; None if it was not computed.
    at_ends : sequence of S floats
        For each sensor, the largest share of its samples at one end of the ADC's range.
    """

    values: FloatArray
    header: Mapping[str, str]
    fit: tuple[Row, Particle] | None = None
    templates: Mapping[str, Mapping[float, Particle]] = field(default_factory=dict)
    stretches: Stretches | None = None
    at_ends: Sequence[float] = ()


def peaks(envelope: FloatArray, time_s: FloatArray, threshold: float) -> list[list[float]]:
    """Return each sensor's highest envelope value, its time, and the time above the threshold.

    Parameters
    ----------
    envelope : (S, K) array
        The envelopes, in standard deviations.
    time_s : (K,) array
        Seconds, evenly spaced.
    threshold : float
        c, in standard deviations.

    Returns
    -------
    list of S lists of 3 floats
        Highest value in standard deviations, its time in s, and the time above the threshold in s;
        each to three decimals.
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
    judged: Row,
    verdicts: Sequence[Row],
    facts: Mapping[str, str],
) -> Cells:
    """Return what the page shows of one recording.

    Parameters
    ----------
    run : PreprocessedRun
        The recording on its way from readings to matrix.
    threshold : float
        c, in standard deviations.
    judged : mapping
        From `what_was_judged`.
    verdicts : sequence of mapping
        Each detector's verdict, with `VERDICT_KEYS`.
    facts : mapping of str to str
        Names and texts to list beside the signals.

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
        "readings": pack(run.values),
        "envelope": {"every": smooth, **pack(run.envelope[:, ::smooth], 8)},
        "matrix": {"every": smooth, **pack(run.matrix[:, ::smooth], 8)},
        **judged,
        "peaks": peaks(run.envelope, run.time_s, threshold),
        "verdicts": [{key: verdict[key] for key in VERDICT_KEYS} for verdict in verdicts],
        "facts": dict(facts),
    }


def what_was_judged(
    run: PreprocessedRun,
    stored: Stored,
    nearest: Mapping[str, NearestTemplate],
    settings: Settings,
) -> Cells:
    """Return the evidence from which the detectors judged a recording.

    Parameters
    ----------
    run : PreprocessedRun
        The recording on its way from readings to matrix.
    stored : Stored
        Its stored results.
    nearest : mapping of str to NearestTemplate
        The nearest template under each scheme.
    settings : mapping
        The configuration.

    Returns
    -------
    dict
        ``unit`` of the readings; ``fitted`` and ``templates``, from `judged_by.surface`; ``beats``,
        ``gut`` and ``stretches``, from `judged_by`. A value that is not known is None.
    """
    length, first_peak = settings["preprocessing"]["length"], settings["fit"]["first_peak"]
    rate_hz = settings["recording"]["rate_hz"]
    fitted, templates = None, {}
    if stored.fit:
        fit, particle = stored.fit
        fitted = judged_by.surface(particle, fit["first_peak"], fit["lag"], length)
    for scheme, each in nearest.items():
        drawn = judged_by.surface(each.particle, first_peak, each.lag, length)
        templates[scheme] = {"size_mm": each.size_mm, **drawn}
    along = along_gut(stored.values, rate_hz, settings["diagonal"])
    beats = gut = stretches = None
    if along is not None:
        beats, gut = judged_by.beats_evidence(along, rate_hz), judged_by.gut_evidence(along)
        if stored.stretches is not None:
            stretches = judged_by.stretches_evidence(
                stored.stretches, along, rate_hz, settings["diagonal"]
            )
    return {
        "unit": reading_unit(stored.header, stored.values),
        "fitted": fitted,
        "templates": templates,
        "beats": beats,
        "gut": gut,
        "stretches": stretches,
    }


def archive_evidence(
    rows: Sequence[Row],
    verdicts: Mapping[str, Sequence[Row]],
    sizes_mm: Sequence[float],
    load: Callable[[str], Stored],
    settings: Settings,
) -> Iterator[tuple[str, str]]:
    """Yield what the page shows of each recording, one at a time.

    Parameters
    ----------
    rows : sequence of mapping
        From `capsule.page.recordings.recording_rows`; rejected recordings are left out.
    verdicts : mapping of str to sequence of mapping
        From `capsule.page.recordings.verdicts_by_recording`.
    sizes_mm : sequence of float
        Sizes of the templates whose distances the verdicts hold, 0 first.
    load : callable
        ``load(name)`` returns the stored results of a recording.
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
    for place, row in enumerate(rows):
        if not row["accepted"]:
            continue
        name = row["recording"]
        stored = load(name)
        run = preprocess_run(name, recordings.truth(row), stored.values, **stages)
        facts = {"File": f"raw/{name}.csv", "SHA-256": row["sha256"]}
        if stored.fit:
            facts["Fit"] = fit_words(stored.fit[0])
        facts |= {f"# {key}": text for key, text in stored.header.items()}
        said = verdicts.get(name, [])
        compare = partial(_comparison, run.matrix, shape["length"])
        nearest = nearest_templates(stored.templates, said, sizes_mm, compare, settings)
        judged = what_was_judged(run, stored, nearest, settings)
        judged |= {"row": place, "nodule_at_mm": row["nodule_at_mm"]}
        content = recording_evidence(run, shape["threshold"], judged, said, facts)
        yield name, to_json(content)


def _comparison(matrix: FloatArray, length: int) -> SlidingComparison:
    return SlidingComparison(extend(matrix, length))


def to_json(content: object) -> str:
    """Return JSON in which no tag can begin, so that it is safe inside a script element."""
    text = json.dumps(content, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text
