"""The two stages of the training: the network, and then the projection of its gradients."""

import numpy as np

from capsule.kinds import Settings
from capsule.phantom.parameters import Phantom
from scorer_teaching.episodes import episodes_of, held_out_benches, random_benches
from scorer_teaching.lesson import teach
from scorer_teaching.progress import Progress
from scorer_teaching.projection import gradients_of, teach_projection
from scorer_teaching.weights import checked_weights, unprojected

_HELD_OUT = 40
# Penalties that are tried in each episode.
_PENALTIES = (1.0, 0.1, 0.01, 0.001)


def network_weights(
    seed: int, benches: int, rounds: int, base: Phantom | None
) -> dict[str, np.ndarray]:
    """Train the network on the first random benches, and check it on benches that taught nothing.

    Parameters
    ----------
    seed : int
        Random seed.
    benches : int
        Number of random benches.
    rounds : int
        As for `scorer_teaching.lesson.teach`.
    base : Phantom or None
        As for `scorer_teaching.episodes.random_benches`.

    Returns
    -------
    dict of str to array
        Weights without ``projection``.
    """
    makers = random_benches(seed, 0, benches, base)
    episodes = episodes_of(makers, Progress(len(makers)).tell)
    network = teach(episodes, rounds, seed, Progress(1.0).tell)
    held_out = episodes_of(held_out_benches(seed, _HELD_OUT), Progress(_HELD_OUT).tell)
    return checked_weights(network, held_out)


def with_projection(
    weights: dict[str, np.ndarray],
    seed: int,
    first: int,
    count: int,
    base: Phantom | None,
    taught: Settings,
) -> dict[str, np.ndarray]:
    """Return the weights of a network with the projection, which further benches teach.

    Parameters
    ----------
    weights : dict of str to array
        From `network_weights`.
    seed : int
        Random seed.
    first, count, base
        As for `scorer_teaching.episodes.random_benches`; the first benches trained the network.
    taught : mapping
        Section ``taught`` of the configuration.
    """
    makers = random_benches(seed, first, count, base)
    gradients = gradients_of(makers, unprojected(weights), Progress(len(makers)).tell)
    height, penalties, progress = taught["height"], _PENALTIES, Progress(1.0)
    projection = teach_projection(gradients, height, penalties, seed, progress.tell)
    return weights | {"projection": projection}
