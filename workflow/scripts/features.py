"""Score every usable recording of a folder by the taught scorer.

Copies of other recordings are scored too: only the index, which nobody waits for here, rejects
them.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from capsule.detectors.scorer import features_of
from edges import files
from edges.scorer_files import read_scorer, write_features


def main() -> None:
    """Read the signals and the weights, write the features."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--raw", type=Path, required=True, help="the folder of recordings")
    parser.add_argument("--folder", required=True, help="the one below it, such as 3mm")
    parser.add_argument("--signals", type=Path, required=True, help="the folder of signals")
    parser.add_argument("--weights", type=Path, required=True, help="the scorer's weights, .npz")
    parser.add_argument("--rate-hz", type=float, required=True, help="sampling rate")
    parser.add_argument("--settings", type=json.loads, required=True, help="config section, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: the features, .npz")
    arguments = parser.parse_args()
    scorer, features = read_scorer(arguments.weights), {}
    for name in files.list_archive(arguments.raw).by_folder().get(arguments.folder, []):
        signal = arguments.signals / f"{name}.npy"
        if not signal.exists():
            print(f"{name}: came while the workflow ran; run it again to take it in")
            continue
        values = np.load(signal)
        if np.isnan(values).all():
            print(f"{name}: rejected, not scored")
            continue
        features[name] = features_of(
            values, arguments.rate_hz, arguments.settings["diagonal"], scorer
        )
        if np.isnan(features[name].score):
            print(f"{name}: no peristaltic wave was found on each of four sensors")
    write_features(arguments.output, features)
    print(f"{len(features)} recordings scored")


if __name__ == "__main__":
    files.run(main)
