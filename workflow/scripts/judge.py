"""Compute the tables that assess the detectors from their predictions."""

import argparse
import json
from pathlib import Path

from capsule.evaluation.all_tables import all_tables
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.rows import by_detector, number
from edges import files
from edges.forks import Forks


def main() -> None:
    """Read the predictions of all detectors, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="recordings.csv")
    parser.add_argument("--predictions", type=Path, nargs="+", required=True, help="predictions")
    parser.add_argument("--settings", type=json.loads, required=True, help="config section, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: the folder of tables")
    parser.add_argument("--processes", type=int, default=1, help="how many assess (default: 1)")
    arguments = parser.parse_args()
    headers = files.accepted_recordings(arguments.recordings)
    turn = {name: place for place, name in enumerate(headers)}
    sites = {name: row["site"] for name, row in headers.items()}
    nodule_at_mm = {name: number(row["nodule_at_mm"]) for name, row in headers.items()}
    predictions = [
        row
        for path in arguments.predictions
        for row in by_detector(files.read_csv(path), turn.__getitem__)
    ]
    spread = Forks(arguments.processes)
    made = all_tables(predictions, sites, nodule_at_mm, arguments.settings["evaluation"], spread)
    for name, rows in made.items():
        columns = list(rows[0]) if rows else COLUMNS[name]
        files.write_csv(arguments.output / f"{name}.csv", columns, rows)


if __name__ == "__main__":
    files.run(main)
