"""Import files with bytes changed at random, and print what came of each format's files.

    python tests/benchmarks/fuzz_import.py --number 300

Each file is imported in a process of its own. A traceback, more than 1 GB of memory or more than
5 s is a fault; the file is kept, and the exit status is 1.
"""

import argparse
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "workflow" / "scripts"), str(ROOT / "tests")]

from support.damaged_files import damaged, given_path, write_each_format
from support.importing import import_files

MOST_BYTES = 1_000_000_000
MOST_SECONDS = 5.0
# A process that exceeds the limits by far is ended.
_END_BYTES, _END_SECONDS = 4 * MOST_BYTES, 4 * int(MOST_SECONDS)
_OUTCOMES = ("imported", "refused", "traceback", "too large", "too slow")


def import_apart(given: Path, folder: Path) -> tuple[str, float, int]:
    """Import a file in a process of its own.

    Returns
    -------
    outcome : str
        One of ``imported``, ``refused``, ``traceback``, ``too large``, ``too slow``.
    seconds : float
        Time that it took.
    most_bytes : int
        Largest memory of the process.
    """
    start = time.monotonic()
    child = os.fork()
    if child == 0:
        _import_and_exit(given, folder)
    _, status, used = os.wait4(child, 0)
    seconds, most_bytes = time.monotonic() - start, used.ru_maxrss * 1024
    if seconds > MOST_SECONDS:
        return "too slow", seconds, most_bytes
    if most_bytes > MOST_BYTES:
        return "too large", seconds, most_bytes
    outcome = {0: "imported", 1: "refused"}.get(os.waitstatus_to_exitcode(status), "traceback")
    return outcome, seconds, most_bytes


def _import_and_exit(given: Path, folder: Path) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (_END_BYTES, _END_BYTES))
    signal.alarm(_END_SECONDS)
    try:  # the process ends here, unless there is an exception
        os._exit(import_files(folder, given, "--dry-run").status)
    finally:
        (folder / "traceback.txt").write_text(traceback.format_exc())
        os._exit(2)


def main() -> None:
    """Import the given number of damaged files of each format, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--number", type=int, default=100, help="damaged files of each format")
    parser.add_argument("--seed", type=int, default=1, help="seed of the random changes")
    parser.add_argument("--only", nargs="+", metavar="ENDING", help="formats, such as .h5")
    parser.add_argument("--keep", type=Path, default=Path("fuzzed"), help="folder of the faults")
    options = parser.parse_args()
    faults = 0
    print(f"{'format':9}", *(f"{name:>10}" for name in (*_OUTCOMES, "most MB", "most s")))
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for ending, file in write_each_format(folder).items():
            if options.only and ending not in options.only:
                continue
            whole, rng = file.read_bytes(), np.random.default_rng([options.seed, len(ending)])
            outcomes, most_bytes, longest = Counter[str](), 0, 0.0
            for number in range(options.number):
                file.write_bytes(damaged(whole, rng))
                outcome, seconds, used = import_apart(given_path(file), folder)
                outcomes[outcome] += 1
                most_bytes, longest = max(most_bytes, used), max(longest, seconds)
                if outcome not in ("imported", "refused"):
                    faults += 1
                    _keep(options.keep, file, folder, f"{number}-{outcome.replace(' ', '-')}")
            file.write_bytes(whole)
            counts = [f"{outcomes[name]:10}" for name in _OUTCOMES]
            print(
                f"{ending:9}", *counts, f"{most_bytes / 1e6:10.0f}", f"{longest:10.2f}", flush=True
            )
    sys.exit(1 if faults else 0)


def _keep(kept: Path, file: Path, folder: Path, name: str) -> None:
    kept.mkdir(exist_ok=True)
    (kept / f"{name}-{file.name}").write_bytes(file.read_bytes())
    told = folder / "traceback.txt"
    if told.exists():
        told.rename(kept / f"{name}-{file.name}.txt")


if __name__ == "__main__":
    main()
