"""Average the fits of each nodule size to its template, and render the template."""

import argparse
import json
from pathlib import Path

import numpy as np

from capsule.engine.jobs import run
from capsule.method.particle import particles_of
from capsule.method.templates import build_templates, by_size
from capsule.recordings.held_out import recordings_with_fits
from capsule.recordings.names import size_label
from capsule.store import files
from capsule.store.results import Results


def main() -> None:
    """Read the fits of the recordings that teach, and write the templates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="labelled.csv")
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--settings", type=json.loads, required=True, help="config keys, JSON")
    parser.add_argument("--parameters", type=Path, required=True, help="output: templates.json")
    parser.add_argument("--matrices", type=Path, required=True, help="output: templates.npz")
    arguments = parser.parse_args()
    results = Results.of_table(arguments.results, arguments.recordings)
    settings = dict(arguments.settings)
    fitted = recordings_with_fits(arguments.recordings, settings.pop("held_out"))
    templates = build_templates(by_size(particles_of(results.fits(fitted))), **settings)
    entries = []
    for size, total in zip(templates.sizes_mm, templates.totals, strict=True):
        mean = {key: value.tolist() for key, value in vars(total.mean()).items()}
        parameters = mean if total.count else None
        entries.append({"size_mm": size, "recordings": total.count, "parameters": parameters})
    files.write_json(arguments.parameters, {**settings, "templates": entries})
    labels = [size_label(size) for size in templates.sizes_mm]
    with files.write_whole(arguments.matrices, "wb") as stream:
        np.savez(stream, **dict(zip(labels, templates.matrices, strict=True)))
    print(f"templates of {', '.join(labels)}")


if __name__ == "__main__":
    run(main)
