"""Play a simulated run on a board that is not there, judge it live, and make its report."""

import argparse
from pathlib import Path

from acquisition import demo_run, output
from acquisition.bench_errors import INTERRUPTED, end_with_status
from edges import files
from edges.phantom import natural


def size(text: str) -> float:
    """Read a nodule size in mm."""
    value = float(text)
    if not 0 <= value <= 5:
        raise argparse.ArgumentTypeError(f"{text} mm is not within 0 to 5 mm")
    return value


def speed(text: str) -> float:
    """Read how much faster than a real run."""
    value = float(text)
    if not 0.5 <= value <= 100:
        raise argparse.ArgumentTypeError(f"{text} is not within 0.5 to 100")
    return value


def read_arguments() -> argparse.Namespace:
    """Read what to play."""
    parser = argparse.ArgumentParser(description=__doc__)
    add = parser.add_argument
    out = "the demo's own folder, never your raw/ (default: demo)"
    add("--out", type=Path, default=Path("demo"), metavar="FOLDER", help=out)
    faster = "how many times as fast as a real run (default: 5)"
    add("--speed", type=speed, default=5.0, metavar="X", help=faster)
    add("--size", type=size, default=3.0, metavar="MM", help="the nodule; 0: none (default: 3)")
    run = "which run: each seed simulates another one (default: the first not played yet)"
    add("--seed", type=natural, metavar="N", help=run)
    add("--plot", action="store_true", help="show the sensors in a window, if one can be opened")
    cores = "how many jobs of the report may run side by side (default: all)"
    add("--cores", default="all", metavar="N", help=cores)
    add("--no-open", dest="open", action="store_false", help="open no browser at the end")
    return parser.parse_args()


def main() -> None:
    """Play the demo; faults of the recorder have its exit status."""
    with end_with_status(INTERRUPTED):
        demo_run.demo(read_arguments())


if __name__ == "__main__":
    output.install()
    files.run(main)
