"""Collect what the report draws of each usable recording of a batch."""

import argparse
import json
from pathlib import Path

import numpy as np

from capsule.detectors.described import read_scorer
from capsule.detectors.network import score_stretches
from capsule.detectors.search import series_of
from capsule.detectors.wave import wave_of
from capsule.engine.jobs import run
from capsule.engine.project import WEIGHTS
from capsule.page.plot_data import plot_data
from capsule.store import files
from capsule.store.results import arrays_in, contents_in


def main() -> None:
    """Read the readings and the checks, and write what the report draws."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", nargs="+", help="names such as 3mm/r07")
    parser.add_argument("--signals", type=Path, nargs="+", required=True, help="the readings")
    parser.add_argument("--checks", type=Path, nargs="+", required=True, help="their checks")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: plot data, .json")
    arguments = parser.parse_args()
    checks, scorer = contents_in(arguments.checks), read_scorer(WEIGHTS)
    settings, rate_hz, drawn = arguments.settings, arguments.settings["recording"]["rate_hz"], {}
    for name, values in arrays_in(arguments.signals, arguments.recordings):
        # A rejected recording has no readings.
        if np.isnan(values).all():
            continue
        wave = wave_of(values, rate_hz, settings["diagonal"])
        stretches = score_stretches(scorer, series_of(wave))
        drawn[name] = plot_data(name, values, wave, checks[name], stretches, settings)
    files.write_json(arguments.output, drawn)
    print(f"{len(drawn)} recordings collected")


if __name__ == "__main__":
    run(main)
