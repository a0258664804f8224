"""Apply every detector to the unlabelled recordings, and save the trained detectors."""

import argparse
import json
from pathlib import Path

from capsule.evaluation.predictions import Detectors, of_unlabelled
from capsule.naming import size_mm, sort_key
from edges import files, fits
from edges.checksums import checksum
from edges.detector_inputs import read_template_set, read_training_archive


def main() -> None:
    """Write detections.csv with the verdicts, and detectors.json with the trained detectors."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="recordings.csv")
    parser.add_argument("--matrices", type=Path, required=True, help="the folder of matrices")
    parser.add_argument("--templates", type=Path, required=True, help="templates.npz")
    parser.add_argument("--passages", type=Path, nargs="*", default=[], help="passages, CSV")
    parser.add_argument("--fits", type=Path, required=True, help="the folder of fits")
    parser.add_argument("--features", type=Path, nargs="*", default=[], help="features, .npz")
    parser.add_argument("--weights", type=Path, required=True, help="the scorer's weights, .npz")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: detections.csv")
    parser.add_argument("--learned", type=Path, required=True, help="output: detectors.json")
    arguments = parser.parse_args()
    rows = files.accepted_recordings(arguments.recordings)
    names = list(rows)
    sizes_mm = {name: size_mm(name) for name in names if size_mm(name) is not None}
    settings = arguments.settings
    unlabelled = sorted((name for name in names if name not in sizes_mm), key=sort_key)
    alike = {name: set(rows[name]["near_copies"].split()) & sizes_mm.keys() for name in unlabelled}
    alike = {name: sorted(others) for name, others in alike.items() if others}
    # The fits are needed only to leave near copies of an unlabelled recording out of its templates.
    particles = fits.read_particles(arguments.recordings, arguments.fits) if alike else {}
    templates = read_template_set(arguments.templates, settings["fit"]["first_peak"], particles)
    archive = read_training_archive(arguments, rows, sizes_mm, templates, particles)
    detectors = Detectors(archive)
    verdicts = of_unlabelled(detectors, unlabelled, alike)
    files.write_csv(arguments.output, ["recording", "detector", *detectors.columns], verdicts)
    fits_to = {"settings": settings, "scorer": checksum(arguments.weights)}
    files.write_json(arguments.learned, detectors.stored() | fits_to)
    print(f"{len(unlabelled)} unlabelled recordings judged by {len(detectors.names)} detectors")


if __name__ == "__main__":
    files.run(main)
