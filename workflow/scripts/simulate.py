"""Make simulated recordings: an archive as raw/ holds it, from the model of the paper's phantom."""

import argparse
import sys
from pathlib import Path

import yaml

from capsule.errors import CapsuleError
from capsule.phantom.parameters import Phantom, phantom_from_table, with_values
from capsule.phantom.simulation import recording_of, simulate_run
from capsule.recording import format_recording
from files import run, write_whole

DEFAULT_TABLE = Path(__file__).resolve().parents[2] / "config" / "phantom.yaml"


def read_phantom(table: Path, changes: list[str]) -> Phantom:
    """Read the table of parameters and apply the changes ``part.parameter=value``."""
    try:
        phantom = phantom_from_table(yaml.safe_load(table.read_text(encoding="utf-8")))
    except (yaml.YAMLError, CapsuleError) as error:
        raise CapsuleError(f"{table}: {error}") from error
    values = {}
    for change in changes:
        name, _, text = change.partition("=")
        try:
            values[name] = float(text)
        except ValueError:
            raise CapsuleError(
                f"--set {change}: write part.parameter=number, such as sensor.noise=0.01"
            ) from None
    return with_values(phantom, values)


def plan(
    out: Path, sizes: list[float], runs: int, passes: int
) -> list[tuple[Path, str, float, str]]:
    """List the files to make: path, site, nodule size and pass."""
    files = []
    for size in sizes:
        for number in range(1, runs + 1):
            site = f"{size:g}mm/r{number:02d}"
            for attempt in range(1, passes + 1):
                suffix = f"p{attempt}" if passes > 1 else ""
                files.append((out / f"{site}{suffix}.csv", site, size, str(attempt)))
    return files


def natural(text: str) -> int:
    """Read a whole number of at least 1."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is less than 1")
    return value


def size(text: str) -> float:
    """Read a nodule size in mm."""
    value = float(text)
    if not 0 <= value <= 20:
        raise argparse.ArgumentTypeError(f"{text} mm does not fit into the gut (0..20 mm)")
    return value


def main() -> None:
    """Make the files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("raw"), help="folder (default: raw)")
    parser.add_argument("--seed", type=int, default=1, help="same seed, same bytes (default: 1)")
    parser.add_argument("--runs", type=natural, default=20, help="runs a size (default: 20)")
    parser.add_argument(
        "--sizes",
        type=size,
        nargs="+",
        default=[0, 1, 2, 3, 4, 5],
        metavar="MM",
        help="nodule diameters in mm, 0 for none (default: 0 1 2 3 4 5)",
    )
    parser.add_argument(
        "--passes",
        type=natural,
        default=1,
        help="passes over each nodule; '# site:' names the place (default: 1)",
    )
    parser.add_argument(
        "--parameters",
        type=Path,
        default=DEFAULT_TABLE,
        help="table of the phantom's parameters (default: config/phantom.yaml)",
    )
    parser.add_argument(
        "--set",
        dest="changes",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="change a parameter, such as sensor.noise=0.01; may be repeated",
    )
    parser.add_argument("--force", action="store_true", help="overwrite files that exist")
    arguments = parser.parse_args()

    phantom = read_phantom(arguments.parameters, arguments.changes)
    files = plan(arguments.out, arguments.sizes, arguments.runs, arguments.passes)
    existing = [path for path, *_ in files if path.exists()]
    if existing and not arguments.force:
        raise CapsuleError(
            f"{existing[0]} exists (as do {len(existing) - 1} more); nothing was written. "
            "Choose another --out, or overwrite with --force"
        )
    for done, (path, site, nodule_mm, attempt) in enumerate(files, start=1):
        simulated = simulate_run(phantom, nodule_mm, arguments.seed, site, attempt)
        content = format_recording(recording_of(simulated, phantom, arguments.seed, site))
        with write_whole(path, "wb") as stream:
            stream.write(content)
        if sys.stderr.isatty() or done == len(files):
            print(
                f"\rsimulated {done} of {len(files)} recordings in {arguments.out}/",
                end="\n" if done == len(files) else "",
                file=sys.stderr,
                flush=True,
            )


if __name__ == "__main__":
    run(main)
