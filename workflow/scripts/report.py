"""Write results/report.html: one page that opens from disk, with no network."""

import argparse
import datetime
import hashlib
import importlib.metadata
import json
import platform
from functools import partial
from pathlib import Path

import pandas as pd

from capsule import words
from capsule.figures.registry import FIGURES
from capsule.page import evidence, provenance, recordings, sections
from capsule.page.render import image_address, render_page
from edges import files
from edges.config_files import read_schema
from edges.durations import read_durations
from edges.results import read_evaluation, read_fit, read_judgements, read_printed, read_signal

PACKAGES = ("snakemake", "numpy", "scipy", "pandas", "matplotlib", "jinja2")
STYLES = ("vendor/uplot/uPlot.min.css", "report.css")
SCRIPTS = ("vendor/uplot/uPlot.iife.min.js", "signals.js", "viewer.js", "recordings.js")


def read_tables(results: Path, printed: dict, confidence: float) -> sections.Tables:
    """Read the tables that the page shows."""
    evaluation = results / "evaluation"
    return sections.Tables(
        index=pd.read_csv(results / "recordings.csv"),
        passed_over=pd.read_csv(results / "passed_over.csv"),
        detections=pd.read_csv(results / "detections.csv"),
        sites=pd.read_csv(results / "sites.csv"),
        templates=files.read_json(results / "templates.json")["templates"],
        evaluation=read_evaluation(evaluation, printed, confidence),
        judgements=read_judgements(evaluation),
    )


def read_stored(results: Path, name: str) -> evidence.Stored:
    """Read what the stages before have stored of an accepted recording."""
    header = files.read_json(results / "checks" / f"{name}.json")["header"]
    values = read_signal(results / "signals", name)
    return evidence.Stored(values, header, read_fit(results / "fits" / f"{name}.json"))


def read_figures(folder: Path) -> dict[str, dict[str, str]]:
    """Read each figure at the width of a page and of a column, as addresses of images."""
    return {
        name: {
            width: image_address((folder / f"{name}{suffix}.svg").read_bytes())
            for width, suffix in (("wide", ""), ("narrow", "_column"))
        }
        for name in FIGURES
    }


def main() -> None:
    """Read everything that was made, write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--template", type=Path, required=True, help="the folder of the template")
    parser.add_argument("--schema", type=Path, required=True, help="the schema of the config")
    parser.add_argument("--settings", type=json.loads, required=True, help="the config, JSON")
    parser.add_argument("--code", type=Path, nargs="+", required=True, help="the files of the code")
    parser.add_argument("--output", type=Path, required=True, help="output: the page")
    arguments = parser.parse_args()
    results, settings, folder = arguments.results, arguments.settings, arguments.template
    printed, schema = read_printed(folder / "paper.yaml"), read_schema(arguments.schema)
    found = read_tables(results, printed, settings["evaluation"]["confidence"])
    verdicts = recordings.verdicts_by_recording(found.evaluation.predictions, found.detections)
    content = sections.page_values(found, verdicts, settings, schema, printed)
    load = partial(read_stored, results)
    carried = evidence.archive_evidence(content["recordings"], verdicts, load, settings)
    code = {str(path): hashlib.sha256(path.read_bytes()).hexdigest() for path in arguments.code}
    page = content | {
        "evidence": list(carried),
        "figures": read_figures(results / "figures"),
        "versions": [("Python", platform.python_version())]
        + [(name, importlib.metadata.version(name)) for name in PACKAGES],
        "code_checksum": provenance.combined_checksum(code),
        "times": [
            row | {"seconds": words.duration(row["seconds"])}
            for row in read_durations(results / "logs", list(found.index["recording"]), FIGURES)
        ],
        "made": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
    }
    style, script = (
        "\n".join((folder / name).read_text(encoding="utf-8") for name in names)
        for names in (STYLES, SCRIPTS)
    )
    template = (folder / "report.html.j2").read_text(encoding="utf-8")
    with files.write_whole(arguments.output) as stream:
        stream.write(render_page(template, style, script, page))
    print(f"{arguments.output}: {arguments.output.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    files.run(main)
