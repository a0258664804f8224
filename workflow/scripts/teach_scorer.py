"""Train the scorer of the detector ``taught`` on simulated recordings of many random benches.

Needs torch (workflow/scripts/scorer_teaching/requirements.txt). It reads no real recording.
"""

import argparse
from functools import partial
from pathlib import Path

import numpy as np

from edges import files
from edges.number_arguments import natural
from edges.phantom import DEFAULT_TABLE, read_phantom
from scorer_teaching.episodes import episodes_of, phantom_recordings, random_recordings
from scorer_teaching.progress import Progress

HELD_OUT = 40
BENCHES_A_PHANTOM = 10


def read_arguments() -> argparse.Namespace:
    """Return the options."""
    parser = argparse.ArgumentParser(description=__doc__)
    add = parser.add_argument
    output = Path("workflow/weights/scorer.npz")
    add("--output", type=Path, default=output, metavar="FILE", help=f"weights (default: {output})")
    add("--benches", type=natural, default=3600, metavar="N", help="random benches (default: 3600)")
    add("--epochs", type=natural, default=9, metavar="N", help="training epochs (default: 9)")
    seed = {"type": int, "metavar": "N", "default": 1}
    add("--seed", **seed, help="random seed; the same seed gives the same weights (default: 1)")
    add(
        "--leave-out-phantom",
        action="store_true",
        help="train without the phantom (default: one bench in eleven is a random phantom)",
    )
    return parser.parse_args()


def main() -> None:
    """Simulate the benches, train the scorer, check its weights and write them."""
    arguments = read_arguments()
    try:
        import torch

        from scorer_teaching.lesson import teach
        from scorer_teaching.weights import checked_weights
    except ModuleNotFoundError as error:
        if error.name != "torch":
            raise
        needs = "workflow/scripts/scorer_teaching/requirements.txt"
        raise SystemExit(f"error: the training needs torch; run: pip install -r {needs}") from None
    torch.set_num_threads(1)
    seed = arguments.seed
    makers = [partial(random_recordings, seed, f"{n}") for n in range(arguments.benches)]
    if not arguments.leave_out_phantom:
        base = read_phantom(DEFAULT_TABLE, [])
        phantoms = range(arguments.benches // BENCHES_A_PHANTOM)
        makers += [partial(phantom_recordings, base, seed, f"{n}") for n in phantoms]
    episodes = episodes_of(makers, Progress(len(makers)).tell)
    network = teach(episodes, arguments.epochs, seed, Progress(1.0).tell)
    makers = [partial(random_recordings, seed, f"held out {n}") for n in range(HELD_OUT)]
    held_out = episodes_of(makers, Progress(HELD_OUT).tell)
    weights = checked_weights(network, held_out)
    with files.write_whole(arguments.output, "wb") as stream:
        np.savez(stream, **weights)


if __name__ == "__main__":
    files.run(main)
