"""Let every detector judge the unlabelled recordings, and keep what all labelled ones teach it."""

import argparse
import json
from functools import partial
from pathlib import Path

from capsule.detectors.training import TrainingArchive
from capsule.evaluation.predictions import Detectors
from capsule.naming import size_mm
from edges import files
from edges.detector_inputs import read_matrix, read_passages, read_template_set
from edges.scorer_files import read_features


def main() -> None:
    """Write detections.csv: verdict, size, probability and place, and the template distances."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="recordings.csv")
    parser.add_argument("--matrices", type=Path, required=True, help="the folder of matrices")
    parser.add_argument("--templates", type=Path, required=True, help="templates.npz")
    parser.add_argument("--passages", type=Path, required=True, help="the folder of passages")
    parser.add_argument("--features", type=Path, help="the folder of features, where needed")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: detections.csv")
    parser.add_argument("--learned", type=Path, required=True, help="output: detectors.json")
    arguments = parser.parse_args()
    names = files.accepted_recordings(arguments.recordings)
    sizes_mm = {name: size_mm(name) for name in names if size_mm(name) is not None}
    settings = arguments.settings
    # Nothing is left out here.
    templates = read_template_set(arguments.templates, settings["fit"]["first_peak"])
    passages = read_passages(arguments.passages, names)
    load = partial(read_matrix, arguments.matrices)
    features = read_features(arguments.features, names) if arguments.features else {}
    archive = TrainingArchive(sizes_mm, templates, {}, passages, load, settings, features)
    detectors = Detectors(archive)
    unlabelled = [name for name in names if name not in sizes_mm]
    rows = list(detectors.rows(unlabelled, []))
    files.write_csv(arguments.output, ["recording", "detector", *detectors.columns], rows)
    files.write_json(arguments.learned, detectors.stored() | {"settings": settings})
    print(f"{len(unlabelled)} unlabelled recordings judged by {len(detectors.names)} detectors")


if __name__ == "__main__":
    files.run(main)
