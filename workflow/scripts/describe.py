"""Describe each usable recording of a batch: best candidate for a nodule, traits, features.

Nothing here depends on a fit or on other recordings.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from capsule.detectors.described import read_scorer, write_best_places, write_features
from capsule.detectors.search import UNKNOWN, passage_of, series_of
from capsule.detectors.wave import wave_of
from capsule.detectors.wave_traits import wave_traits
from capsule.engine.jobs import run
from capsule.engine.project import WEIGHTS
from capsule.store.results import arrays_in


def main() -> None:
    """Read the readings, and write what the detectors need."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", nargs="+", help="names such as 3mm/r07")
    parser.add_argument("--signals", type=Path, nargs="+", required=True, help="the readings")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--best-places", type=Path, required=True, help="output: candidates, CSV")
    parser.add_argument("--features", type=Path, required=True, help="output: features, .npz")
    arguments = parser.parse_args()
    settings, rate_hz = arguments.settings, arguments.settings["recording"]["rate_hz"]
    scorer, best_places, features = read_scorer(WEIGHTS), {}, {}
    for name, values in arrays_in(arguments.signals, arguments.recordings):
        # A copy of another recording is described too: only the rule list finds and rejects it.
        if np.isnan(values).all():
            print(f"{name}: rejected, not described")
            continue
        wave = wave_of(values, rate_hz, settings["diagonal"])
        place = passage_of(wave, settings["diagonal"])
        best_places[name] = place, wave_traits(wave, rate_hz)
        features[name] = scorer.features(series_of(wave))
        if place is UNKNOWN or np.isnan(features[name].score):
            print(f"{name}: no peristaltic wave was found on every sensor")
    write_best_places(arguments.best_places, best_places)
    write_features(arguments.features, features)
    print(f"{len(best_places)} recordings described")


if __name__ == "__main__":
    run(main)
