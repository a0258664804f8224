"""Apply every detector to the unlabelled recordings, and combine the passes over one place."""

import argparse
import json
from pathlib import Path

from capsule.detectors.files import read_training_archive, write_learned
from capsule.engine.jobs import run
from capsule.evaluation.columns import SITES
from capsule.evaluation.cross_validation import Detectors, judge_unlabelled
from capsule.recordings.held_out import recordings_with_fits, teaching
from capsule.recordings.names import sizes_of, sort_key
from capsule.store import files
from capsule.store.results import Results


def main() -> None:
    """Write detections.csv, sites.csv, and detectors.json with the trained detectors."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="table of the recordings")
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--templates", type=Path, required=True, help="the templates")
    parser.add_argument("--predictions", type=Path, required=True, help="held-out predictions")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--code", required=True, help="each step before and its code, pairs")
    parser.add_argument("--output", type=Path, required=True, help="output: detections.csv")
    parser.add_argument("--learned", type=Path, required=True, help="output: detectors.json")
    parser.add_argument("--sites", type=Path, required=True, help="output: sites.csv")
    arguments = parser.parse_args()
    settings, rules = arguments.settings, arguments.settings["evaluation"]
    results = Results.of_table(arguments.results, arguments.recordings)
    rows = teaching(files.accepted_recordings(arguments.recordings), rules["held_out"])
    unlabelled = sorted(rows.keys() - sizes_of(rows).keys(), key=sort_key)
    fitted = recordings_with_fits(arguments.recordings, rules["held_out"])
    detectors = Detectors(read_training_archive(results, rows, fitted, settings))
    verdicts = judge_unlabelled(detectors, unlabelled, rows)
    files.write_csv(arguments.output, ["recording", "detector", *detectors.columns], verdicts)
    # `capsule compare` tells from it which steps differ between two folders of results.
    steps = arguments.code.split()
    models = detectors.stored() | {"code": dict(zip(steps[::2], steps[1::2], strict=True))}
    write_learned(arguments.learned, models, settings, arguments.templates)
    print(f"{len(unlabelled)} unlabelled recordings judged by {len(detectors.names)} detectors")
    sites = [row["site"] for row in rows.values() if row["site"]]
    made = []
    if len(set(sites)) < len(sites):
        # They import pandas, which most archives need not wait for here.
        from capsule.evaluation.files import read_table
        from capsule.evaluation.sites import site_table

        predictions = read_table(arguments.predictions)
        made = site_table(predictions, verdicts, rows, rules).to_dict("records")
    files.write_csv(arguments.sites, SITES, made)
    print(f"{len({row['site'] for row in made})} sites have several passes")


if __name__ == "__main__":
    run(main)
