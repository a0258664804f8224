"""Check one recording, put its readings on an even time grid, and compute its matrix V.

A rejected recording gets arrays of NaN.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from capsule.checking import check_recording
from capsule.kinds import Settings
from edges import files


def preprocess_recording(
    source: Path, name: str, settings: Settings, outputs: Sequence[Path]
) -> None:
    """Check a recording, and write its readings, its matrix and the result of its check."""
    *array_files, check_file = outputs
    max_bytes = int(settings["recording"]["max_megabytes"] * 1e6)
    content = files.read_limited(source, max_bytes)
    check, *arrays = check_recording(name, content, max_bytes, settings)
    for path, array in zip(array_files, arrays, strict=True):
        with files.write_whole(path, "wb") as stream:
            np.save(stream, array)
    files.write_json(check_file, check)
    print(f"{name}: {check['status']}", check["reason"])


def main() -> None:
    """Read the arguments of one recording, and preprocess it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path, help="the CSV file")
    parser.add_argument("--name", required=True, help="the recording's name, such as 3mm/r07")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--signal", type=Path, required=True, help="output: the readings, .npy")
    parser.add_argument("--matrix", type=Path, required=True, help="output: the matrix, .npy")
    parser.add_argument("--check", type=Path, required=True, help="output: the check, .json")
    arguments = parser.parse_args()
    outputs = (arguments.signal, arguments.matrix, arguments.check)
    preprocess_recording(arguments.recording, arguments.name, arguments.settings, outputs)


if __name__ == "__main__":
    files.run(main)
