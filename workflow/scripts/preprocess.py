"""Check one recording, put its readings on an even time grid, and compute its matrix V.

A rejected recording gets arrays of NaN.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from capsule.checking import check_recording
from edges import files


def main() -> None:
    """Read a recording, and write its readings, its matrix and the result of its check."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path, help="the CSV file")
    parser.add_argument("--name", required=True, help="the recording's name, such as 3mm/r07")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--signal", type=Path, required=True, help="output: the readings, .npy")
    parser.add_argument("--matrix", type=Path, required=True, help="output: the matrix, .npy")
    parser.add_argument("--check", type=Path, required=True, help="output: the check, .json")
    arguments = parser.parse_args()
    max_bytes = int(arguments.settings["recording"]["max_megabytes"] * 1e6)
    content = files.read_limited(arguments.recording, max_bytes)
    check, *arrays = check_recording(arguments.name, content, max_bytes, arguments.settings)
    for path, array in zip((arguments.signal, arguments.matrix), arrays, strict=True):
        with files.write_whole(path, "wb") as stream:
            np.save(stream, array)
    files.write_json(arguments.check, check)
    print(f"{arguments.name}: {check['status']}", check["reason"])


if __name__ == "__main__":
    files.run(main)
