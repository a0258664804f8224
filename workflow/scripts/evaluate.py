"""Apply every detector to each labelled recording, trained on the other recordings."""

import argparse
import json
from pathlib import Path

from capsule.evaluation import learning, rates
from capsule.evaluation.folds import group_folds, scheme_folds
from capsule.evaluation.predictions import Detectors, by_folds
from capsule.evaluation.rows import by_detector
from capsule.naming import size_mm, sort_key
from capsule.templates import build_templates
from edges import files, fits
from edges.detector_inputs import read_training_archive


def main() -> None:
    """Write the predictions of every detector and scheme, and the tables of rates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="recordings.csv")
    parser.add_argument("--matrices", type=Path, required=True, help="the folder of matrices")
    parser.add_argument("--fits", type=Path, required=True, help="the folder of fits")
    parser.add_argument("--passages", type=Path, required=True, help="the folder of passages")
    parser.add_argument("--features", type=Path, help="the folder of features, where needed")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument(
        "--template-settings", type=json.loads, required=True, help="S, L and u, JSON"
    )
    parser.add_argument("--output", type=Path, required=True, help="output: the folder of tables")
    arguments = parser.parse_args()
    settings, folder = arguments.settings, arguments.output
    rules = settings["evaluation"]
    accepted = files.accepted_recordings(arguments.recordings)
    index = {name: row for name, row in accepted.items() if row["size_mm"]}
    sizes_mm = {name: size_mm(name) for name in index}
    particles = fits.read_particles(arguments.recordings, arguments.fits)
    templates = build_templates(fits.by_size(particles), **arguments.template_settings)
    archive = read_training_archive(arguments, index, sizes_mm, templates, particles)
    detectors = Detectors(archive)
    made = by_folds(detectors, sizes_mm, scheme_folds(rules["schemes"], index))
    folds_by_group = {key: group_folds(key, index) for key in rules["groups"]}
    grouped = by_folds(detectors, sizes_mm, [folds for folds in folds_by_group.values() if folds])
    columns = ["recording", "size_mm", "detector", "scheme", *detectors.columns]
    for name, verdicts in (("predictions", made), ("group_predictions", grouped)):
        files.write_csv(folder / f"{name}.csv", columns, by_detector(verdicts, sort_key))
    learned = learning.learning_rows(detectors.learners(), archive, made)
    files.write_csv(folder / "learning.csv", learning.COLUMNS, learned)
    for key in [key for key, folds in folds_by_group.items() if folds is None]:
        print(f"no two recordings share a {key} in their headers, so no group is left out")
    counted = {key: rules[key] for key in ("schemes", "tolerance_mm", "confidence")}
    for name, table in rates.tables(made, templates.sizes_mm, **counted).items():
        files.write_csv(folder / f"{name}.csv", rates.COLUMNS[name], table)


if __name__ == "__main__":
    files.run(main)
