"""Write the files beside the page, which hold what it draws of a large archive's recordings."""

import argparse
import json
from functools import partial
from pathlib import Path

from capsule.evaluation.beside_paper import template_sizes_mm
from capsule.page.archive_evidence import accepted_rows, archive_evidence
from capsule.page.recordings import unjudged_rows, verdicts_by_recording
from edges import files
from edges.forks import Forks
from edges.page_data_files import DataFiles, write_list
from edges.page_recordings import StoredRecordings
from edges.results import read_table


def main() -> None:
    """Write the files and their list."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--evidence", type=Path, nargs="*", default=[], help="evidence, .json")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: the list of the files")
    parser.add_argument("--folder", type=Path, required=True, help="output: the folder beside")
    parser.add_argument("--processes", type=int, default=1, help="how many write (default: 1)")
    arguments = parser.parse_args()
    results, settings = arguments.results, arguments.settings
    stored = StoredRecordings(results, settings, arguments.evidence)
    predictions = read_table(results / "evaluation" / "predictions.csv")
    evidence = partial(
        archive_evidence,
        verdicts=verdicts_by_recording(predictions, read_table(results / "detections.csv")),
        sizes_mm=template_sizes_mm(predictions.columns),
        stored=stored,
        settings=settings,
    )
    rows = accepted_rows(unjudged_rows(read_table(results / "recordings.csv")))
    folder = DataFiles(arguments.folder, Forks(arguments.processes))
    listed = folder.write(rows, evidence, stored)
    write_list(arguments.output, listed)
    print(f"{arguments.folder}: {len(listed.files)} files with {len(rows)} recordings")


if __name__ == "__main__":
    files.run(main)
