"""Write the archives that judge_detectors.py judges, for detectors in an environment of their own.

    python tests/benchmarks/export_archives.py archives/

One file an archive, named by its seed, with the readings (S, K) of each recording of the bench as
configured, as ADC counts, by names such as 3mm_r07p1. peers/run_peers.py reads them.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

FOLDERS = [Path(__file__).parents[2] / "workflow" / each for each in ("scripts", "studies")]
sys.path[:0] = map(str, FOLDERS)

from judge_archive import simulate_archive
from judge_detectors import FIRST_SEED

from capsule.arguments import natural
from capsule.phantom.files import DEFAULT_TABLE, read_phantom


def main() -> None:
    """Simulate the archives and write them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="output: folder of the archives")
    parser.add_argument(
        "--archives", type=natural, default=60, metavar="N", help="how many (default: 60)"
    )
    parser.add_argument(
        "--parameters",
        type=Path,
        default=DEFAULT_TABLE,
        metavar="FILE",
        help="the phantom (default: config/phantom.yaml)",
    )
    arguments = parser.parse_args()
    phantom = read_phantom(arguments.parameters, [])
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for seed in range(FIRST_SEED, FIRST_SEED + arguments.archives):
        archive = simulate_archive(phantom, seed)
        readings = {each.name.replace("/", "_"): each.run.counts for each in archive}
        np.savez(arguments.folder / f"{seed}.npz", **readings)


if __name__ == "__main__":
    main()
