"""Write results/report.html: one page that opens from disk, with no network."""

import argparse
import datetime
import hashlib
import importlib.metadata
import json
import platform
from collections.abc import Iterator
from pathlib import Path

import pandas as pd

import files
from capsule.naming import size_mm
from capsule.report import (
    comparison,
    evidence,
    judged,
    overview,
    places,
    provenance,
    recordings,
    tables,
    words,
)
from capsule.report.page import image_address, render_page
from capsule.stages import make_example
from durations import read_durations
from results import read_evaluation, read_fit, read_judgements, read_printed, read_signal

FIGURES = ("detection", "negatives", "sizing", "confusion", "roc", "templates", "preprocessing")
PACKAGES = ("snakemake", "numpy", "scipy", "pandas", "matplotlib", "jinja2")
STYLES = ("vendor/uplot/uPlot.min.css", "report.css")
SCRIPTS = ("vendor/uplot/uPlot.iife.min.js", "signals.js", "viewer.js", "recordings.js")


def evidence_of(
    rows: dict, verdicts: dict, results: Path, settings: dict
) -> Iterator[tuple[str, str]]:
    """Give each accepted recording's name and what the page carries of it."""
    shape, rate_hz = settings["preprocessing"], settings["recording"]["rate_hz"]
    stages = {"window": shape["window"], "threshold": shape["threshold"]}
    samples = sum(row["samples"] for row in rows.values() if row["accepted"])
    step = evidence.reading_step(samples * settings["recording"]["sensors"])
    for name, row in rows.items():
        if not row["accepted"]:
            continue
        values = read_signal(results / "signals", name)
        title = recordings.title(rows[name])
        run = make_example(name, title, values, rate_hz=rate_hz, **stages)
        found = read_fit(results / "fits" / f"{name}.json") if size_mm(name) else None
        fitted, facts = None, {"File": f"raw/{name}.csv", "SHA-256": row["sha256"]}
        if found:
            fit, particle = found
            fitted = evidence.fitted_matrix(
                particle, fit["first_peak"], fit["lag"], values.shape[1], shape["length"]
            )
            facts["Fit"] = provenance.fit_words(fit)
        header = files.read_json(results / "checks" / f"{name}.json")["header"]
        facts |= {f"# {key}": text for key, text in header.items()}
        said = verdicts.get(name, [])
        content = evidence.recording_evidence(run, shape["threshold"], step, fitted, said, facts)
        yield name, evidence.to_json(content)


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
    printed = read_printed(folder / "paper.yaml")
    evaluation = read_evaluation(
        results / "evaluation", printed, settings["evaluation"]["confidence"]
    )
    judgements = read_judgements(results / "evaluation")
    index = pd.read_csv(results / "recordings.csv")
    detections = pd.read_csv(results / "detections.csv")
    verdicts = recordings.verdicts_by_recording(evaluation.predictions, detections)
    code = {str(path): hashlib.sha256(path.read_bytes()).hexdigest() for path in arguments.code}
    configuration = provenance.configuration_table(
        settings, files.read_json(arguments.schema), printed["settings"]
    )
    said = judged.judgement(evaluation, index, verdicts, settings, printed)
    rows = {row["recording"]: row for row in said["recordings"]}
    page = {
        **overview.overview(index, pd.read_csv(results / "passed_over.csv")),
        **said,
        **comparison.page_values(judgements, settings),
        "places": places.place_rows(pd.read_csv(results / "sites.csv")),
        "retest": places.retest_rows(judgements["retest"]),
        "templates": tables.template_rows(files.read_json(results / "templates.json")["templates"]),
        "detections": tables.detection_rows(detections),
        "evidence": list(evidence_of(rows, verdicts, results, settings)),
        "figures": {
            name: {
                width: image_address((results / "figures" / f"{name}{suffix}.svg").read_bytes())
                for width, suffix in (("wide", ""), ("narrow", "_column"))
            }
            for name in FIGURES
        },
        "configuration": configuration,
        "differences": provenance.differences(configuration),
        "versions": [("Python", platform.python_version())]
        + [(name, importlib.metadata.version(name)) for name in PACKAGES],
        "code_checksum": provenance.combined_checksum(code),
        "times": [
            row | {"seconds": words.duration(row["seconds"])}
            for row in read_durations(results / "logs", list(index["recording"]), FIGURES)
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
