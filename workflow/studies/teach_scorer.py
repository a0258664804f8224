"""Train the scorer of the detector ``taught`` on simulated recordings of many random benches.

Needs torch (workflow/studies/scorer_teaching/requirements.txt). It reads no real recording.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from scorer_teaching.episodes import episodes_of, held_out_benches, random_benches

from capsule.commands.options import natural
from capsule.engine.configuration import read_config_file
from capsule.engine.jobs import run
from capsule.engine.project import CONFIG
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.store import files

PROJECTING = 16400
# Number of benches that check the network.
HELD_OUT = 40


def build_parser() -> argparse.ArgumentParser:
    """Return the parser."""
    parser = argparse.ArgumentParser(description=__doc__)
    add = parser.add_argument
    output = Path("workflow/weights/scorer.npz")
    add("--output", type=Path, default=output, metavar="FILE", help=f"weights (default: {output})")
    add("--benches", type=natural, default=3600, metavar="N", help="random benches (default: 3600)")
    add("--epochs", type=natural, default=9, metavar="N", help="training epochs (default: 9)")
    count = {"type": natural, "metavar": "N", "default": PROJECTING}
    further = f"further random benches, which teach the projection (default: {PROJECTING})"
    add("--projection-benches", **count, help=further)
    network = "take the network from these weights, and teach the projection only"
    add("--network", type=Path, metavar="FILE", help=network)
    seed = {"type": int, "metavar": "N", "default": 1}
    add("--seed", **seed, help="random seed; the same seed gives the same weights (default: 1)")
    add(
        "--leave-out-phantom",
        action="store_true",
        help="train without the phantom (default: one bench in eleven is a random phantom)",
    )
    return parser


def main() -> None:
    """Simulate the benches, train the scorer, check its weights and write them."""
    arguments = build_parser().parse_args()
    try:
        import torch
        from scorer_teaching.lesson import gradients_of, teach, teach_projection
        from scorer_teaching.network import checked_weights
    except ModuleNotFoundError as error:
        if error.name != "torch":
            raise
        needs = "workflow/studies/scorer_teaching/requirements.txt"
        raise SystemExit(f"error: the training needs torch; run: pip install -r {needs}") from None
    torch.set_num_threads(1)
    seed, benches = arguments.seed, arguments.benches
    settings = read_config_file(CONFIG / "config.yaml")
    base = None if arguments.leave_out_phantom else read_phantom(DEFAULT_TABLE, [])
    if arguments.network is None:
        episodes = episodes_of(random_benches(seed, 0, benches, base), settings)
        network = teach(episodes, arguments.epochs, seed)
        held_out = episodes_of(held_out_benches(seed, HELD_OUT), settings)
        weights = checked_weights(network, held_out)
    else:
        with np.load(arguments.network) as stored:
            weights = {name: stored[name] for name in stored.files if name != "projection"}
    # The first benches trained the network.
    makers = random_benches(seed, benches, arguments.projection_benches, base)
    folded, scores = gradients_of(makers, weights, settings)
    height = settings["taught"]["height"]
    weights["projection"] = teach_projection(folded, scores, height, seed)
    with files.write_whole(arguments.output, "wb") as stream:
        np.savez(stream, **weights)


if __name__ == "__main__":
    run(main)
