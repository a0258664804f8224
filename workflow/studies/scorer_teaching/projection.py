"""Teach the projection of the scorer's gradients: the directions that a small archive can use.

The network stays as it is. An archive adapts its score by ridge regression on the folded gradients.
Most of their numbers do not differ between nodules and healthy recordings, and a small archive
cannot tell which. The projection keeps the combinations that helped on many benches. As in
`scorer_teaching.lesson`, an episode is a small archive of one bench, and the loss of its
leave-one-out predictions is differentiated through the closed form of the regression. Several
penalties and courses of the wanted score are tried in each episode, and each regression weighs more
the fewer nodules it misses; the detector itself uses one of them.
"""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from capsule.detectors.network import FOLDED, Scorer
from capsule.kinds import Settings
from capsule.phantom.parameters import Phantom
from capsule.seeding import generator
from scorer_teaching.episodes import SIZES_MM, Maker, episodes_of, progress, random_benches
from scorer_teaching.lesson import SIZE_PLACE, descend, freedom, missed
from scorer_teaching.network import unprojected

# Directions that are kept.
KEPT = 128
_EPISODES_A_STEP, _ROUNDS, _RATE = 8, 4, 2e-3
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


@dataclass(frozen=True)
class Gradients:
    """The scorer's results for the recordings of many benches.

    Attributes
    ----------
    folded : (B, n, 1024) array of float16
        Folded gradients of the score.
    scores : (B, n) array of float32
        Scores.
    """

    folded: np.ndarray
    scores: np.ndarray


def gradients_of(makers: Sequence[Maker], scorer: Scorer, settings: Settings) -> Gradients:
    """Simulate many benches, and return the scorer's gradients.

    Benches on which a recording has no score are left out.

    Parameters
    ----------
    makers
        Functions that simulate the recordings of one bench.
    scorer
        From `scorer_teaching.network.unprojected`.
    settings
        The configuration.
    """
    folded = np.zeros((len(makers), SIZES_MM.size, FOLDED), np.float16)
    scores = np.full((len(makers), SIZES_MM.size), np.nan, np.float32)
    for place, make in enumerate(progress(makers, "bench")):
        recordings = episodes_of([make], settings).recordings(0)
        if len(recordings) == SIZES_MM.size:
            features = [scorer.features(series) for series in recordings]
            folded[place] = [each.gradient for each in features]
            scores[place] = [each.score for each in features]
    known = ~np.isnan(scores).any(axis=1)
    return Gradients(folded[known], scores[known])


def teach_projection(
    gradients: Gradients, height: float, penalties: Sequence[float], seed: int
) -> np.ndarray:
    """Teach the projection, and return it.

    Parameters
    ----------
    gradients : Gradients
        Of benches that did not train the network.
    height : float
        Wanted rise of the score of nodules of 3 mm and more.
    penalties : sequence of float
        Penalties of the regressions that are tried.
    seed : int
        Seed of the order of the benches.

    Returns
    -------
    (1024, `KEPT`) array of float16
    """
    numbers = generator(seed, "projection")
    first = torch.as_tensor(_FIRST_FACTOR * _widest(gradients.folded), dtype=torch.float32)
    projection = nn.Parameter(first)
    optimiser = torch.optim.Adam([projection], lr=_RATE)
    benches = len(gradients.scores)
    for round_ in range(_ROUNDS):
        order = numbers.permutation(benches)
        batches = np.array_split(order, max(benches // _EPISODES_A_STEP, 1))
        losses = []
        name = f"projection, epoch {round_ + 1} of {_ROUNDS}"
        for step, batch in enumerate(progress(batches, f"{name}, step")):
            done = (round_ + step / len(batches)) / _ROUNDS
            folded = torch.as_tensor(gradients.folded[batch]).float()
            scores = torch.as_tensor(gradients.scores[batch])
            loss = loss_of(folded @ projection, scores, height, penalties)
            descend(optimiser, loss, _RATE * 0.5 * (1 + math.cos(math.pi * done)))
            losses.append(loss.item())
        print(f"{name}: loss {np.mean(losses):.3f}", file=sys.stderr)
    return projection.detach().numpy().astype(np.float16)


def loss_of(
    features: torch.Tensor, scores: torch.Tensor, height: float, penalties: Sequence[float]
) -> torch.Tensor:
    """Return the loss of some episodes: that of their weighed scores, and of each regression's.

    Parameters
    ----------
    features : (B, n, P) tensor
        Projected gradients.
    scores : (B, n) tensor
        Scores of the network.
    height, penalties
        As for `teach_projection`.

    Returns
    -------
    tensor
    """
    rises = np.array([np.interp(SIZES_MM, _RISE_SIZES_MM, rise) for rise in _RISES])
    lacking = height * torch.as_tensor(rises).to(scores) - scores[:, None]
    centred = features - features.mean(1, keepdim=True)
    products, count = centred @ centred.transpose(1, 2), features.shape[1]
    each = []
    for penalty in penalties:
        hat = 1 / count + torch.linalg.solve(products + penalty * torch.eye(count), products)
        residuals = lacking - lacking @ hat.transpose(1, 2)
        each.append(scores[:, None] + lacking - residuals / freedom(hat)[:, None])
    adapted = torch.cat(each, 1)
    losses, nodules = missed(adapted, _ALL_ALIKE), int((SIZE_PLACE > 0).sum())
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


def with_projection(
    weights: dict[str, np.ndarray],
    seed: int,
    first: int,
    count: int,
    base: Phantom | None,
    settings: Settings,
) -> dict[str, np.ndarray]:
    """Return the weights of a network with the projection, which further benches teach.

    Parameters
    ----------
    weights : dict of str to array
        From `scorer_teaching.lesson.network_weights`.
    seed : int
        Random seed.
    first, count, base
        As for `scorer_teaching.episodes.random_benches`; the first benches trained the network.
    settings : mapping
        The configuration.
    """
    makers = random_benches(seed, first, count, base)
    gradients = gradients_of(makers, unprojected(weights), settings)
    projection = teach_projection(gradients, settings["taught"]["height"], _PENALTIES, seed)
    return weights | {"projection": projection}
