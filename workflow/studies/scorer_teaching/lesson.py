"""Train the scorer: its network, then the projection of the score's gradients.

An episode is a small archive of one bench. The network learns to compute features that such an
archive can learn from: ridge regression on its embedding predicts each recording from the others,
as in the adaptation to a real archive. The loss of these predictions is differentiated through the
closed form of the regression (Bertinetto et al. 2019, "Meta-learning with differentiable
closed-form solvers").

The network stays as it is while the projection is taught. An archive adapts its score by ridge
regression on the folded gradients. Most of their numbers do not differ between nodules and healthy
recordings, and a small archive cannot tell which. The projection keeps the combinations that helped
on many benches. Several penalties and courses of the wanted score are tried in each episode, and
each regression weighs more the fewer nodules it misses; the detector itself uses one of them.
"""

import math
import sys
from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from capsule.detectors.network import FOLDED
from capsule.kinds import Settings
from capsule.seeding import generator
from scorer_teaching.episodes import (
    SIZES_MM,
    Episodes,
    Maker,
    episodes_of,
    progress,
)
from scorer_teaching.network import Network, reversed_in_time, unprojected

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

_HEALTHY = SIZES_MM == 0
_SIZE_PLACE = torch.as_tensor(SIZES_MM).long()

# Directions that are kept.
KEPT = 128
_PROJECTING_A_STEP, _ROUNDS, _RATE = 8, 4, 2e-3
# The first directions are those of the widest spread, times this factor.
_FIRST_FACTOR = 0.7
_SHARE_OF_EACH = 0.3
_ALL_ALIKE = (1.0,) * 6
# Wanted rise of the score over a healthy recording, as a share of the height, by size in mm.
_RISE_SIZES_MM = (0.0, 1.0, 2.0, 3.0)
_RISES = ((0.0, 0.3, 0.7, 1.0), (0.0, 0.6, 0.9, 1.0), (0.0, 1.0, 1.0, 1.0))
# How fast the weight of a regression falls with the nodules that it misses.
_STRICTNESS = 0.3
# Penalties that are tried in each episode.
_PENALTIES = (1.0, 0.1, 0.01, 0.001)


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
        return by_size[_SIZE_PLACE]


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
    weight = torch.tensor(importance)[_SIZE_PLACE[~_HEALTHY]]
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

    def order_of(done: int) -> np.ndarray:
        nonlocal kept
        if done == _SIFT_AFTER:
            kept = kept[shares[kept] >= _SIFT_BELOW]
        return numbers.permutation(kept)

    def loss_on(batch: np.ndarray) -> torch.Tensor:
        series = torch.as_tensor(episodes.series[batch]).float()
        counts = torch.as_tensor(episodes.counts[batch])
        if numbers.random() < 0.5:
            turned = reversed_in_time(series.flatten(0, 1), counts.flatten())
            series = turned.reshape(series.shape)
        loss, adapted = loss_of(learner, series, counts)
        shares[batch] = told_apart(adapted.numpy())
        return loss

    descend("epoch", rounds, order_of, _EPISODES_A_STEP, loss_on, optimiser, rate_at)
    return learner.network.eval()


def descend(
    name: str,
    rounds: int,
    order_of: Callable[[int], np.ndarray],
    size: int,
    loss_on: Callable[[np.ndarray], torch.Tensor],
    optimiser: torch.optim.Optimizer,
    rate_of: Callable[[float], float],
) -> None:
    """Lower a loss step by step, with bounded gradients, and print its mean in each round.

    Parameters
    ----------
    name, rounds
        What the lines call a round, and the number of rounds.
    order_of
        Function that returns the benches of a round in their order; rounds count from 0.
    size
        Number of benches in a step.
    loss_on
        Function that returns the loss on some benches.
    optimiser
        It holds the parameters.
    rate_of
        Function that returns the learning rate at a share of all steps, 0..1.
    """
    moved = [parameter for group in optimiser.param_groups for parameter in group["params"]]
    for number in range(rounds):
        order, losses = order_of(number), []
        batches = np.array_split(order, max(order.size // size, 1))
        title = f"{name} {number + 1} of {rounds}"
        for step, batch in enumerate(progress(batches, f"{title}, step")):
            for group in optimiser.param_groups:
                group["lr"] = rate_of((number + step / len(batches)) / rounds)
            optimiser.zero_grad()
            loss = loss_on(batch)
            loss.backward()
            nn.utils.clip_grad_norm_(moved, _LONGEST_STEP)
            optimiser.step()
            losses.append(loss.item())
        print(f"{title}: loss {np.mean(losses):.3f}, {order.size} benches", file=sys.stderr)


def rate_at(done: float) -> float:
    """Return the learning rate at a share of the training: a short rise, then a cosine to 0."""
    if done < _WARM_UP:
        return _PEAK_RATE * (0.04 + 0.96 * done / _WARM_UP)
    return _PEAK_RATE * 0.5 * (1 + math.cos(math.pi * (done - _WARM_UP) / (1 - _WARM_UP)))


def told_apart(scores: np.ndarray) -> np.ndarray:
    """Return the share of large nodules that score above all but one healthy recording, (B,)."""
    second = np.sort(scores[:, _HEALTHY], axis=1)[:, -2:-1]
    return (scores[:, SIZES_MM >= _SIFT_FROM_MM] > second).mean(axis=1)


def gradients_of(
    makers: Sequence[Maker], weights: dict[str, np.ndarray], settings: Settings
) -> tuple[np.ndarray, np.ndarray]:
    """Simulate many benches, and return the gradients and scores of their recordings.

    Benches on which a recording has no score are left out.

    Parameters
    ----------
    makers
        Functions that simulate the recordings of one bench.
    weights
        From `scorer_teaching.network.checked_weights`.
    settings
        The configuration.

    Returns
    -------
    folded : (B, n, 1024) array of float16
        Folded gradients of the score.
    scores : (B, n) array of float32
        Scores.
    """
    scorer = unprojected(weights)
    folded = np.zeros((len(makers), SIZES_MM.size, FOLDED), np.float16)
    scores = np.full((len(makers), SIZES_MM.size), np.nan, np.float32)
    for place, make in enumerate(progress(makers, "bench")):
        recordings = episodes_of([make], settings).recordings(0)
        if len(recordings) == SIZES_MM.size:
            features = [scorer.features(series) for series in recordings]
            folded[place] = [each.gradient for each in features]
            scores[place] = [each.score for each in features]
    known = ~np.isnan(scores).any(axis=1)
    return folded[known], scores[known]


def teach_projection(
    folded: np.ndarray, scores: np.ndarray, height: float, seed: int
) -> np.ndarray:
    """Teach the projection, and return it: shape (1024, `KEPT`), float16.

    Parameters
    ----------
    folded, scores
        From `gradients_of`, of benches that did not train the network.
    height
        Wanted rise of the score of nodules of 3 mm and more.
    seed
        Seed of the order of the benches.
    """
    numbers = generator(seed, "projection")
    first = torch.as_tensor(_FIRST_FACTOR * _widest(folded), dtype=torch.float32)
    projection = nn.Parameter(first)

    def loss_on(batch: np.ndarray) -> torch.Tensor:
        projected = torch.as_tensor(folded[batch]).float() @ projection
        return projected_loss(projected, torch.as_tensor(scores[batch]), height)

    descend(
        "projection, epoch",
        _ROUNDS,
        lambda _: numbers.permutation(len(scores)),
        _PROJECTING_A_STEP,
        loss_on,
        torch.optim.Adam([projection], lr=_RATE),
        lambda done: _RATE * 0.5 * (1 + math.cos(math.pi * done)),
    )
    return projection.detach().numpy().astype(np.float16)


def projected_loss(features: torch.Tensor, scores: torch.Tensor, height: float) -> torch.Tensor:
    """Return the loss of some episodes: that of their weighed scores, and of each regression's.

    Parameters
    ----------
    features : (B, n, P) tensor
        Projected gradients.
    scores : (B, n) tensor
        Scores of the network.
    height
        As for `teach_projection`.
    """
    rises = np.array([np.interp(SIZES_MM, _RISE_SIZES_MM, rise) for rise in _RISES])
    lacking = height * torch.as_tensor(rises).to(scores) - scores[:, None]
    centred = features - features.mean(1, keepdim=True)
    products, count = centred @ centred.transpose(1, 2), features.shape[1]
    each = []
    for penalty in _PENALTIES:
        hat = 1 / count + torch.linalg.solve(products + penalty * torch.eye(count), products)
        residuals = lacking - lacking @ hat.transpose(1, 2)
        each.append(scores[:, None] + lacking - residuals / freedom(hat)[:, None])
    adapted = torch.cat(each, 1)
    losses, nodules = missed(adapted, _ALL_ALIKE), int((_SIZE_PLACE > 0).sum())
    weights = torch.softmax(-_STRICTNESS * nodules * losses.detach(), 1)
    together = (adapted * weights[..., None]).sum(1)
    return (missed(together) + _SHARE_OF_EACH * (losses * weights).sum(1)).mean()


def _widest(folded: np.ndarray) -> np.ndarray:
    """Return the directions of the widest spread within benches, (1024, `KEPT`)."""
    spread = np.zeros((FOLDED, FOLDED))
    for bench in folded:
        centred = bench.astype(np.float64)
        centred -= centred.mean(axis=0)
        spread += centred.T @ centred
    return np.linalg.eigh(spread)[1][:, -KEPT:]
