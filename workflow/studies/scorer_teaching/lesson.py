"""Train the network to compute features that a small archive can learn from.

An episode is a small archive of one bench. Ridge regression on the network's embedding predicts
each recording from the others, as in the adaptation to a real archive. The loss of these
predictions is differentiated through the closed form of the regression (Bertinetto et al. 2019,
"Meta-learning with differentiable closed-form solvers").
"""

import math
import sys
from collections.abc import Sequence

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from capsule.kinds import Settings
from capsule.phantom.parameters import Phantom
from capsule.seeding import generator
from scorer_teaching.episodes import (
    SIZES_MM,
    Episodes,
    episodes_of,
    held_out_benches,
    progress,
    random_benches,
)
from scorer_teaching.network import Network, checked_weights, reversed_in_time

_EPISODES_A_STEP = 4
_PEAK_RATE, _WARM_UP, _DECAY, _LONGEST_STEP = 4e-3, 0.05, 1e-3, 1.0
# After this many rounds, benches are left out if less than this share of their nodules, from this
# size on, is detected.
_SIFT_AFTER, _SIFT_BELOW, _SIFT_FROM_MM = 2, 0.3, 3.0
# Nodules of 4 and 5 mm have less weight, since they are easy to detect.
_IMPORTANCE = (0.0, 1.0, 1.0, 1.0, 0.6, 0.6)
_SHARE_PLAIN, _SHARE_ODDS, _SHARE_SIZE = 0.3, 0.09, 0.5

# A nodule should score by so many standard deviations above the healthy mean.
_ABOVE, _STEEPNESS, _LEAST_SPREAD = 1.75, 1.5, 0.05

# Number of benches that check the network.
_HELD_OUT = 40

_HEALTHY = SIZES_MM == 0
SIZE_PLACE = torch.as_tensor(SIZES_MM).long()


class Learner(nn.Module):
    """The network with the parameters of the training: two penalties, and the targets by size."""

    def __init__(self) -> None:
        super().__init__()
        self.network = Network()
        self.log_penalty = nn.Parameter(torch.tensor([3.0, 3.0]))
        self.rise = nn.Parameter(torch.tensor([1.5, 1.5, 1.5, 0.5, 0.5]))

    def targets(self) -> torch.Tensor:
        """Return the target score of each recording of an episode, which rises with its size."""
        by_size = torch.cat([torch.zeros(1), functional.softplus(self.rise).cumsum(0)])
        return by_size[SIZE_PLACE]


def loss_of(
    learner: Learner, series: torch.Tensor, counts: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the loss and the scores of some episodes.

    Parameters
    ----------
    learner : Learner
        The network with its training parameters.
    series : (B, n, 4, 5, T) tensor
        Recordings of the episodes.
    counts : (B, n) tensor of int
        Numbers of filled windows.

    Returns
    -------
    loss : tensor
        Loss to minimise.
    adapted : (B, n) tensor
        Leave-one-out score of each recording.
    """
    score, embedding = learner.network(series.flatten(0, 1), counts.flatten())
    score, embedding = score.reshape(counts.shape), embedding.reshape(*counts.shape, -1)
    lacking = learner.targets() - score
    adapted = score + leave_one_out(embedding, lacking, learner.log_penalty[0].exp())
    sizes = torch.as_tensor(SIZES_MM[~_HEALTHY], dtype=score.dtype).expand(len(score), -1)
    estimates = leave_one_out(embedding[:, ~_HEALTHY], sizes, learner.log_penalty[1].exp())
    nodule = torch.as_tensor(~_HEALTHY, dtype=score.dtype).expand_as(score)
    loss = (
        missed(adapted).mean()
        + _SHARE_PLAIN * missed(score).mean()
        + _SHARE_ODDS * functional.binary_cross_entropy_with_logits(score, nodule)
        + _SHARE_SIZE * functional.smooth_l1_loss(estimates, sizes, beta=0.5)
    )
    return loss, adapted.detach()


def missed(scores: torch.Tensor, importance: Sequence[float] = _IMPORTANCE) -> torch.Tensor:
    """Return a smooth measure of the nodules whose scores are too close to the healthy ones.

    It is the mean of ``log(1 + exp(1.5 (1.75 - z)))`` over the nodules, with weights by size, and
    with z in standard deviations above the mean of the healthy scores.

    Parameters
    ----------
    scores : (..., n) tensor
        Scores of the n recordings of an episode.
    importance : sequence of 6 float
        Weight of each size from 0 to 5 mm.

    Returns
    -------
    (...) tensor
    """
    healthy, nodules = scores[..., _HEALTHY], scores[..., ~_HEALTHY]
    spread = healthy.std(-1, keepdim=True) + _LEAST_SPREAD
    above = (nodules - healthy.mean(-1, keepdim=True)) / spread - _ABOVE
    weight = torch.tensor(importance)[SIZE_PLACE[~_HEALTHY]]
    return (functional.softplus(-_STEEPNESS * above) * weight).mean(-1)


def leave_one_out(
    features: torch.Tensor, targets: torch.Tensor, penalty: torch.Tensor
) -> torch.Tensor:
    """Return each target (B, n), predicted by ridge regression on the other features (B, n, P)."""
    count, dimensions = features.shape[1:]
    centred = features - features.mean(1, keepdim=True)
    across = centred.transpose(1, 2)
    normal = across @ centred + penalty * torch.eye(dimensions)
    hat = 1 / count + centred @ torch.linalg.solve(normal, across)
    residuals = targets - (hat @ targets[..., None])[..., 0]
    return targets - residuals / freedom(hat)


def freedom(hat: torch.Tensor) -> torch.Tensor:
    """Return by how much to divide each residual to leave its recording out, (B, n).

    It is 1 less the leverage, the diagonal of the hat matrix (B, n, n), and bounded below.
    """
    return (1 - torch.diagonal(hat, dim1=1, dim2=2)).clamp(min=0.02)


def teach(episodes: Episodes, rounds: int, seed: int) -> Network:
    """Train a network, and return it.

    Parameters
    ----------
    episodes
        The training data.
    rounds
        Number of rounds over all benches.
    seed
        Seed of the first weights and of the order.
    """
    torch.manual_seed(seed)
    numbers = generator(seed, "lesson")
    learner = Learner()
    optimiser = torch.optim.AdamW(learner.parameters(), lr=_PEAK_RATE, weight_decay=_DECAY)
    kept = np.arange(len(episodes.counts))
    shares = np.zeros(kept.size)
    for round_ in range(rounds):
        order = numbers.permutation(kept)
        batches = np.array_split(order, max(order.size // _EPISODES_A_STEP, 1))
        losses = []
        name = f"epoch {round_ + 1} of {rounds}"
        for step, batch in enumerate(progress(batches, f"{name}, step")):
            done = (round_ + step / len(batches)) / rounds
            series = torch.as_tensor(episodes.series[batch]).float()
            counts = torch.as_tensor(episodes.counts[batch])
            if numbers.random() < 0.5:
                turned = reversed_in_time(series.flatten(0, 1), counts.flatten())
                series = turned.reshape(series.shape)
            loss, adapted = loss_of(learner, series, counts)
            descend(optimiser, loss, rate_at(done))
            losses.append(loss.item())
            shares[batch] = told_apart(adapted.numpy())
        print(f"{name}: loss {np.mean(losses):.3f}, {kept.size} benches", file=sys.stderr)
        if round_ + 1 == _SIFT_AFTER:
            kept = kept[shares[kept] >= _SIFT_BELOW]
    return learner.network.eval()


def descend(optimiser: torch.optim.Optimizer, loss: torch.Tensor, rate: float) -> None:
    """Lower a loss by one step at a learning rate; the step's gradient is bounded."""
    for group in optimiser.param_groups:
        group["lr"] = rate
    optimiser.zero_grad()
    loss.backward()
    moved = [parameter for group in optimiser.param_groups for parameter in group["params"]]
    nn.utils.clip_grad_norm_(moved, _LONGEST_STEP)
    optimiser.step()


def rate_at(done: float) -> float:
    """Return the learning rate at a share of the training: a short rise, then a cosine to 0."""
    if done < _WARM_UP:
        return _PEAK_RATE * (0.04 + 0.96 * done / _WARM_UP)
    return _PEAK_RATE * 0.5 * (1 + math.cos(math.pi * (done - _WARM_UP) / (1 - _WARM_UP)))


def told_apart(scores: np.ndarray) -> np.ndarray:
    """Return the share of large nodules that score above all but one healthy recording, (B,)."""
    second = np.sort(scores[:, _HEALTHY], axis=1)[:, -2:-1]
    return (scores[:, SIZES_MM >= _SIFT_FROM_MM] > second).mean(axis=1)


def network_weights(
    seed: int, benches: int, rounds: int, base: Phantom | None, settings: Settings
) -> dict[str, np.ndarray]:
    """Train the network on the first random benches, and check it on benches that taught nothing.

    Parameters
    ----------
    seed : int
        Random seed.
    benches : int
        Number of random benches.
    rounds : int
        As for `teach`.
    base : Phantom or None
        As for `scorer_teaching.episodes.random_benches`.
    settings : mapping
        The configuration.

    Returns
    -------
    dict of str to array
        Weights without ``projection``.
    """
    makers = random_benches(seed, 0, benches, base)
    network = teach(episodes_of(makers, settings), rounds, seed)
    return checked_weights(network, episodes_of(held_out_benches(seed, _HELD_OUT), settings))
