"""Write results/report.html: one page that opens from disk, with no network."""

import argparse
import datetime
import hashlib
import importlib.metadata
import json
import platform
from pathlib import Path

import pandas as pd

import files
from capsule.report import context, provenance, tables, words
from capsule.report.page import image_address, render_page
from results import Evaluation, read_evaluation, read_printed

FIGURES = ("detection", "negatives", "sizing", "confusion", "templates", "preprocessing")
PACKAGES = ("snakemake", "numpy", "scipy", "pandas", "matplotlib", "jinja2")
RULES = ("preprocess", "index", "fit", "average", "evaluate", "detect", "draw")


def results_of(evaluation: Evaluation, settings: dict, printed: dict) -> list[dict]:
    """Give each detector's answers and tables; the first is the paper's method."""
    sizes_mm, judged = evaluation.sizes_mm(), settings["evaluation"]
    scheme = context.RESULT if context.RESULT in judged["schemes"] else judged["schemes"][0]
    found = []
    for detector in evaluation.detectors():
        both = {name: evaluation.of(name, detector, with_paper=True) for name in evaluation.tables}
        ours = {name: table[table["scheme"] == scheme] for name, table in both.items()}
        verdicts = evaluation.predictions.query("detector == @detector and scheme == @scheme")
        found.append(
            {
                "detector": detector,
                "scheme": words.scheme(scheme),
                "cards": context.answer_cards(
                    ours, evaluation.paper, verdicts, settings, printed["sizing_tolerance_mm"]
                ),
                **context.rate_tables(
                    both["detection"], both["sizing"], both["confusion"], sizes_mm, judged
                ),
                "confusions": [
                    {
                        "title": words.scheme(name),
                        "rows": tables.confusion_rows(both["confusion"], name, sizes_mm),
                    }
                    for name in judged["schemes"]
                ],
            }
        )
    return found


def durations(logs: Path, recordings: list[str]) -> list[dict]:
    """Add up how long each rule's scripts took, from the last lines of their logs."""
    rows = []
    for rule in RULES:
        single = logs / f"{rule}.log"
        paths = [single] if single.exists() else [logs / rule / f"{n}.log" for n in recordings]
        read = [path.read_text(encoding="utf-8") for path in paths if path.exists()]
        seconds = [s for s in map(provenance.seconds_in_log, read) if s is not None]
        if seconds:
            total = words.duration(sum(seconds))
            rows.append({"rule": rule, "jobs": len(seconds), "seconds": total})
    return rows


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
    results, settings = arguments.results, arguments.settings
    printed = read_printed(arguments.template / "paper.yaml")
    evaluation = read_evaluation(
        results / "evaluation", printed, settings["evaluation"]["confidence"]
    )
    index = pd.read_csv(results / "recordings.csv")
    checksums = dict(zip(index["recording"], index["sha256"].fillna(""), strict=True))
    code = {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(arguments.code)
    }
    found = context.overview(index, pd.read_csv(results / "passed_over.csv"))
    judged = results_of(evaluation, settings, printed)
    page = {
        **found,
        "summary": context.summary(
            found["origin"]["kind"], found["accepted"], judged[0]["cards"], settings["evaluation"]
        ),
        "results": judged,
        "sizes": [words.size(size_mm) for size_mm in evaluation.sizes_mm()],
        "templates": tables.template_rows(files.read_json(results / "templates.json")["templates"]),
        "detections": tables.detection_rows(pd.read_csv(results / "detections.csv")),
        "figures": {
            name: {
                "wide": image_address((results / "figures" / f"{name}.svg").read_bytes()),
                "narrow": image_address((results / "figures" / f"{name}_column.svg").read_bytes()),
            }
            for name in FIGURES
        },
        "paper": printed,
        "confidence": words.percent(settings["evaluation"]["confidence"]),
        "configuration": provenance.configuration_table(
            settings, files.read_json(arguments.schema), printed["settings"]
        ),
        "versions": [("Python", platform.python_version())]
        + [(name, importlib.metadata.version(name)) for name in PACKAGES],
        "checksums": {
            "recordings": provenance.combined_checksum(checksums),
            "code": provenance.combined_checksum(code),
        },
        "seed": settings["fit"]["seed"],
        "times": durations(results / "logs", list(index["recording"])),
        "made": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
    }
    parts = [
        (arguments.template / name).read_text(encoding="utf-8")
        for name in ("report.html.j2", "report.css", "report.js")
    ]
    with files.write_whole(arguments.output) as stream:
        stream.write(render_page(*parts, {"page": page}))
    print(f"{arguments.output}: {arguments.output.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    files.run(main)
