"""Play a simulated run without a board, judge it live, and make its report."""

import argparse
from pathlib import Path

from capsule import files
from capsule.bench import demo_run, output
from capsule.bench.bench_errors import INTERRUPTED, end_with_status
from capsule.number_arguments import natural, number_within


def read_arguments() -> argparse.Namespace:
    """Return the options."""
    parser = argparse.ArgumentParser(description=__doc__)
    add = parser.add_argument
    out = "the demo's own folder, never your raw/ (default: demo)"
    add("--out", type=Path, default=Path("demo"), metavar="FOLDER", help=out)
    faster = "speed relative to a real run (default: 5)"
    add("--speed", type=number_within(0.5, 100), default=5.0, metavar="X", help=faster)
    nodule = "nodule size; 0: no nodule (default: 3)"
    add("--size", type=number_within(0, 5, "mm"), default=3.0, metavar="MM", help=nodule)
    run = "random seed; each seed is another run (default: the first not played yet)"
    add("--seed", type=natural, metavar="N", help=run)
    add("--plot", action="store_true", help="show the sensors in a window, if one can be opened")
    cores = "number of jobs that run at the same time for the report (default: all)"
    add("--cores", default="all", metavar="N", help=cores)
    add("--no-open", dest="open", action="store_false", help="do not open a browser at the end")
    return parser.parse_args()


def main() -> None:
    """Play the demo; a fault of the recorder has the recorder's exit status."""
    with end_with_status(INTERRUPTED):
        demo_run.demo(read_arguments())


if __name__ == "__main__":
    output.install()
    files.run(main)
