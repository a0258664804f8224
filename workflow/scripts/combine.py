"""Combine all recordings of a site to one verdict, for each site with several passes."""

import argparse
import json
from pathlib import Path

from capsule.evaluation.folds import group_scheme, main_scheme
from capsule.evaluation.sites import COLUMNS, site_rows
from edges import files


def main() -> None:
    """Read the verdicts on all recordings, and write a row for each detector and site."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="recordings.csv")
    parser.add_argument("--evaluation", type=Path, required=True, help="the folder of predictions")
    parser.add_argument("--detections", type=Path, required=True, help="detections.csv")
    parser.add_argument("--settings", type=json.loads, required=True, help="config section, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: sites.csv")
    arguments = parser.parse_args()
    rules = arguments.settings["evaluation"]
    accepted = files.accepted_recordings(arguments.recordings)
    sites = {name: row["site"] for name, row in accepted.items()}
    by_group = files.read_csv(arguments.evaluation / "group_predictions.csv")
    labelled = [row for row in by_group if row["scheme"] == group_scheme("site")]
    if not labelled:  # no two labelled recordings share a site
        one_by_one = files.read_csv(arguments.evaluation / "predictions.csv")
        labelled = [row for row in one_by_one if row["scheme"] == main_scheme(rules["schemes"])]
    every = labelled + files.read_csv(arguments.detections)
    rows = site_rows(every, sites, rules["specificity"])
    files.write_csv(arguments.output, COLUMNS, rows)
    print(f"{len({row['site'] for row in rows})} sites have several passes")


if __name__ == "__main__":
    files.run(main)
