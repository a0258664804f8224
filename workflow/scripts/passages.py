"""Find in every accepted recording the passage over a candidate for a nodule."""

import argparse
import json
from dataclasses import asdict, fields
from pathlib import Path

import numpy as np

import files
from capsule.detectors.beats import find_beats
from capsule.detectors.diagonal import UNKNOWN, Passage, find_passage


def main() -> None:
    """Read the signals, write one row a recording."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="recordings.csv")
    parser.add_argument("--signals", type=Path, required=True, help="the folder of signals")
    parser.add_argument("--rate-hz", type=float, required=True, help="sampling rate")
    parser.add_argument("--settings", type=json.loads, required=True, help="config section, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: passages.csv")
    arguments = parser.parse_args()
    settings = dict(arguments.settings["diagonal"])
    settings.pop("size_ridge")
    wavelength_mm, speed_mm_s = settings.pop("wavelength_mm"), settings.pop("wave_speed_mm_s")
    period = arguments.rate_hz * wavelength_mm / speed_mm_s
    wave = {"period": period, "wavelength_mm": wavelength_mm}
    wave["pressing_lowers"] = settings.pop("pressing_lowers_reading")
    rows = []
    for name in files.accepted_recordings(arguments.recordings):
        beats = find_beats(np.load(arguments.signals / f"{name}.npy"), **wave)
        passage = UNKNOWN if beats is None else find_passage(beats, **settings)
        if beats is None:
            print(f"{name}: no peristaltic wave was found on every sensor")
        rows.append({"recording": name, **asdict(passage)})
    columns = ["recording", *(field.name for field in fields(Passage))]
    files.write_csv(arguments.output, columns, rows)
    print(f"{len(rows)} recordings searched")


if __name__ == "__main__":
    files.run(main)
