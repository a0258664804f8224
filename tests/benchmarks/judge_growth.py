"""Measure how near the taught detector comes to a bench's limit as the archive grows.

    python tests/benchmarks/judge_growth.py --output workflow/studies/results/detection-growth.md

Archives are simulated on benches that had no part in teaching or designing the detector. Their
first runs, and then more of them, are judged leave-one-out. No other benchmark uses these seeds.
"""

import argparse
import functools
import sys
import time
from dataclasses import replace
from pathlib import Path

FOLDERS = [Path(__file__).parents[2] / "workflow" / each for each in ("scripts", "studies")]
sys.path[:0] = map(str, FOLDERS)

import judge_unseen
from judge_rates import mean_row
from judge_report import table

from capsule.arguments import natural
from capsule.detectors.described import read_scorer
from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG, WEIGHTS
from capsule.recordings.names import size_mm

FIRST_SEED = 190_000
SHOWN = ("specificity", "recall at 1 mm", "recall from 2 mm")


def judged(
    bench: str, several_runs: list[int], archives: int, config: dict, scorer: object
) -> list[dict]:
    """Judge the first runs of the same archives, fewer and more of them; return the means.

    All runs of an archive share its nodules, so archives of different sizes can be compared only
    if they are parts of each other.
    """
    rows: dict[int, list[dict]] = {runs: [] for runs in several_runs}
    for readings in judge_unseen.simulated(bench, archives, FIRST_SEED, max(several_runs)):
        whole = judge_unseen.training_archive(readings, config, scorer, 0)
        for runs in several_runs:
            names = [name for name in readings if int(name.rpartition("r")[2]) <= runs]
            part = replace(
                whole,
                sizes_mm={name: size_mm(name) for name in names},
                no_verdict={name: whole.no_verdict[name] for name in names},
            )
            rows[runs].append(judge_unseen.judge(part, "taught"))
    means = []
    for runs, each in rows.items():
        size = {"bench": bench, "recordings": str(len(judge_unseen.SIZES_MM) * runs)}
        row = mean_row(size | {"archives": str(archives)}, each)
        means.append({key: row[key] for key in (*size, "archives", *SHOWN, "seconds")})
    return means


def main() -> None:
    """Judge archives of each size, and write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    benches = ["uneven-wall", "slipping-capsule", "wandering-seats", "usual"]
    parser.add_argument("--benches", nargs="+", default=benches, help=f"(default: {benches})")
    add = functools.partial(parser.add_argument, metavar="N", type=natural)
    add("--runs", nargs="+", default=[20, 80, 320], help="of each size (default: 20 80 320)")
    add("--archives", default=5, help="of each bench (default: 5)")
    parser.add_argument("--output", type=Path, metavar="PATH", help="output: the table, Markdown")
    arguments = parser.parse_args()
    config = read_config_file(CONFIG / "config.yaml")
    scorer = read_scorer(WEIGHTS)
    rows = []
    for bench in arguments.benches:
        started = time.monotonic()
        rows += judged(bench, arguments.runs, arguments.archives, config, scorer)
        print(f"{bench}: {time.monotonic() - started:.0f} s", file=sys.stderr, flush=True)
    text = (
        "# What larger archives teach the taught detector\n\nMade by "
        "`tests/benchmarks/judge_growth.py`; studies/detection.md tells why. Means over archives "
        f"of simulated recordings, seeds from {FIRST_SEED} on, leave-one-out. Seconds: of one core "
        f"to judge an archive.\n\n{table(rows)}"
    )
    if arguments.output:
        arguments.output.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
