"""How the taught detector nears a bench's limit as the archive grows.

    python tests/benchmarks/judge_growth.py --output docs/detection-growth.md

Archives of several sizes are simulated on benches that had no part in teaching or designing the
detector, and judged leave-one-out. The seeds are those of no other benchmark.
"""

import argparse
import functools
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "workflow" / "scripts"))

import judge_unseen
from judge_rates import mean_row
from judge_report import table

from edges.config_files import read_config_file
from edges.phantom import CONFIG, natural
from edges.scorer_files import read_scorer

FIRST_SEED = 150_000
SHOWN = ("specificity", "recall at 1 mm", "recall from 2 mm")


def judged(bench: str, runs: int, archives: int, config: dict, scorer: object) -> dict:
    """Judge archives of one size of one bench; return the means."""
    judge_unseen.FIRST_SEED, judge_unseen.RUNS = FIRST_SEED, runs
    rows = []
    for readings in judge_unseen.simulated(bench, archives):
        archive = judge_unseen.training_archive(readings, config, scorer, 0)
        rows.append(judge_unseen.judge(archive, "taught"))
    size = {"bench": bench, "recordings": str(len(judge_unseen.SIZES_MM) * runs)}
    row = mean_row(size | {"archives": str(archives)}, rows)
    return {key: row[key] for key in (*size, "archives", *SHOWN, "seconds")}


def main() -> None:
    """Judge archives of each size, and write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    benches = ["uneven-wall", "slipping-capsule", "wandering-seats", "usual"]
    parser.add_argument("--benches", nargs="+", default=benches, help=f"(default: {benches})")
    add = functools.partial(parser.add_argument, metavar="N", type=natural)
    add("--runs", nargs="+", default=[20, 80, 320], help="of each size (default: 20 80 320)")
    add("--recordings", default=2400, help="of each row, over its archives (default: 2400)")
    parser.add_argument("--output", type=Path, metavar="PATH", help="output: the table, Markdown")
    arguments = parser.parse_args()
    config = read_config_file(CONFIG / "config.yaml")
    scorer = read_scorer(judge_unseen.WEIGHTS)
    rows = []
    for bench in arguments.benches:
        for runs in arguments.runs:
            archives = max(arguments.recordings // (runs * len(judge_unseen.SIZES_MM)), 1)
            started = time.monotonic()
            rows.append(judged(bench, runs, archives, config, scorer))
            seconds = time.monotonic() - started
            print(f"{bench}, {runs} runs a size: {seconds:.0f} s", file=sys.stderr, flush=True)
    text = (
        "# What larger archives teach the taught detector\n\nMade by "
        "`tests/benchmarks/judge_growth.py`; docs/detection.md explains it. Means over archives of "
        f"simulated recordings, seeds from {FIRST_SEED} on, leave-one-out. Seconds: of one core "
        f"to judge an archive.\n\n{table(rows)}"
    )
    if arguments.output:
        arguments.output.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
