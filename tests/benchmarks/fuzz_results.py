"""Damage results at random, and print what each command and job that reads them answered.

    python tests/benchmarks/fuzz_results.py --project FOLDER --other FOLDER --number 100

FOLDER is the folder of a finished project, `--other` that of another archive, whose files take the
place of the first one's. Each call runs in a fork and writes nothing. A traceback, an answer that
does not name file and remedy in one line, more than 1 GB or more than 5 s is a fault; the damaged
file is kept, and the exit status is 1.
"""

import argparse
import os
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "workflow" / "scripts"), str(ROOT / "tests")]

from support.damaged_results import KINDS, call, change, read_files, readers


def main() -> None:
    """Damage each kind of file for each reader, and print a line for each pair."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--project", type=Path, required=True, help="a finished project")
    parser.add_argument("--other", type=Path, required=True, help="that of another archive")
    parser.add_argument("--number", type=int, default=100, help="damaged files of each kind")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="most for each pair")
    parser.add_argument("--seed", type=int, default=1, help="seed of the random changes")
    parser.add_argument("--only", nargs="+", metavar="READER", help="readers, such as judge")
    parser.add_argument("--keep", type=Path, default=Path("fuzzed"), help="folder of the faults")
    options = parser.parse_args()
    other, kept = options.other.resolve() / "results", options.keep.resolve()
    os.chdir(options.project)
    called = readers(Path.cwd())
    if unknown := sorted(set(options.only or ()) - called.keys()):
        parser.error(f"there is no reader {unknown[0]}; the readers are {', '.join(called)}")
    if options.only:
        called = {name: called[name] for name in options.only}
    faults: Counter[str] = Counter()
    for name, usual_s, opened in read_files(called):
        for kind, file in opened.items():
            path = Path(file)
            beside = other / path.relative_to("results")
            whole = path.read_bytes()
            swapped = beside.read_bytes() if beside.exists() else whole[::-1]
            rng, counts, most_s = np.random.default_rng(options.seed), Counter[str](), 0.0
            end_s = time.monotonic() + options.seconds
            for number in range(options.number):
                if time.monotonic() > end_s:
                    break
                how = KINDS[number % len(KINDS)]
                path.write_bytes(content := change(whole, swapped, how, rng))
                outcome = call(called[name])
                most_s = max(most_s, outcome.seconds)
                fault = outcome.fault(file, usual_s)
                counts["fault" if fault else "refused" if outcome.status else "taken"] += 1
                if fault:
                    # The last line tells the error, and those above it where.
                    last = " | ".join(
                        line.strip()[:150] for line in fault.strip().splitlines()[-3:]
                    )
                    faults[f"{name}: {kind}: {last}"] += 1
                    kept.mkdir(exist_ok=True)
                    of = f"{name}-{how}-{number}-{path.name}".replace(" ", "-")
                    (kept / of).write_bytes(content)
            path.write_bytes(whole)
            print(f"{name:14} {kind:40} {dict(counts)} most {most_s:.2f} s", flush=True)
    for fault, count in faults.most_common():
        print(f"{count:6} {fault}")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
