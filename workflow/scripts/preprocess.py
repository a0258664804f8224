"""Check one recording, lay its readings on an even grid and make its matrix V.

A rejected recording gets arrays of NaN.
"""

import argparse
import hashlib
import io
import json
from pathlib import Path

import numpy as np

from capsule.acceptance import accept
from capsule.errors import RecordingError
from capsule.naming import size_mm
from capsule.preprocessing import preprocess
from capsule.recording import read_recording, too_large
from edges import files


def main() -> None:
    """Read a recording, write its matrix and the outcome of its check."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path, help="the CSV file")
    parser.add_argument("--name", required=True, help="the recording's name, such as 3mm/r07")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--signal", type=Path, required=True, help="output: the readings, .npy")
    parser.add_argument("--matrix", type=Path, required=True, help="output: the matrix, .npy")
    parser.add_argument("--check", type=Path, required=True, help="output: the check, .json")
    arguments = parser.parse_args()
    rules = dict(arguments.settings["recording"])
    shape = arguments.settings["preprocessing"]
    sensors, max_bytes = rules.pop("sensors"), int(rules.pop("max_megabytes") * 1e6)
    check = {"recording": arguments.name, "size_mm": size_mm(arguments.name), "header": {}}
    check |= {"samples": None, "duration_s": None, "status": "rejected", "reason": ""}
    check |= {"sha256": None, "readings_sha256": None}
    values = matrix = np.full((sensors, shape["length"]), np.nan)
    try:
        content = files.read_limited(arguments.recording, max_bytes)
        if content is None:
            raise too_large(max_bytes)
        check["sha256"] = hashlib.sha256(content).hexdigest()
        recording = read_recording(io.BytesIO(content), sensors, max_bytes)
        check["header"] = dict(recording.header)
        check["samples"] = recording.time_s.size
        check["duration_s"] = float(recording.time_s[-1] - recording.time_s[0])
        values = accept(recording, **rules, window=shape["window"], length=shape["length"])
        check["readings_sha256"] = hashlib.sha256(values.tobytes()).hexdigest()
        matrix = preprocess(values, **shape)
        check["status"] = "accepted"
    except RecordingError as reason:
        check["reason"] = str(reason)
    for path, array in ((arguments.signal, values), (arguments.matrix, matrix)):
        with files.write_whole(path, "wb") as stream:
            np.save(stream, array)
    files.write_json(arguments.check, check)
    print(f"{arguments.name}: {check['status']}", check["reason"])


if __name__ == "__main__":
    files.run(main)
