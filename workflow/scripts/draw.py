"""Draw every figure for one and for two columns, as SVG and PDF, with its data as CSV."""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import files
from capsule.figures import preprocessing
from capsule.figures.gallery import drawings
from capsule.figures.style import COLUMN_WIDTH_IN, PAGE_WIDTH_IN, render_figure
from capsule.judgements import Evaluation
from capsule.naming import folder_size_mm
from results import read_accepted, read_evaluation, read_judgements, read_printed


def examples(
    evaluation: Evaluation, raw: Path, settings: dict
) -> Iterator[preprocessing.Example | None]:
    """Take a typical run without a nodule, and one over a nodule of the middle size."""
    nodules = evaluation.sizes_mm()[1:]
    rows = evaluation.predictions.drop_duplicates("recording")
    stages = {key: settings["preprocessing"][key] for key in ("window", "threshold")}
    rate_hz = settings["recording"]["rate_hz"]
    for size_mm in (0.0, nodules[(len(nodules) - 1) // 2] if nodules else None):
        of_size = rows[rows["size_mm"] == size_mm].set_index("recording")
        name = preprocessing.typical_recording(of_size["rmse_0mm"].to_dict())
        if name is None:
            yield None
            continue
        _, values = read_accepted(raw, name, settings)
        title = "no nodule" if size_mm == 0 else f"{size_mm:g} mm nodule"
        yield preprocessing.make_example(name, title, values, rate_hz=rate_hz, **stages)


def main() -> None:
    """Read the tables and templates, write the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--raw", type=Path, required=True, help="the folder of recordings")
    parser.add_argument("--evaluation", type=Path, required=True, help="the folder of tables")
    parser.add_argument("--templates", type=Path, required=True, help="templates.npz")
    parser.add_argument("--parameters", type=Path, required=True, help="templates.json")
    parser.add_argument("--paper", type=Path, required=True, help="paper.yaml")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: the folder of figures")
    arguments = parser.parse_args()
    settings, output = arguments.settings, arguments.output
    printed = read_printed(arguments.paper)
    evaluation = read_evaluation(
        arguments.evaluation, printed, settings["evaluation"]["confidence"]
    )
    with np.load(arguments.templates) as stored:
        templates = {folder_size_mm(label): matrix for label, matrix in stored.items()}
    entries = files.read_json(arguments.parameters)["templates"]
    counts = [entry["recordings"] for entry in entries]
    runs = list(examples(evaluation, arguments.raw, settings))
    judgements = read_judgements(arguments.evaluation)
    for name, table, draw in drawings(evaluation, judgements, runs, templates, counts, settings):
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
