"""Simulate recordings with the model of the paper's phantom, and write an archive like raw/."""

import argparse
import sys
from pathlib import Path

from capsule import files
from capsule.configuration_files import read_config_file
from capsule.errors import CapsuleError
from capsule.number_arguments import natural, number_within, plain_text
from capsule.phantom.files import phantom_arguments, read_phantom, write_run
from capsule.phantom.simulation import planned_runs
from capsule.project import CONFIG


def read_arguments() -> argparse.Namespace:
    """Return the options."""
    parser = argparse.ArgumentParser(description=__doc__, parents=[phantom_arguments()])
    add = parser.add_argument
    sizes = {
        "type": number_within(0, 20, "mm"),
        "nargs": "+",
        "metavar": "MM",
        "default": [0, 1, 2, 3, 4, 5],
    }
    seed = {"type": int, "metavar": "N", "default": 1}
    runs = {"type": natural, "nargs": "+", "metavar": "N", "default": [20]}
    setups = {"type": natural, "nargs": "+", "metavar": "N", "default": [1]}
    output = {"type": Path, "metavar": "FOLDER", "default": Path("raw")}
    add("--out", **output, help="output: the archive (default: raw)")
    add("--seed", **seed, help="random seed; the same seed gives the same files (default: 1)")
    add("--runs", **runs, help="runs of each size: one number, or one for each (default: 20)")
    add("--sizes", **sizes, help="nodule diameters in mm; 0: no nodule (default: 0 1 2 3 4 5)")
    add("--passes", type=natural, default=1, metavar="N", help="passes per nodule (default: 1)")
    several = "set-ups of each size, with a draw of the bench each: one number, or one for each"
    add("--setups", **setups, help=f"{several} (default: 1)")
    first = "first characters of the recordings' names (default: r)"
    add("--prefix", type=plain_text, default="r", metavar="TEXT", help=first)
    configured = "recording.sensors of config/config.yaml"
    add("--sensors", type=natural, metavar="S", help=f"number of sensors (default: {configured})")
    add("--force", action="store_true", help="overwrite files that exist")
    return parser.parse_args()


def main() -> None:
    """Simulate the recordings, and write them."""
    arguments = read_arguments()
    phantom = read_phantom(arguments.parameters, arguments.changes, arguments.bench)
    configured = read_config_file(CONFIG / "config.yaml")["recording"]["sensors"]
    sensors = arguments.sensors or configured
    runs = planned_runs(
        arguments.sizes, arguments.runs, arguments.passes, arguments.setups, arguments.prefix
    )
    planned = {arguments.out / f"{run.name}.csv": run for run in runs}
    existing = [path for path in planned if path.exists()]
    if existing and not arguments.force:
        raise CapsuleError(
            f"{existing[0]} exists (as do {len(existing) - 1} more); nothing was written. "
            "Choose another --out, or overwrite with --force"
        )
    for done, (path, run) in enumerate(planned.items(), start=1):
        write_run(path, run, phantom, arguments.seed, sensors, arguments.bench)
        if sys.stderr.isatty() or done == len(planned):
            text = f"\rsimulated {done} of {len(planned)} recordings in {arguments.out}/"
            end = "\n" if done == len(planned) else ""
            print(text, end=end, file=sys.stderr, flush=True)


if __name__ == "__main__":
    files.run(main)
