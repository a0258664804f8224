"""Search for the phantom's free parameters, so that the paper's detector gives the paper's table.

Every parameter with a range in the table is searched for, from the middle of its range on; its
present value plays no part. One trial is one simulated archive of 120 runs with cheap fits; all
trials are appended to the log. The same seed gives the same winner. Then judge_phantom.py judges
the winner on archives that the search has never seen.
"""

import argparse
import csv
import functools
import itertools
import json
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import yaml

import files
from capsule.phantom import paper_table, search, trial
from capsule.phantom.parameters import Phantom, rewritten, with_values
from capsule.seeding import generator
from phantom_edges import detector_arguments, detector_of, read_phantom

# Archives of the search have seeds from here on; those that judge the winner count from 1.
FIRST_SEARCH_SEED = 100_000


def try_out(
    phantom: Phantom, detector: trial.Detector, seed: int, values: Mapping[str, float]
) -> dict:
    """Simulate one archive with these values; say how far it is from the paper."""
    changed = with_values(phantom, values)
    archive = trial.simulate_archive(changed, seed, 20)
    table = trial.resubstitution(trial.archive_matrices(archive, detector), detector)
    motion = trial.archive_motion(archive, changed)
    loss = paper_table.distance(paper_table.cells(table) | motion)
    result = {"archive_seed": seed, "loss": loss, "confusion": json.dumps(table.tolist())}
    return result | motion | values


def archive_seed(seed: int, number: int) -> int:
    """Return the seed of the archives of one generation."""
    return FIRST_SEARCH_SEED + 1000 * seed + number


def candidate_numbers(seed: int, number: int) -> np.random.Generator:
    """Return the source of the candidates of one generation."""
    return generator(archive_seed(seed, number), "candidates")


def append(log: Path, rows: list[dict]) -> None:
    """Append rows to a CSV file."""
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("a", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        if stream.tell() == 0:
            writer.writeheader()
        writer.writerows(rows)


def main() -> None:
    """Move a cloud of candidates, generation by generation."""
    parser = argparse.ArgumentParser(description=__doc__, parents=[detector_arguments()])
    parser.add_argument("--generations", type=int, default=30, help="default: 30")
    parser.add_argument("--candidates", type=int, default=28, help="a generation (default: 28)")
    parser.add_argument("--spread", type=float, default=0.2, help="of the first (default: 0.2)")
    parser.add_argument("--rate", type=float, default=0.5, help="of movement (default: 0.5)")
    parser.add_argument("--seed", type=int, default=1, help="default: 1")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default: 1)")
    parser.add_argument("--log", type=Path, required=True, help="CSV file to append trials to")
    parser.add_argument("--output", type=Path, help="write the table with the winner's values")
    arguments = parser.parse_args()
    phantom = read_phantom(arguments.parameters, arguments.changes)
    text = arguments.parameters.read_text(encoding="utf-8")
    detector = trial.quick(detector_of(arguments.config))
    free = search.free_parameters(yaml.safe_load(text))

    with ProcessPoolExecutor(arguments.jobs) as pool:

        def losses_of(candidates: list[dict[str, float]], number: int) -> list[float]:
            trying = functools.partial(
                try_out, phantom, detector, archive_seed(arguments.seed, number)
            )
            rows = list(pool.map(trying, candidates))
            append(arguments.log, [{"generation": number} | row for row in rows])
            return [row["loss"] for row in rows]

        generations = search.evolve(
            free,
            losses_of,
            functools.partial(candidate_numbers, arguments.seed),
            candidates=arguments.candidates,
            spread=arguments.spread,
            rate=arguments.rate,
        )
        for number, step in enumerate(itertools.islice(generations, arguments.generations), 1):
            shown = ", ".join(f"{name}={value:.4g}" for name, value in step.centre.items())
            print(
                f"generation {number} of {arguments.generations}: off by"
                f" {np.median(step.losses):.1f} points in the middle, {step.losses[0]:.1f} at the"
                f" centre\n  {shown}",
                flush=True,
            )
            if arguments.output:
                with files.write_whole(arguments.output) as stream:
                    stream.write(rewritten(text, step.centre))


if __name__ == "__main__":
    files.run(main)
