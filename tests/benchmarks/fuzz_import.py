"""Import files with bytes changed at random, and print what came of each format's files.

    python tests/benchmarks/fuzz_import.py --number 300

A traceback, more than 1 GB of memory or more than 5 s of a processor is a fault; the file is kept,
and the exit status is 1. A crash ends the benchmark; its file is left in the temporary folder.
"""

import argparse
import contextlib
import io
import resource
import shutil
import signal
import sys
import tempfile
import traceback
from collections import Counter
from pathlib import Path

import numpy as np
from tables import table

from capsule.commands.cli import build_parser
from capsule.commands.options import natural
from capsule.engine.configuration import read_settings
from capsule.importing.command import Importer
from support.damaged_files import damaged, given_path, write_each_format

MOST_BYTES = 1_000_000_000
MOST_SECONDS = 5
OUTCOMES = ("imported", "refused")
FAULTS = ("traceback", "too large", "too slow")


def import_measured(importer: Importer) -> tuple[str, float, int]:
    """Return what came of an import, seconds of a processor, and the largest memory so far."""
    before = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    signal.setitimer(signal.ITIMER_PROF, 4 * MOST_SECONDS)  # ends this process
    outcome = (*OUTCOMES, "traceback")[_import(importer)]
    signal.setitimer(signal.ITIMER_PROF, 0)
    after = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = sum(sum(now[:2]) - sum(then[:2]) for now, then in zip(after, before, strict=True))
    most_bytes = 1024 * max(each.ru_maxrss for each in after)
    if outcome in OUTCOMES and most_bytes > MOST_BYTES:
        outcome = "too large"
    if outcome in OUTCOMES and seconds > MOST_SECONDS:
        outcome = "too slow"
    return outcome, seconds, most_bytes


def _import(importer: Importer) -> int:
    """Return 0 if a file was imported, 1 if it was refused, 2 after a traceback, which is shown."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        try:
            importer.run()
        except BaseException:  # noqa: BLE001 (any traceback is a fault)
            traceback.print_exc(file=sys.__stderr__)
            return 2
    return int(importer.refused > 0)


def main() -> None:
    """Import the given number of damaged files of each format, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--number", type=natural, default=100, help="damaged files of each format")
    parser.add_argument("--seed", type=int, default=1, help="seed of the random changes")
    parser.add_argument("--only", nargs="+", metavar="ENDING", help="formats, such as .h5")
    parser.add_argument("--keep", type=Path, default=Path("fuzzed"), help="folder of the faults")
    options = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_AS, (4 * MOST_BYTES, 4 * MOST_BYTES))
    rows, faults = [], 0
    with tempfile.TemporaryDirectory() as temporary:
        for place, (ending, file) in enumerate(write_each_format(Path(temporary)).items()):
            if options.only and ending not in options.only:
                continue
            raw = str(file.parent / "raw")
            words = ["import", str(given_path(file)), "--size=3", "--dry-run", "--raw", raw]
            given = build_parser(["import"]).parse_args(words), read_settings()
            assert _import(Importer(*given)) == 0, "the whole file comes in"
            whole, counted, longest, most = file.read_bytes(), Counter[str](), 0.0, 0
            for number in range(options.number):
                numbers = np.random.default_rng([options.seed, place, number])
                file.write_bytes(damaged(whole, numbers))
                outcome, seconds, used = import_measured(Importer(*given))
                if outcome in FAULTS:
                    options.keep.mkdir(exist_ok=True)
                    name = f"{number}-{outcome.replace(' ', '-')}-{file.name}"
                    shutil.copyfile(file, options.keep / name)
                counted[outcome] += 1
                longest, most = max(longest, seconds), max(most, used)
            cells = {outcome: str(counted[outcome]) for outcome in (*OUTCOMES, *FAULTS)}
            costs = {"most MB": f"{most / 1e6:.0f}", "most s": f"{longest:.2f}"}
            rows.append({"format": ending} | cells | costs)
            faults += sum(counted[fault] for fault in FAULTS)
            print(f"{ending}: {counted.total()}", file=sys.stderr, flush=True)
    print(table(rows))
    sys.exit(faults > 0)


if __name__ == "__main__":
    main()
