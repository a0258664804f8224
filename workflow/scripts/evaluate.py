"""Judge each labelled recording by detectors that it did not teach, and rate the detectors."""

import argparse
import json
from pathlib import Path

from capsule.detectors.files import read_training_archive
from capsule.engine.jobs import run
from capsule.evaluation.cross_validation import LEAST_GROUPS, group_scheme
from capsule.evaluation.measures import evaluate_archive
from capsule.recordings.held_out import recordings_with_fits
from capsule.store import files
from capsule.store.results import Results


def main() -> None:
    """Write the predictions of every detector and scheme, and all tables made from them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="labelled.csv")
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: the folder of tables")
    arguments = parser.parse_args()
    settings = arguments.settings
    results = Results.of_table(arguments.results, arguments.recordings)
    rows = files.accepted_recordings(arguments.recordings)
    fitted = recordings_with_fits(arguments.recordings, settings["evaluation"]["held_out"])
    archive = read_training_archive(results, rows, fitted, settings)
    tables = evaluate_archive(archive, rows)
    for name, table in tables.items():
        cells = table.itertuples(index=False, name=None)
        files.write_cells(arguments.output / f"{name}.csv", list(table), cells)
    computed = set(tables["predictions"]["scheme"])
    for key in settings["evaluation"]["groups"]:
        if group_scheme(key) not in computed:
            print(f"no {key} is left out: the headers name fewer than {LEAST_GROUPS} of a kind")


if __name__ == "__main__":
    run(main)
