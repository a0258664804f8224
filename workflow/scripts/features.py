"""Score every usable recording of a set with the taught scorer, whole and in stretches."""

import argparse
from pathlib import Path

import numpy as np

from capsule.detectors.scorer import series_of
from capsule.detectors.stretches import score_stretches
from edges import files
from edges.scorer_files import read_scorer, write_features, write_stretches
from edges.search_signals import search_arguments, usable_signals


def main() -> None:
    """Read the signals and the weights, and write the features and the stretches."""
    parser = argparse.ArgumentParser(description=__doc__, parents=[search_arguments()])
    parser.add_argument("--weights", type=Path, required=True, help="the scorer's weights, .npz")
    parser.add_argument("--output", type=Path, required=True, help="output: the features, .npz")
    parser.add_argument("--stretches", type=Path, required=True, help="output: the stretches, .npz")
    arguments = parser.parse_args()
    scorer, features, stretches = read_scorer(arguments.weights), {}, {}
    for name, values in usable_signals(arguments.signals, arguments.recordings, "scored"):
        series = series_of(values, arguments.rate_hz, arguments.settings["diagonal"])
        features[name] = scorer.features(series)
        stretches[name] = score_stretches(scorer, series)
        if np.isnan(features[name].score):
            print(f"{name}: no peristaltic wave was found on each of four sensors")
    write_features(arguments.output, features)
    write_stretches(arguments.stretches, stretches)
    print(f"{len(features)} recordings scored")


if __name__ == "__main__":
    files.run(main)
