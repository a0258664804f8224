"""Draw a figure for one and for two columns, as SVG and PDF, with its data as CSV."""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from capsule.evaluation.beside_paper import Evaluation
from capsule.figures import gallery
from capsule.figures.draw_preprocessing import typical_recordings
from capsule.figures.style import COLUMN_WIDTH_IN, PAGE_WIDTH_IN, render_figure
from capsule.naming import folder_size_mm
from capsule.stages import PreprocessedRun, preprocess_run
from edges import files
from edges.results import read_evaluation, read_judgements, read_printed, read_signal


def examples(
    evaluation: Evaluation, signals: Path, settings: dict
) -> Iterator[PreprocessedRun | None]:
    """Read the typical runs of the archive."""
    stages = {key: settings["preprocessing"][key] for key in ("window", "threshold")}
    stages["rate_hz"] = settings["recording"]["rate_hz"]
    for title, name in typical_recordings(evaluation):
        yield preprocess_run(name, title, read_signal(signals, name), **stages) if name else None


def drawing(name: str, results: Path, paper: Path, settings: dict) -> gallery.Drawing:
    """Read what a figure shows, and no more: it may be drawn before the rest is there."""
    if name == "templates":
        with np.load(results / "templates.npz") as stored:
            templates = {folder_size_mm(label): matrix for label, matrix in stored.items()}
        entries = files.read_json(results / "templates.json")["templates"]
        return gallery.templates_drawing(templates, [entry["recordings"] for entry in entries])
    confidence = settings["evaluation"]["confidence"]
    evaluation = read_evaluation(results / "evaluation", read_printed(paper), confidence)
    if name == "preprocessing":
        runs = list(examples(evaluation, results / "signals", settings))
        return gallery.preprocessing_drawing(runs, settings)
    if name == "roc":
        judgements = read_judgements(results / "evaluation")
        return gallery.roc_drawing(evaluation, judgements, settings)
    return gallery.rates_drawing(name, evaluation, settings)


def main() -> None:
    """Read the tables or templates, write the figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--figure", required=True, help="which, such as detection")
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--paper", type=Path, required=True, help="paper.yaml")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: the folder of figures")
    arguments = parser.parse_args()
    name, output = arguments.figure, arguments.output
    table, draw = drawing(name, arguments.results, arguments.paper, arguments.settings)
    with files.write_whole(output / f"{name}.csv") as stream:
        table.to_csv(stream, index=False, lineterminator="\n")
    for width, suffix in ((PAGE_WIDTH_IN, ""), (COLUMN_WIDTH_IN, "_column")):
        figure = draw(width)
        for kind in ("svg", "pdf"):
            with files.write_whole(output / f"{name}{suffix}.{kind}", "wb") as stream:
                stream.write(render_figure(figure, kind, name + suffix))
    print(f"{name}: {len(table)} rows of data")


if __name__ == "__main__":
    files.run(main)
