"""Describe each usable recording of a batch: best candidate for a nodule, traits, features, plot.

Nothing here depends on a fit or on other recordings.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from capsule.detectors.beats import series_of
from capsule.detectors.described import read_scorer, write_best_places, write_features
from capsule.detectors.search import UNKNOWN, passage_of
from capsule.detectors.wave_traits import wave_traits
from capsule.engine.project import WEIGHTS
from capsule.page.plot_data import plot_data, score_stretches
from capsule.store import files
from capsule.store.results import Results


def main() -> None:
    """Read the readings and the checks, and write what the detectors and the report need."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", nargs="+", help="names such as 3mm/r07")
    parser.add_argument("--batch", required=True, help="the batch, such as 3mm/batch-0")
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--batch-size", type=int, required=True, help="recordings in a file")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--best-places", type=Path, required=True, help="output: candidates, CSV")
    parser.add_argument("--features", type=Path, required=True, help="output: features, .npz")
    parser.add_argument("--plot-data", type=Path, required=True, help="output: plot data, .json")
    arguments = parser.parse_args()
    settings, rate_hz = arguments.settings, arguments.settings["recording"]["rate_hz"]
    names, size = arguments.recordings, arguments.batch_size
    results = Results(arguments.results, names, size, arguments.batch)
    checks, scorer = results.checks(names), read_scorer(WEIGHTS)
    best_places, features, drawn = {}, {}, {}
    for name in names:
        values = results.signal(name)
        # A copy of another recording is described too: only the rule list finds and rejects it.
        if np.isnan(values).all():
            print(f"{name}: rejected, not described")
            continue
        place = passage_of(values, rate_hz, settings["diagonal"])
        best_places[name] = place, wave_traits(values, rate_hz, settings["diagonal"])
        series = series_of(values, rate_hz, settings["diagonal"])
        features[name], stretches = scorer.features(series), score_stretches(scorer, series)
        drawn[name] = plot_data(name, values, checks[name], stretches, rate_hz, settings)
        if place is UNKNOWN or np.isnan(features[name].score):
            print(f"{name}: no peristaltic wave was found on every sensor")
    write_best_places(arguments.best_places, best_places)
    write_features(arguments.features, features)
    files.write_json(arguments.plot_data, drawn)
    print(f"{len(best_places)} recordings described")


if __name__ == "__main__":
    files.run(main)
