"""Write results/report.html, a page that needs no network."""

import argparse
import datetime
import json
from functools import partial
from pathlib import Path

from capsule.engine.jobs import run
from capsule.engine.project import PROJECT, read_project_state
from capsule.page import files as page_files
from capsule.page.provenance import how_made
from capsule.page.render import render_page
from capsule.page.sections import page_values
from capsule.store import files
from capsule.store.results import OfArchive


def main() -> None:
    """Read all results, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--settings", type=json.loads, required=True, help="the config, JSON")
    parser.add_argument("--key", required=True, help="the key of this job, for the page's head")
    parser.add_argument("--output", type=Path, required=True, help="output: the page")
    arguments = parser.parse_args()
    settings, folder, template = arguments.settings, arguments.results, PROJECT / "workflow/report"
    surveys = settings.pop("surveys")
    tables = page_files.read_tables(folder, template, settings)
    versions = page_files.read_versions(template)
    state, made = read_project_state(PROJECT), datetime.datetime.now(datetime.UTC)
    page = {
        **page_values(tables),
        "figure": partial(page_files.read_figure, folder / OfArchive.FIGURES),
        "shipped_figure": partial(page_files.read_figure, template / "figures"),
        "surveys": page_files.read_surveys(folder / OfArchive.SURVEYS, **surveys),
        **how_made(page_files.code_checksums(), versions, made, state),
        "key": arguments.key,
    }
    with files.write_whole(arguments.output) as stream:
        stream.writelines(render_page(*page_files.read_frame(template), page))
    print(f"{arguments.output}: {arguments.output.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    run(main)
