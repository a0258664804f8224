"""Write results/report.html, a page that needs no network."""

import argparse
import datetime
import json
from pathlib import Path

from capsule.page.methods import software_sentence
from capsule.page.provenance import how_made
from capsule.page.render import render_page
from capsule.page.sections import page_values
from edges import files, page_inputs
from edges.config_files import read_schema
from edges.durations import read_durations
from edges.page_data_files import read_list
from edges.page_recordings import StoredRecordings
from edges.project_state import read_project_state
from edges.results import read_printed

NO_SURVEYS = '{"names": [], "passed_over": {}}'


def main() -> None:
    """Read all results, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--evidence", type=Path, nargs="*", default=[], help="evidence, .json")
    parser.add_argument("--template", type=Path, required=True, help="the folder of the template")
    parser.add_argument("--schema", type=Path, required=True, help="the schema of the config")
    parser.add_argument("--settings", type=json.loads, required=True, help="the config, JSON")
    parser.add_argument("--surveys", type=json.loads, default=NO_SURVEYS, help="surveys, JSON")
    parser.add_argument("--code", type=Path, nargs="+", required=True, help="the files of the code")
    parser.add_argument("--output", type=Path, required=True, help="output: the page")
    parser.add_argument("--beside", type=Path, nargs="?", help="the files beside the page, .json")
    arguments = parser.parse_args()
    results, settings, surveys = arguments.results, arguments.settings, arguments.surveys
    template, confidence = arguments.template, settings["evaluation"]["confidence"]
    printed, versions = read_printed(template / "paper.yaml"), page_inputs.read_versions(template)
    tables = page_inputs.read_tables(results, template, printed, confidence)
    beside, evidence = arguments.beside, arguments.evidence
    stored = read_list(beside) if beside else StoredRecordings(results, settings, evidence)
    state = read_project_state(Path(__file__).resolve().parents[2])
    checksums = page_inputs.read_checksums(arguments.code)
    durations = read_durations(results / "logs", tables.index["recording"], surveys["names"])
    page = {
        **page_values(tables, stored, settings, read_schema(arguments.schema), printed),
        "figures": page_inputs.read_figures(results / "figures"),
        "surveys": page_inputs.read_surveys(results / "surveys", **surveys),
        **how_made(checksums, versions, durations, datetime.datetime.now(datetime.UTC), state),
        "software": software_sentence(state, versions),
    }
    with files.write_whole(arguments.output) as stream:
        stream.writelines(render_page(page_inputs.read_frame(template), page))
    print(f"{arguments.output}: {arguments.output.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    files.run(main)
