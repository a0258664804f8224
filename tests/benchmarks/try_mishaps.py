"""Try many random sequences of edits, settings, failed jobs, kills, dates and dry runs.

    python tests/benchmarks/try_mishaps.py --sequences 300 --at-once 2

Each sequence is what `support.mishaps` makes of its seed. The last line says how many have failed;
what those leave is kept below the folder that it names.
"""

import argparse
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "workflow" / "scripts")]

from support.mishaps import FreshResults, create_project, try_sequence


def main() -> None:
    """Try the sequences, tell of each that fails, and sum up."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--sequences", type=int, default=300, metavar="N", help="how many (default: 300)")
    add("--first-seed", type=int, default=1000, metavar="N", help="of the first (default: 1000)")
    add("--at-once", type=int, default=1, metavar="N", help="side by side (default: 1)")
    arguments = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="mishaps-"))
    first, failed = arguments.first_seed, 0
    started, happened = time.monotonic(), Counter()
    with ThreadPoolExecutor(arguments.at_once) as pool:
        fresh = FreshResults(create_project(folder / "project"))
        tried = {
            pool.submit(try_sequence, fresh, folder / f"seed-{seed}", seed): seed
            for seed in range(first, first + arguments.sequences)
        }
        for done, future in enumerate(as_completed(tried), start=1):
            told, fault = future.result()
            happened.update(each for each in told if each.endswith("killed"))
            failed += bool(fault)
            if fault:
                print(f"seed {tried[future]}: {'; '.join(told)}: {fault}", flush=True)
            elapsed = time.monotonic() - started
            print(f"{done} of {len(tried)}, {failed} failed, {elapsed:.0f} s", flush=True)
    kills = ", ".join(f"{count} times {what}" for what, count in sorted(happened.items()))
    print(f"{len(tried)} sequences, {failed} failed ({kills}); what failed is kept in {folder}")
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
