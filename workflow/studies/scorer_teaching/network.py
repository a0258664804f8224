"""Define the network of `capsule.detectors.network` in torch, and check its weights there."""

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from capsule.detectors import network as detector
from capsule.detectors.network import SENSORS
from capsule.detectors.search import SERIES
from capsule.errors import CapsuleError
from scorer_teaching.episodes import Episodes

_SEEN = 17
_OWN, _WIDTH, _POOLED, _EMBEDDED = 24, 64, 48, 64
_DILATIONS = (1, 2, 4, 8, 4)
# This is subtracted after the end of a recording, so that no maximum lies there.
_FAR = 50.0
_FEWEST = 8
# Largest difference from the detector's scorer, and number of recordings of each held-out bench for
# this comparison.
_TOLERANCE = 1e-6
_COMPARED = 2


def standardised(series: torch.Tensor, counts: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the network's inputs, computed as in `capsule.detectors.network.standardised`.

    Parameters
    ----------
    series : (B, 4, 5, T) tensor
        Beats; values after the end of a recording are ignored.
    counts : (B,) tensor of int
        Number of filled windows of each recording.

    Returns
    -------
    seen : (B, 4, 17, T) tensor
        Inputs; zeros after the end.
    inside : (B, T) tensor
        1 within the recording, 0 after its end.
    """
    counts = counts.clamp(min=_FEWEST)
    length = series.shape[-1]
    inside = (torch.arange(length) < counts[:, None]).to(series)
    mask = inside[:, None, None]
    ordered = torch.where(mask > 0, series, torch.inf).sort(-1).values

    def quantile(share: float) -> torch.Tensor:
        rank = (share * (counts - 1)).round().long()[:, None, None, None]
        return ordered.gather(-1, rank.expand(*series.shape[:3], 1))

    spread = ((quantile(0.5) - quantile(0.2)) / 0.8416).clamp(0, 30)
    spread = torch.sqrt(spread**2 + 0.03**2)
    own_units = (series / spread).clamp(-8, 8) * mask
    in_phase = own_units[:, :, [0, 1, 3]]
    others = (in_phase.sum(1, keepdim=True) - in_phase) / (SENSORS - 1)
    logarithms = (torch.log(spread) + 1.5).expand(-1, -1, -1, length)[:, :, [0, 1, 3]]
    curved = torch.asinh(3 * series) * mask
    ones = mask.expand(-1, SENSORS, 1, length)
    parts = [own_units / 2, curved, (in_phase - others) / 2, logarithms * mask, ones]
    return torch.cat(parts, 2), inside


def reversed_in_time(series: torch.Tensor, counts: torch.Tensor) -> torch.Tensor:
    """Return the beats (B, 4, 5, T) of a capsule that comes from the other end of the gut."""
    length = series.shape[-1]
    place = (counts[:, None] - 1 - torch.arange(length)) % length
    turned = series.flip(1).gather(-1, place[:, None, None].expand_as(series))
    # Reversed in time, early in the wave becomes late.
    sign = torch.tensor([-1.0 if name in ("swing", "lean") else 1.0 for name in SERIES])
    return turned * sign[:, None]


class Network(nn.Module):
    """The network; its layers have the names that `capsule.detectors.network.Scorer` reads."""

    def __init__(self) -> None:
        super().__init__()
        self.own = nn.Conv1d(_SEEN, _OWN, 5, stride=2, padding=2)
        self.mix = nn.Conv1d(SENSORS * _OWN, _WIDTH, 1)
        self.block = nn.ModuleList(
            nn.Conv1d(_WIDTH, _WIDTH, 3, padding=dilation, dilation=dilation)
            for dilation in _DILATIONS
        )
        self.pool = nn.Conv1d(_WIDTH, _POOLED, 1)
        self.embed = nn.Linear(3 * _POOLED, _EMBEDDED)
        self.score = nn.Linear(_EMBEDDED, 1)

    def forward(
        self, series: torch.Tensor, counts: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the scores and the embeddings of recordings.

        Parameters
        ----------
        series : (B, 4, 5, T) tensor
            Beats.
        counts : (B,) tensor of int
            Number of filled windows of each recording.

        Returns
        -------
        score : (B,) tensor
            Score; it is higher for a nodule.
        embedding : (B, 64) tensor
            Input of the last layer.
        """
        seen, inside = standardised(series, counts)
        runs, sensors, channels, length = seen.shape
        own = functional.relu(self.own(seen.reshape(runs * sensors, channels, length)))
        mask = inside[:, None, ::2]
        h = self.mix(own.reshape(runs, -1, own.shape[-1])) * mask
        for block in self.block:
            h = h + functional.relu(block(h)) * mask
        p = self.pool(h)
        filled = mask.sum(-1)
        beyond = _FAR * (1 - mask)
        soft = torch.logsumexp(p - beyond, -1) - torch.log(filled)
        pooled = torch.cat([(p * mask).sum(-1) / filled, (p - beyond).amax(-1), soft], 1)
        embedding = self.embed(torch.sign(pooled) * torch.log1p(pooled.abs()))
        return self.score(embedding)[:, 0], embedding

    def stored(self) -> dict[str, np.ndarray]:
        """Return the weights by the names and in the shapes of `capsule.detectors.network`."""
        return {
            name.replace(".", "_"): _stored_shape(name, value.detach()).numpy().astype(np.float32)
            for name, value in self.named_parameters()
        }

    def gradient(self, series: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the score and the gradient, ordered as `stored`, of one recording (4, 5, N)."""
        recording = torch.as_tensor(series, dtype=self.score.bias.dtype)[None]
        score, _ = self(recording, torch.tensor([series.shape[-1]]))
        parts = torch.autograd.grad(score[0], list(self.parameters()))
        return score.item(), np.concatenate([part.numpy().ravel() for part in parts])


def _stored_shape(name: str, value: torch.Tensor) -> torch.Tensor:
    """Return the weights of a convolution of one tap, or of one output, without that axis."""
    if name in ("mix.weight", "pool.weight"):
        return value[..., 0]
    return value[0] if name == "score.weight" else value


def unprojected(weights: dict[str, np.ndarray]) -> detector.Scorer:
    """Return the scorer of some weights, whose gradients are folded but not projected."""
    return detector.Scorer({**weights, "projection": np.eye(detector.FOLDED)})


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
        passes = [scorer.forward(detector.standardised(series)) for series in recordings]
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
