"""Convert a trained network to the weights that the detector reads, and check them."""

import numpy as np

from capsule.detectors.network import FOLDED, Scorer, standardised
from capsule.errors import CapsuleError
from scorer_teaching.episodes import Episodes
from scorer_teaching.network import Network

_TOLERANCE = 1e-6
# Number of recordings of each held-out bench for the comparison of network and detector.
_COMPARED = 2


def unprojected(weights: dict[str, np.ndarray]) -> Scorer:
    """Return the scorer of some weights, whose gradients are folded but not projected."""
    return Scorer({**weights, "projection": np.eye(FOLDED)})


def checked_weights(network: Network, held_out: Episodes) -> dict[str, np.ndarray]:
    """Return the weights of a network; check them with the detector's scorer.

    Parameters
    ----------
    network : Network
        The trained network.
    held_out : Episodes
        Episodes of benches that were not used in the training.

    Returns
    -------
    dict of str to array
        Weights for `capsule.detectors.network.Scorer`, without ``projection``. ``gradient_scale``
        is the square root of the median, over the benches, of the gradients' mean squared length.

    Raises
    ------
    CapsuleError
        The detector's scorer computes other scores or gradients than the network.
    """
    weights = network.stored() | {"gradient_scale": np.float32(1.0)}
    scorer, exact = unprojected(weights), network.double()
    mean_squares = []
    for bench in range(len(held_out.counts)):
        recordings = held_out.recordings(bench)
        passes = [scorer.forward(standardised(series)) for series in recordings]
        gradients = [backward() for _, _, backward in passes]
        compared = list(zip(recordings, passes, gradients, strict=True))[:_COMPARED]
        for series, (score, _, _), gradient in compared:
            _compare(exact, series, score, gradient)
        if gradients:
            mean_squares.append(np.mean([gradient @ gradient for gradient in gradients]))
    weights["gradient_scale"] = np.float32(np.sqrt(np.median(mean_squares)))
    return weights


def _compare(network: Network, series: np.ndarray, score: float, gradient: np.ndarray) -> None:
    """Raise an error if a score or gradient differs from the network's."""
    true_score, true_gradient = network.gradient(series)
    off_score = abs(score - true_score) / (1 + abs(true_score))
    off = np.linalg.norm(gradient - true_gradient) / np.linalg.norm(true_gradient)
    if not max(off_score, off) < _TOLERANCE:
        raise CapsuleError(
            "the scorer of the detector does not reproduce the trained network: its score is "
            f"{score:.6g} instead of {true_score:.6g}, the "
            f"relative difference of the gradients is {off:.2g}"
        )
