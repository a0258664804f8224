"""Find in every usable recording of a folder the passage over a candidate for a nodule.

Copies of other recordings are searched too: only the index, which nobody waits for here, rejects
them.
"""

import argparse
import json
from dataclasses import asdict, fields
from pathlib import Path

import numpy as np

from capsule.detectors.passage import UNKNOWN, Passage, passage_of
from edges import files


def main() -> None:
    """Read the signals, write one row a recording."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--raw", type=Path, required=True, help="the folder of recordings")
    parser.add_argument("--folder", required=True, help="the one below it, such as 3mm")
    parser.add_argument("--signals", type=Path, required=True, help="the folder of signals")
    parser.add_argument("--rate-hz", type=float, required=True, help="sampling rate")
    parser.add_argument("--settings", type=json.loads, required=True, help="config section, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: the table")
    arguments = parser.parse_args()
    rows = []
    for name in files.list_archive(arguments.raw).by_folder().get(arguments.folder, []):
        signal = arguments.signals / f"{name}.npy"
        if not signal.exists():
            print(f"{name}: came while the workflow ran; run it again to take it in")
            continue
        values = np.load(signal)
        if np.isnan(values).all():
            print(f"{name}: rejected, not searched")
            continue
        passage = passage_of(values, arguments.rate_hz, arguments.settings["diagonal"])
        if passage is UNKNOWN:
            print(f"{name}: no peristaltic wave was found on every sensor")
        rows.append({"recording": name, **asdict(passage)})
    columns = ["recording", *(field.name for field in fields(Passage))]
    files.write_csv(arguments.output, columns, rows)
    print(f"{len(rows)} recordings searched")


if __name__ == "__main__":
    files.run(main)
