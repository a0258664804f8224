"""Train the scorer of the detector ``taught`` on simulated recordings of many random benches.

Needs torch (workflow/scripts/scorer_teaching/requirements.txt). It reads no real recording.
"""

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from edges import files
from edges.config_files import read_config_file
from edges.number_arguments import natural
from edges.phantom import CONFIG, DEFAULT_TABLE, read_phantom
from scorer_teaching.episodes import episodes_of, phantom_recordings, random_recordings
from scorer_teaching.progress import Progress

HELD_OUT, PROJECTING = 40, 16400
BENCHES_A_PHANTOM = 10
Makers = list[Callable[[], list[np.ndarray]]]


def read_arguments() -> argparse.Namespace:
    """Return the options."""
    parser = argparse.ArgumentParser(description=__doc__)
    add = parser.add_argument
    output = Path("workflow/weights/scorer.npz")
    add("--output", type=Path, default=output, metavar="FILE", help=f"weights (default: {output})")
    add("--benches", type=natural, default=3600, metavar="N", help="random benches (default: 3600)")
    add("--epochs", type=natural, default=9, metavar="N", help="training epochs (default: 9)")
    count = {"type": natural, "metavar": "N", "default": PROJECTING}
    add(
        "--projection-benches",
        **count,
        help=f"further random benches, which teach the projection (default: {PROJECTING})",
    )
    network = "take the network from these weights, and teach the projection only"
    add("--network", type=Path, metavar="FILE", help=network)
    seed = {"type": int, "metavar": "N", "default": 1}
    add("--seed", **seed, help="random seed; the same seed gives the same weights (default: 1)")
    add(
        "--leave-out-phantom",
        action="store_true",
        help="train without the phantom (default: one bench in eleven is a random phantom)",
    )
    return parser.parse_args()


def benches(arguments: argparse.Namespace, first: int, count: int) -> Makers:
    """Return functions that simulate random benches, and as a rule a tenth as many phantoms."""
    seed, beyond = arguments.seed, first + count
    makers: Makers = [partial(random_recordings, seed, f"{n}") for n in range(first, beyond)]
    if not arguments.leave_out_phantom:
        base = read_phantom(DEFAULT_TABLE, [])
        phantoms = range(first // BENCHES_A_PHANTOM, beyond // BENCHES_A_PHANTOM)
        makers += [partial(phantom_recordings, base, seed, f"{n}") for n in phantoms]
    return makers


def network_weights(arguments: argparse.Namespace) -> dict[str, np.ndarray]:
    """Train the network, or read it; return its weights."""
    from scorer_teaching.lesson import teach
    from scorer_teaching.weights import checked_weights

    if arguments.network is not None:
        with np.load(arguments.network) as stored:
            return {name: stored[name] for name in stored.files if name != "projection"}
    makers, seed = benches(arguments, 0, arguments.benches), arguments.seed
    episodes = episodes_of(makers, Progress(len(makers)).tell)
    network = teach(episodes, arguments.epochs, seed, Progress(1.0).tell)
    held_out = [partial(random_recordings, seed, f"held out {n}") for n in range(HELD_OUT)]
    return checked_weights(network, episodes_of(held_out, Progress(HELD_OUT).tell))


def main() -> None:
    """Simulate the benches, train the scorer, check its weights and write them."""
    arguments = read_arguments()
    try:
        import torch

        from scorer_teaching.projection import gradients_of, teach_projection
        from scorer_teaching.weights import unprojected
    except ModuleNotFoundError as error:
        if error.name != "torch":
            raise
        needs = "workflow/scripts/scorer_teaching/requirements.txt"
        raise SystemExit(f"error: the training needs torch; run: pip install -r {needs}") from None
    torch.set_num_threads(1)
    weights = network_weights(arguments)
    makers = benches(arguments, arguments.benches, arguments.projection_benches)
    gradients = gradients_of(makers, unprojected(weights), Progress(len(makers)).tell)
    taught = read_config_file(CONFIG / "config.yaml")["taught"]
    weights["projection"] = teach_projection(
        gradients, taught["height"], taught["penalties"], arguments.seed, Progress(1.0).tell
    )
    with files.write_whole(arguments.output, "wb") as stream:
        np.savez(stream, **weights)


if __name__ == "__main__":
    files.run(main)
