"""Judge the detector on the labelled recordings, leave-one-out and by resubstitution."""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import files
import fits
from capsule import evaluation
from capsule.detection import nearest_size, template_distances
from capsule.naming import size_label, size_mm
from capsule.templates import TemplateSet, build_templates


def predictions(
    names: list[str], matrices: Path, templates: TemplateSet, particles: dict, schemes: list[str]
) -> Iterator[dict]:
    """Give one row a recording and scheme: the predicted size, the distance to each template."""
    labels = [f"rmse_{size_label(size)}" for size in templates.sizes_mm]
    for name in names:
        matrix = np.load(matrices / f"{name}.npy")
        size = size_mm(name)
        for scheme in schemes:
            compared = templates.matrices
            if scheme == "leave_one_out" and size > 0:
                compared = templates.without(size, particles[name])
            distances = template_distances(matrix, compared)
            row = {"recording": name, "size_mm": size, "detector": "template", "scheme": scheme}
            row["predicted_mm"] = nearest_size(distances, templates.sizes_mm)
            yield row | dict(zip(labels, distances.tolist(), strict=True))


def main() -> None:
    """Write the predictions and the tables of rates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="recordings.csv")
    parser.add_argument("--matrices", type=Path, required=True, help="the folder of matrices")
    parser.add_argument("--fits", type=Path, required=True, help="the folder of fits")
    parser.add_argument("--settings", type=json.loads, required=True, help="config section, JSON")
    parser.add_argument("--template-settings", type=json.loads, required=True, help="S, L, u")
    parser.add_argument("--output", type=Path, required=True, help="output: the folder of tables")
    arguments = parser.parse_args()
    settings, folder = arguments.settings["evaluation"], arguments.output
    particles = fits.read_particles(arguments.recordings, arguments.fits)
    templates = build_templates(fits.by_size(particles), **arguments.template_settings)
    names = [n for n in files.accepted_recordings(arguments.recordings) if size_mm(n) is not None]
    rows = list(predictions(names, arguments.matrices, templates, particles, settings["schemes"]))
    labels = [f"rmse_{size_label(size)}" for size in templates.sizes_mm]
    key = ["detector", "scheme"]
    columns = ["recording", "size_mm", *key, "predicted_mm", *labels]
    files.write_csv(folder / "predictions.csv", columns, rows)
    for name, table in evaluation.tables(rows, templates.sizes_mm, **settings).items():
        files.write_csv(folder / f"{name}.csv", evaluation.COLUMNS[name], table)


if __name__ == "__main__":
    files.run(main)
