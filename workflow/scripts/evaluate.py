"""Apply every detector to each labelled recording, after training on the other recordings."""

import argparse
import json
from pathlib import Path

from capsule.evaluation.folds import LEAST_HEALTHY, LEAST_NODULES, header_groups
from capsule.evaluation.whole_evaluation import evaluate_archive
from capsule.naming import size_mm
from capsule.templates import build_templates
from edges import files, fits
from edges.detector_inputs import read_training_archive
from edges.forks import Forks


def main() -> None:
    """Write the predictions of every detector and scheme, and the tables of rates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="recordings.csv")
    parser.add_argument("--matrices", type=Path, required=True, help="the folder of matrices")
    parser.add_argument("--fits", type=Path, required=True, help="the folder of fits")
    parser.add_argument("--passages", type=Path, nargs="*", default=[], help="passages, CSV")
    parser.add_argument("--features", type=Path, nargs="*", default=[], help="features, .npz")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument(
        "--template-settings", type=json.loads, required=True, help="S, L and u, JSON"
    )
    parser.add_argument("--output", type=Path, required=True, help="output: the folder of tables")
    parser.add_argument("--processes", type=int, default=1, help="how many judge (default: 1)")
    arguments = parser.parse_args()
    accepted = files.accepted_recordings(arguments.recordings)
    index = {name: row for name, row in accepted.items() if row["size_mm"]}
    sizes_mm = {name: size_mm(name) for name in index}
    particles = fits.read_particles(arguments.recordings, arguments.fits)
    templates = build_templates(fits.by_size(particles), **arguments.template_settings)
    archive = read_training_archive(arguments, index, sizes_mm, templates, particles)
    for name, table in evaluate_archive(archive, index, Forks(arguments.processes)).items():
        files.write_csv(arguments.output / f"{name}.csv", table.columns, table.rows)
    for key in arguments.settings["evaluation"]["groups"]:
        if header_groups(key, list(index), index) is None:
            print(
                f"no {key} is left out: no two recordings share one in their headers, or the "
                f"others are fewer than {LEAST_HEALTHY} healthy and {LEAST_NODULES} with a nodule"
            )


if __name__ == "__main__":
    files.run(main)
