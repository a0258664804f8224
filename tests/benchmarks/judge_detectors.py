"""Judge the detectors on simulated archives that were not used to design them.

    python tests/benchmarks/judge_detectors.py
        --output workflow/studies/results/detection-results.md

Every archive holds 20 recordings a size, of its own seed; every condition changes parameters of
the simulated bench. Each detector judges each recording by what the others of its archive teach.
The paper's detector needs a particle fit for each recording, so it judges only the unchanged bench,
with as many particles and iterations as --fit says. The same archives may be judged by what others
would use: export_archives.py writes them, peers/run_peers.py judges them, --peers takes that in.
"""

import argparse
import functools
import json
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

FOLDERS = [Path(__file__).parents[2] / "workflow" / each for each in ("scripts", "studies")]
sys.path[:0] = map(str, FOLDERS)

from judge_benches import CONDITIONS, HEIGHTS, judge_changed, judge_detectors, judge_retests
from judge_report import Measured, report

from capsule.arguments import natural
from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG
from capsule.phantom.files import DEFAULT_TABLE, read_phantom

# The detector was designed on seeds 5000 to 9999; nothing here may use those.
FIRST_SEED = 60_000


def read_arguments() -> argparse.Namespace:
    """Read what to judge."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = functools.partial(parser.add_argument, metavar="N", type=natural)
    add("--archives", default=60, help="archives of each bench (default: 60)")
    add("--paper-archives", default=60, help="archives that the paper's judges (default: 60)")
    add("--fit", default=300, help="particles and iterations of its fits (default: 300)")
    add("--retest-archives", default=20, help="archives of several passes (default: 20)")
    add = functools.partial(parser.add_argument, metavar="FILE", type=Path)
    add("--peers", help="what peers/run_peers.py wrote, JSON")
    add("--parameters", default=DEFAULT_TABLE, help="the phantom (default: config/phantom.yaml)")
    add("--output", help="output: the tables, Markdown")
    return parser.parse_args()


def reported(benches: Iterable[tuple[str, list[dict]]]) -> Iterator[tuple[str, list[dict]]]:
    """Pass the judged benches on, and say which is done."""
    for label, rows in benches:
        print(f"judged: {label}", file=sys.stderr, flush=True)
        yield label, rows


def main() -> None:
    """Simulate, judge, and write the tables."""
    arguments = read_arguments()
    config = read_config_file(CONFIG / "config.yaml")
    phantom = read_phantom(arguments.parameters, [])
    seeds = range(FIRST_SEED, FIRST_SEED + arguments.archives)
    detectors = judge_detectors(phantom, seeds, config, arguments.paper_archives, arguments.fit)
    changed = [
        dict(reported(judge_changed(phantom, benches, seeds, config, detectors["diagonal"])))
        for benches in (CONDITIONS, HEIGHTS)
    ]
    # No more can be judged in several passes than there are.
    retested = seeds[: arguments.retest_archives]
    text = report(
        Measured(
            seeds=seeds,
            detectors=detectors,
            effort=arguments.fit,
            conditions=changed[0],
            heights=changed[1],
            retests=judge_retests(phantom, retested, config),
            retest_archives=len(retested),
            peers=json.loads(arguments.peers.read_text()) if arguments.peers else {},
        )
    )
    if arguments.output:
        arguments.output.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
