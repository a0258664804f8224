"""Collect what the page shows of one recording and what neither its fit nor another one changes.

Signals are packed (`capsule.page.packing`). The page draws particles from their parameters.
"""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.kinds import Cells, Row, Settings
from capsule.page import judged_by
from capsule.page.along_gut import along_gut
from capsule.page.packing import pack
from capsule.page.stretches import Stretches
from capsule.preprocessing import PreprocessedRun, preprocess_run
from capsule.units import reading_unit

# Envelopes and matrices are smooth over the window of the envelope, so more points add no detail.
SMOOTH_POINTS = 250


@dataclass(frozen=True)
class RecordingResults:
    """The stored results of one usable recording.

    Attributes
    ----------
    values : (S, K) array
        The readings on an even grid in time; NaN where a sample is missing.
    check : mapping
        The result of its check, with ``header`` and ``sha256``.
    stretches : Stretches or None
        What the taught score loses without each stretch; None if it was not computed.
    """

    values: FloatArray
    check: Row
    stretches: Stretches | None = None


def recording_evidence(
    name: str, results: RecordingResults, rate_hz: float, settings: Settings
) -> Cells:
    """Return what the page shows of one recording alone.

    Parameters
    ----------
    name : str
        The recording, such as ``3mm/r07``.
    results : RecordingResults
        Its stored results.
    rate_hz : float
        Sampling rate.
    settings : mapping
        Sections ``preprocessing`` and ``diagonal`` of the configuration.

    Returns
    -------
    dict
        Ready for `capsule.page.packing.to_json`: ``recording``, ``interval_s``, ``threshold``,
        ``readings``, ``envelope`` and ``matrix``; the values of `what_was_judged`; ``peaks``; and
        ``facts``, names and texts to list beside the signals.
    """
    shape = settings["preprocessing"]
    stages = {key: shape[key] for key in ("window", "threshold")}
    run = preprocess_run(name, "", results.values, rate_hz=rate_hz, **stages)
    every = max(1, -(-run.time_s.size // SMOOTH_POINTS))
    facts = {"File": f"raw/{name}.csv", "SHA-256": results.check["sha256"]}
    facts |= {f"# {key}": text for key, text in results.check["header"].items()}
    return {
        "recording": name,
        "interval_s": float(run.time_s[1] - run.time_s[0]),
        "threshold": shape["threshold"],
        "readings": pack(run.values),
        "envelope": {"every": every, **pack(run.envelope[:, ::every], 8)},
        "matrix": {"every": every, **pack(run.matrix[:, ::every], 8)},
        **what_was_judged(run, results, rate_hz, settings),
        "peaks": peaks(run.envelope, run.time_s, shape["threshold"]),
        "facts": facts,
    }


def what_was_judged(
    run: PreprocessedRun, results: RecordingResults, rate_hz: float, settings: Settings
) -> Cells:
    """Return the evidence from which the detectors judged a recording, except the templates.

    Parameters
    ----------
    run : PreprocessedRun
        The recording on its way from readings to matrix.
    results : RecordingResults
        Its stored results.
    rate_hz, settings
        As in `recording_evidence`.

    Returns
    -------
    dict
        ``unit`` of the readings; ``beats``, ``gut`` and ``stretches``, from `judged_by`. A value
        that is not known is None.
    """
    along = along_gut(run.values, rate_hz, settings["diagonal"])
    beats = gut = stretches = None
    if along is not None:
        beats, gut = judged_by.beats_evidence(along, rate_hz), judged_by.gut_evidence(along)
        if results.stretches is not None:
            stretches = judged_by.stretches_evidence(
                results.stretches, along, rate_hz, settings["diagonal"]
            )
    return {
        "unit": reading_unit(results.check["header"], run.values),
        "beats": beats,
        "gut": gut,
        "stretches": stretches,
    }


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
