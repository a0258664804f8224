"""Search for the phantom's free parameters, so that the paper's detector gives the paper's table.

Every parameter with a range in the table is searched for, from its present value on. One trial
is one simulated archive of 120 runs with cheap fits; all trials are appended to the log. Then
judge_phantom.py judges the winner on archives that the search has never seen.
"""

import argparse
import csv
import itertools
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import yaml

import files
from capsule.phantom import paper_table, search, trial
from capsule.phantom.parameters import rewritten, value_of, with_values
from capsule.seeding import generator
from phantom_edges import detector_arguments, detector_of, read_phantom

# Archives of the search have seeds from here on; those that judge the winner count from 1.
FIRST_SEARCH_SEED = 100_000


def append(log: Path, row: dict) -> None:
    """Append a row to a CSV file."""
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("a", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, list(row), lineterminator="\n")
        if stream.tell() == 0:
            writer.writeheader()
        writer.writerow(row)


def main() -> None:
    """Move a cloud of candidates, generation by generation."""
    parser = argparse.ArgumentParser(description=__doc__, parents=[detector_arguments()])
    parser.add_argument("--generations", type=int, default=25, help="default: 25")
    parser.add_argument("--candidates", type=int, default=28, help="a generation (default: 28)")
    parser.add_argument("--spread", type=float, default=0.13, help="of the first (default: 0.13)")
    parser.add_argument("--rate", type=float, default=0.5, help="of movement (default: 0.5)")
    parser.add_argument("--seed", type=int, default=1, help="default: 1")
    parser.add_argument("--log", type=Path, required=True, help="CSV file to append trials to")
    parser.add_argument("--output", type=Path, help="write the table with the winner's values")
    arguments = parser.parse_args()
    phantom = read_phantom(arguments.parameters, arguments.changes)
    text = arguments.parameters.read_text(encoding="utf-8")
    free = search.free_parameters(yaml.safe_load(text))
    detector = trial.quick(detector_of(arguments.config))

    def archive_seed(number: int) -> int:
        return FIRST_SEARCH_SEED + 1000 * arguments.seed + number

    def loss(values: Mapping[str, float], number: int) -> float:
        seed = archive_seed(number)
        matrices = trial.archive_matrices(with_values(phantom, values), seed, 20, detector)
        table = trial.resubstitution(matrices, detector)
        off = paper_table.distance(paper_table.cells(table))
        row = {"generation": number, "archive_seed": seed, "loss": off}
        append(arguments.log, row | {"confusion": json.dumps(table.tolist()), **values})
        return off

    generations = search.evolve(
        free,
        {each.name: value_of(phantom, each.name) for each in free},
        loss,
        lambda number: generator(archive_seed(number), "candidates"),
        candidates=arguments.candidates,
        spread=arguments.spread,
        rate=arguments.rate,
    )
    for number, step in enumerate(itertools.islice(generations, arguments.generations), start=1):
        shown = ", ".join(f"{name}={value:.4g}" for name, value in step.centre.items())
        print(
            f"generation {number} of {arguments.generations}: off by {np.median(step.losses):.1f}"
            f" points in the middle, {step.losses[0]:.1f} at the centre\n  {shown}",
            flush=True,
        )
        if arguments.output:
            with files.write_whole(arguments.output) as stream:
                stream.write(rewritten(text, step.centre))


if __name__ == "__main__":
    files.run(main)
