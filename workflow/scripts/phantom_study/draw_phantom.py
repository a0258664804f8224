"""Draw the figures of the phantom's documentation, and measure what the last of them shows."""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import simulate_run
from capsule.preprocessing import normalize, preprocess, rms_envelope
from edges import files
from edges.phantom import read_phantom
from phantom_study import description, drawings, sensitivity, simulated_archive
from phantom_study.arguments import detector_of

LEVELS = {
    "noise": (0, 1, 4, 8, 16, 32),
    "drift": (0, 0.25, 0.5, 1, 2, 4),
    "speed": (0.7, 0.85, 1, 1.25, 1.5, 2),
    "contact variation": (0, 0.5, 1, 1.5, 2, 3),
}


def draw_signals(phantom: Phantom, seed: int, settings: dict) -> Figure:
    """Draw, for some sizes, the run of twenty whose matrix holds the middling sum."""
    runs, titles, envelopes, matrices = [], [], [], []
    for size in (0, 2, 3, 4, 5):
        names = [f"{size}mm/r{number:02d}" for number in range(1, 21)]
        made = [simulate_run(phantom, size, seed, name) for name in names]
        each = [preprocess(run.counts.astype(np.float64), **settings) for run in made]
        middle = int(np.argsort([matrix.sum() for matrix in each])[len(each) // 2])
        runs.append(made[middle])
        titles.append(names[middle] if size else f"{names[middle]} (no nodule)")
        readings = made[middle].counts.astype(np.float64)
        envelopes.append(rms_envelope(normalize(readings), settings["window"]))
        matrices.append(each[middle])
    return drawings.signals(runs, titles, envelopes, matrices)


def describe(phantom: Phantom, detector: simulated_archive.Detector, seed: int) -> list[dict]:
    """Describe the runs and templates of one archive of 20 runs a size."""
    archive = simulated_archive.simulate_archive(phantom, seed, 20)
    matrices = simulated_archive.archive_matrices(archive, detector)
    return description.describe(
        archive, matrices, simulated_archive.learn(matrices, detector), phantom
    )


def measure(
    phantom: Phantom, detector: simulated_archive.Detector, archives: int, runs: int
) -> Iterator[dict]:
    """Give the rates at every level of each disturbance, with the calibrated bench's templates."""
    archive = simulated_archive.simulate_archive(phantom, 1, runs)
    templates = simulated_archive.learn(
        simulated_archive.archive_matrices(archive, detector), detector
    )
    seeds = range(1001, 1001 + archives)
    for variation, levels in LEVELS.items():
        for level in levels:
            bench = sensitivity.varied(phantom, variation, level)
            table = sensitivity.measure(bench, detector, templates, seeds, runs=runs)
            yield {"variation": variation, "level": level} | sensitivity.headline(table)
    for fault in sensitivity.FAULTS:
        table = sensitivity.measure(phantom, detector, templates, seeds, fault, runs)
        yield {"variation": "one faulty sensor", "level": fault} | sensitivity.headline(table)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say what this study takes."""
    parser.add_argument(
        "--table", type=Path, required=True, help="cells from study_phantom.py judge"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the signals shown (default: 1)")
    parser.add_argument("--archives", type=int, default=5, help="a level (default: 5)")
    parser.add_argument("--runs", type=int, default=20, help="a size and archive (default: 20)")
    parser.add_argument("--output", type=Path, required=True, help="folder of the figures")


def run(arguments: argparse.Namespace) -> None:
    """Write phantom-signals, phantom-table and phantom-sensitivity, as SVG; two also as CSV."""
    drawings.repeatable()
    phantom = read_phantom(arguments.parameters, arguments.changes)
    detector = detector_of(arguments.config)
    drawn = {"signals": draw_signals(phantom, arguments.seed, dict(detector.preprocessing))}
    described = describe(phantom, detector, arguments.seed)
    files.write_csv(arguments.output / "phantom-signals.csv", list(described[0]), described)
    drawn["table"] = drawings.cells(files.read_csv(arguments.table))
    rows = []
    for row in measure(
        phantom, simulated_archive.quick(detector), arguments.archives, arguments.runs
    ):
        rows.append(row)
        print(f"\rsensitivity: {row['variation']} {row['level']}  ", end="", file=sys.stderr)
    print(file=sys.stderr)
    files.write_csv(arguments.output / "phantom-sensitivity.csv", list(rows[0]), rows)
    drawn["sensitivity"] = drawings.sensitivity(rows)
    for name, figure in drawn.items():
        with files.write_whole(arguments.output / f"phantom-{name}.svg") as stream:
            figure.savefig(stream, format="svg", metadata={"Date": None})
