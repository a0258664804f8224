"""Check the recordings of a batch, put their readings on an even time grid, compute matrices V.

A rejected recording gets arrays of NaN.
"""

import argparse
import json
from pathlib import Path

from capsule.engine.jobs import run
from capsule.errors import CapsuleError
from capsule.recordings.acceptance import check_recording
from capsule.store import files, results


def main() -> None:
    """Write the readings, the matrices and the outcome of the checks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", nargs="+", help="names such as 3mm/r07")
    parser.add_argument("--contents", nargs="+", required=True, help="FILE=CHECKSUM of each")
    parser.add_argument("--batch", required=True, help="the batch, such as 3mm/r07")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--signals", type=Path, required=True, help="output: the readings")
    parser.add_argument("--matrices", type=Path, required=True, help="output: the matrices")
    parser.add_argument("--checks", type=Path, required=True, help="output: the checks")
    arguments = parser.parse_args()
    settings, signals, matrices, checks = arguments.settings, {}, {}, {}
    max_bytes = int(settings["recording"]["max_megabytes"] * 1e6)
    for name, told in zip(arguments.recordings, arguments.contents, strict=True):
        path, _, expected = told.rpartition("=")
        content = files.read_limited(path, max_bytes)
        if files.fingerprint_of(content) != expected:
            raise CapsuleError(f"{path} has changed since the run began; run the command again")
        made = check_recording(name, content, max_bytes, settings)
        checks[name], signals[name], matrices[name] = made
        print(f"{name}: {checks[name]['status']}", checks[name]["reason"])
    results.write_arrays(arguments.signals, signals)
    results.write_arrays(arguments.matrices, matrices)
    results.write_contents(arguments.checks, checks, arguments.batch)


if __name__ == "__main__":
    run(main)
