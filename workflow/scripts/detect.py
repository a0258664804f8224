"""Apply every detector to the unlabelled recordings, and combine the passes over one place."""

import argparse
import json
import sys
from pathlib import Path

from capsule import files, fits
from capsule.detectors.files import read_template_set, read_training_archive
from capsule.evaluation.folds import group_scheme, main_scheme
from capsule.evaluation.predictions import Detectors, of_unlabelled
from capsule.evaluation.sites import COLUMNS, site_rows
from capsule.naming import sizes_of, sort_key
from capsule.project import WEIGHTS
from capsule.results import Results


def main() -> None:
    """Write detections.csv, sites.csv, and detectors.json with the trained detectors."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="recordings.csv")
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--batch-size", type=int, required=True, help="recordings in a batch")
    parser.add_argument("--templates", type=Path, required=True, help="templates.npz")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: detections.csv")
    parser.add_argument("--learned", type=Path, required=True, help="output: detectors.json")
    parser.add_argument("--sites", type=Path, required=True, help="output: sites.csv")
    arguments = parser.parse_args()
    settings, rules = arguments.settings, arguments.settings["evaluation"]
    results = Results.of_table(arguments.results, arguments.recordings, arguments.batch_size)
    rows = files.accepted_recordings(arguments.recordings)
    labelled = sizes_of(rows)
    unlabelled = sorted((name for name in rows if name not in labelled), key=sort_key)
    alike = {name: set(rows[name]["near_copies"].split()) & labelled.keys() for name in unlabelled}
    alike = {name: sorted(others) for name, others in alike.items() if others}
    # The fits are needed only to leave near copies of an unlabelled recording out of its templates.
    particles = fits.read_particles(arguments.recordings, results) if alike else {}
    templates = read_template_set(arguments.templates, settings["fit"]["first_peak"], particles)
    detectors = Detectors(read_training_archive(results, rows, templates, particles, settings))
    columns = ["recording", "detector", *detectors.columns]
    files.write_csv(arguments.output, columns, of_unlabelled(detectors, unlabelled, alike))
    fits_to = {"settings": settings, "scorer": files.fingerprint(WEIGHTS, sys.maxsize)}
    files.write_json(arguments.learned, detectors.stored() | fits_to)
    print(f"{len(unlabelled)} unlabelled recordings judged by {len(detectors.names)} detectors")

    evaluation = arguments.results / "evaluation"
    judged = files.read_csv(evaluation / "group_predictions.csv")
    judged = [row for row in judged if row["scheme"] == group_scheme("site")]
    if not judged:  # no two labelled recordings share a site
        judged = files.read_csv(evaluation / "predictions.csv")
        judged = [row for row in judged if row["scheme"] == main_scheme(rules["schemes"])]
    sites = {name: row["site"] for name, row in rows.items()}
    made = site_rows(judged + files.read_csv(arguments.output), sites, rules["specificity"])
    files.write_csv(arguments.sites, COLUMNS, made)
    print(f"{len({row['site'] for row in made})} sites have several passes")


if __name__ == "__main__":
    files.run(main)
