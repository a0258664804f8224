"""Check of one recording: from the file's bytes to readings and matrix, or to a reason why not."""

import hashlib
import io
from typing import Any

import numpy as np

from capsule.acceptance import accept
from capsule.arrays import FloatArray
from capsule.errors import RecordingError
from capsule.kinds import Settings
from capsule.names import size_mm
from capsule.near_copies import fingerprint
from capsule.preprocessing import preprocess
from capsule.recording import Recording, read_recording, too_large
from capsule.seeding import readings_checksum
from capsule.units import on_full_scale, shares_at_ends
from capsule.wave import missing_wave


def check_recording(
    name: str, content: bytes | None, max_bytes: int, settings: Settings
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
        section ``diagonal`` that `capsule.configuration.BENCH` lists.

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
        # The readings as recorded: on another full scale the ends of the ADC's range are unknown.
        check["at_ends"] = shares_at_ends(recording.values, recording.header)
        check["readings_sha256"] = readings_checksum(values)
        check["marks"] = fingerprint(values).tolist()
        matrix = preprocess(values, **shape)
        check["status"] = "accepted"
    except RecordingError as reason:
        check["reason"] = str(reason)
    return check, values, matrix


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
    rules, shape, bench = (
        dict(settings["recording"]),
        settings["preprocessing"],
        settings["diagonal"],
    )
    for key in ("sensors", "max_megabytes"):
        del rules[key]
    false_rate = rules.pop("wave_false_rate")
    accepted = accept(recording, **rules, window=shape["window"], length=shape["length"])
    values = on_full_scale(
        accepted, recording.header, bench["full_scale"], bench["pressing_lowers_reading"]
    )
    return values, missing_wave(values, rules["rate_hz"], bench, false_rate)
