"""Simulate recordings with the model of the paper's phantom, and write an archive like raw/."""

import argparse
import sys
from pathlib import Path

from capsule.commands.options import natural, number_within, plain_text
from capsule.engine.configuration import read_settings
from capsule.engine.project import config_file
from capsule.errors import CapsuleError
from capsule.phantom.files import add_phantom_arguments, read_phantom
from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import (
    PlannedRun,
    planned_runs,
    recording_of,
    simulate_run,
)
from capsule.recordings.recording import format_recording
from capsule.store import files


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the archive and the phantom."""
    add_phantom_arguments(parser)
    add = parser.add_argument
    output, sizes = Path("raw"), [0, 1, 2, 3, 4, 5]
    add("--out", type=Path, default=output, metavar="FOLDER", help="the archive (default: raw)")
    seed = "random seed; the same seed gives the same files (default: 1)"
    add("--seed", type=int, default=1, metavar="N", help=seed)
    runs = "runs of each size: one number, or one for each (default: 20)"
    add("--runs", type=natural, nargs="+", default=[20], metavar="N", help=runs)
    diameters = "nodule diameters in mm; 0: no nodule (default: 0 1 2 3 4 5)"
    millimetres = number_within(0, 20, "mm")
    add("--sizes", type=millimetres, nargs="+", default=sizes, metavar="MM", help=diameters)
    add("--passes", type=natural, default=1, metavar="N", help="passes per nodule (default: 1)")
    several = "set-ups of each size, with a draw of the bench each: one number, or one for each"
    several += " (default: 1)"
    add("--setups", type=natural, nargs="+", default=[1], metavar="N", help=several)
    first = "first characters of the recordings' names (default: r)"
    add("--prefix", type=plain_text, default="r", metavar="TEXT", help=first)
    configured = "recording.sensors of config/config.yaml"
    add("--sensors", type=natural, metavar="S", help=f"number of sensors (default: {configured})")
    add("--force", action="store_true", help="overwrite files that exist")


def main(arguments: argparse.Namespace) -> None:
    """Simulate the recordings, and write them.

    Raises
    ------
    CapsuleError
        A parameter is not allowed, or a recording exists.
    """
    phantom = read_phantom(arguments.parameters, arguments.changes, arguments.bench)
    configured = read_settings(config_file())["recording"]["sensors"]
    sensors = arguments.sensors or configured
    runs = planned_runs(
        arguments.sizes, arguments.runs, arguments.passes, arguments.setups, arguments.prefix
    )
    planned = {arguments.out / f"{run.name}.csv": run for run in runs}
    existing = [path for path in planned if path.exists()]
    if existing and not arguments.force:
        more = f" (as do {len(existing) - 1} more)" if len(existing) > 1 else ""
        raise CapsuleError(
            f"{existing[0]} exists{more}; nothing was written. Choose another --out, or overwrite "
            "with --force"
        )
    for done, (path, run) in enumerate(planned.items(), start=1):
        write_run(path, run, phantom, arguments.seed, sensors, arguments.bench)
        if sys.stderr.isatty() or done == len(planned):
            text = f"\rsimulated {done} of {len(planned)} recordings in {arguments.out}/"
            end = "\n" if done == len(planned) else ""
            print(text, end=end, file=sys.stderr, flush=True)


def write_run(
    path: Path,
    run: PlannedRun,
    phantom: Phantom,
    seed: int,
    sensors: int,
    bench: str | None = None,
) -> None:
    """Simulate a run of an archive, and write its recording."""
    made = simulate_run(phantom, run.size_mm, seed, run.site, run.attempt, sensors, run.setup)
    recording = recording_of(made, phantom, seed, run.site, bench, run.setup)
    with files.write_whole(path, "wb") as stream:
        stream.write(format_recording(recording))
