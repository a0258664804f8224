"""Simulate recordings with the model of the paper's phantom, and write an archive like raw/."""

import argparse
import sys
from pathlib import Path

from capsule import files
from capsule.configuration_files import read_config_file
from capsule.errors import CapsuleError
from capsule.number_arguments import natural, number_within
from capsule.phantom.files import phantom_arguments, read_phantom
from capsule.phantom.simulation import planned_runs, recording_of, simulate_run
from capsule.project import CONFIG
from capsule.recording import format_recording


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
    output = {"type": Path, "metavar": "FOLDER", "default": Path("raw")}
    add("--out", **output, help="output: the archive (default: raw)")
    add("--seed", **seed, help="random seed; the same seed gives the same files (default: 1)")
    add("--runs", type=natural, default=20, metavar="N", help="runs of each size (default: 20)")
    add("--sizes", **sizes, help="nodule diameters in mm; 0: no nodule (default: 0 1 2 3 4 5)")
    add("--passes", type=natural, default=1, metavar="N", help="passes per nodule (default: 1)")
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
    planned = {
        arguments.out / f"{run.name}.csv": run
        for run in planned_runs(arguments.sizes, arguments.runs, arguments.passes)
    }
    existing = [path for path in planned if path.exists()]
    if existing and not arguments.force:
        raise CapsuleError(
            f"{existing[0]} exists (as do {len(existing) - 1} more); nothing was written. "
            "Choose another --out, or overwrite with --force"
        )
    for done, (path, run) in enumerate(planned.items(), start=1):
        simulated = simulate_run(
            phantom, run.size_mm, arguments.seed, run.site, run.attempt, sensors
        )
        content = format_recording(
            recording_of(simulated, phantom, arguments.seed, run.site, arguments.bench)
        )
        with files.write_whole(path, "wb") as stream:
            stream.write(content)
        if sys.stderr.isatty() or done == len(planned):
            text = f"\rsimulated {done} of {len(planned)} recordings in {arguments.out}/"
            end = "\n" if done == len(planned) else ""
            print(text, end=end, file=sys.stderr, flush=True)


if __name__ == "__main__":
    files.run(main)
