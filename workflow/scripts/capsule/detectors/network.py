"""The taught scorer: a small convolutional network over the beats, and its gradient.

Simulated recordings of many random benches taught it beforehand (docs/detection.md). An archive
then adapts it. To first order, a change of the weights changes the score by the gradient times that
change. Ridge regression on the gradients therefore teaches all weights at once (the neural tangent
kernel, Jacot, Gabriel and Hongler 2018). The long gradients are folded to 1024 numbers whose
products are nearly the same (the count sketch, Charikar, Chen and Farach-Colton 2002). An archive
is too small to learn from so many numbers. So a taught projection keeps the directions in which the
score should change from bench to bench.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray, IntArray, RealArray
from capsule.seeding import generator

SENSORS = 4
# Samples between the taps of each block's convolution.
_DILATIONS = (1, 2, 4, 8, 4)
# Numbers of a folded gradient, of a projected one, and of an embedding.
FOLDED, PROJECTED, EMBEDDED = 1024, 128, 64
# The first rows from `standardised`: the series, which are 0 in a usual beat. The rows after them
# hold the spreads over the whole recording and stay unchanged.
SERIES_ROWS = 13
# In beats; a wave has four. A stretch is two waves long, and starts half a wave after the last one.
STRETCH_WIDTH, STRETCH_STEP = 8, 2
# Centre of the first stretch, in beats from the first beat.
FIRST_STRETCH = (STRETCH_WIDTH - 1) / 2


@dataclass(frozen=True)
class Features:
    """The scorer's result for one recording.

    Attributes
    ----------
    score : float
        Higher if a nodule is more likely; NaN if a sensor shows no wave.
    embedding : (64,) array of float32
        Input of the network's last layer; sizes are estimated from it.
    gradient : (128,) array of float32
        The gradient of the score by the weights, folded and projected.
    """

    score: float
    embedding: RealArray
    gradient: RealArray


UNKNOWN_FEATURES = Features(
    float("nan"), np.full(EMBEDDED, np.nan, np.float32), np.full(PROJECTED, np.nan, np.float32)
)


class Scorer:
    """The network with its weights.

    Parameters
    ----------
    weights : mapping of str to array
        The stored weights, each with ``_weight`` and ``_bias``. ``own`` is a convolution over each
        sensor's own series, and ``mix`` is one over all sensors. ``block_0`` to ``block_4`` are
        dilated convolutions, each added to its input. The last ones are ``pool``, ``embed`` and
        ``score``. The mapping also holds ``gradient_scale``, the usual length of a gradient, and
        ``projection``, an array (1024, 128) for the folded gradients.
    """

    def __init__(self, weights: Mapping[str, RealArray]) -> None:
        self._weights = {name: np.asarray(value, np.float64) for name, value in weights.items()}
        self._projection = self._weights.pop("projection") / self._weights.pop("gradient_scale")
        count = sum(value.size for value in self._weights.values())
        numbers = generator(1, "scorer", "sketch")
        self._bucket = numbers.integers(FOLDED, size=count)
        self._sign = numbers.choice([-1.0, 1.0], size=count)

    def features(self, series: FloatArray | None) -> Features:
        """Return the features of a recording; `UNKNOWN_FEATURES` without a series of four sensors.

        `series` is an array (4, 5, N) or None, from `capsule.detectors.search.series_of`.
        """
        if series is None or series.shape[0] != SENSORS:
            return UNKNOWN_FEATURES
        score, embedding, backward = self.forward(standardised(series))
        folded = np.bincount(self._bucket, self._sign * backward(), FOLDED)
        projected = folded @ self._projection
        return Features(score, embedding.astype(np.float32), projected.astype(np.float32))

    def forward(self, x: FloatArray) -> tuple[float, FloatArray, Callable[[], FloatArray]]:
        """Return score, embedding, and the backward pass; `x` is the result of `standardised`.

        The backward pass returns the gradient of the score by all weights, in their order.
        """
        w = self._weights
        windows = np.stack([_windows(row, 5, 1)[:, :, ::2] for row in x])
        count = windows.shape[-1]
        own_taps = windows.transpose(0, 2, 1, 3).reshape(len(x), -1, count)
        own = _flat(w["own_weight"]) @ own_taps + w["own_bias"][:, np.newaxis]
        first = np.maximum(own, 0.0).reshape(-1, count)
        h = w["mix_weight"] @ first + w["mix_bias"][:, np.newaxis]
        blocks = []
        for number, dilation in enumerate(_DILATIONS):
            taps = _windows(h, 3, dilation).transpose(1, 0, 2).reshape(-1, count)
            bias = w[f"block_{number}_bias"][:, np.newaxis]
            turned = _flat(w[f"block_{number}_weight"]) @ taps + bias
            blocks.append((taps, turned > 0))
            h = h + np.maximum(turned, 0.0)
        pooled, share, best = _pool(w["pool_weight"] @ h + w["pool_bias"][:, np.newaxis])
        squeezed = np.sign(pooled) * np.log1p(np.abs(pooled))
        embedding = w["embed_weight"] @ squeezed + w["embed_bias"]
        score = float(w["score_weight"] @ embedding + w["score_bias"][0])

        def backward() -> FloatArray:
            gradient = {"score_weight": embedding, "score_bias": np.ones(1)}
            gradient["embed_weight"] = np.outer(w["score_weight"], squeezed)
            gradient["embed_bias"] = w["score_weight"]
            by_pooled = (w["score_weight"] @ w["embed_weight"]) / (1.0 + np.abs(pooled))
            by_mean, by_top, by_soft = np.split(by_pooled, 3)
            dp = share * by_soft[:, np.newaxis] + by_mean[:, np.newaxis] / count
            dp[np.arange(len(dp)), best] += by_top
            gradient["pool_weight"], gradient["pool_bias"] = dp @ h.T, dp.sum(axis=1)
            dh = w["pool_weight"].T @ dp
            for number in reversed(range(len(_DILATIONS))):
                taps, active = blocks[number]
                weight, dilation = w[f"block_{number}_weight"], _DILATIONS[number]
                turned = dh * active
                gradient[f"block_{number}_weight"] = turned @ taps.T
                gradient[f"block_{number}_bias"] = turned.sum(axis=1)
                back = (_flat(weight).T @ turned).reshape(weight.shape[1], 3, count)
                dh = dh + back[:, 1]
                if dilation < count:
                    dh[:, :-dilation] += back[:, 0, dilation:]
                    dh[:, dilation:] += back[:, 2, :-dilation]
            gradient["mix_weight"], gradient["mix_bias"] = dh @ first.T, dh.sum(axis=1)
            down = (w["mix_weight"].T @ dh).reshape(own.shape) * (own > 0)
            gradient["own_weight"] = np.einsum("sot,sit->oi", down, own_taps)
            gradient["own_bias"] = down.sum(axis=(0, 2))
            return np.concatenate([gradient[name].ravel() for name in w])

        return score, embedding, backward


def standardised(series: FloatArray) -> FloatArray:
    """Return the input of the network, (S, 17, N), for the series of a recording, (S, 5, N).

    Its rows are the series in units of their own spread; their inverse hyperbolic sine; their
    difference from the mean of the other sensors; the logarithms of the spreads; and ones.
    """
    count = series.shape[-1]
    ordered = np.sort(series, axis=-1)
    median, low = (ordered[..., [round(share * (count - 1))]] for share in (0.5, 0.2))
    # A nodule raises the upper half, so the spread is measured on the lower half. In a normal
    # distribution, the 20 % quantile is 0.8416 standard deviations below the median.
    spread = np.hypot(np.clip((median - low) / 0.8416, 0.0, 30.0), 0.03)
    own_units = np.clip(series / spread, -8.0, 8.0)
    in_phase = own_units[:, [0, 1, 3]]
    others = (in_phase.sum(axis=0) - in_phase) / (len(series) - 1)
    logarithms = np.broadcast_to(np.log(spread) + 1.5, series.shape)[:, [0, 1, 3]]
    ones = np.ones((len(series), 1, count))
    parts = [own_units / 2, np.arcsinh(3 * series), (in_phase - others) / 2, logarithms, ones]
    return np.concatenate(parts, axis=1)


def _windows(values: FloatArray, taps: int, dilation: int) -> FloatArray:
    """Return the inputs of each tap of a convolution, (taps, C, N); zeros beyond the ends."""
    reach, (channels, count) = dilation * (taps // 2), values.shape
    # Ten times as fast as `numpy.pad`, which takes longer than the network's products.
    wide = np.zeros((channels, count + 2 * reach), values.dtype)
    wide[:, reach : reach + count] = values
    return np.stack([wide[:, tap * dilation : tap * dilation + count] for tap in range(taps)])


def _flat(weight: FloatArray) -> FloatArray:
    """Return a convolution's weights (O, C, taps) as a matrix."""
    return weight.reshape(weight.shape[0], -1)


def _pool(values: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return mean, maximum and soft maximum of each row, the shares in the last, and the argmax."""
    best = values.argmax(axis=1)
    top = values[np.arange(len(values)), best]
    share = np.exp(values - top[:, np.newaxis])
    total = share.sum(axis=1)
    soft = top + np.log(total) - np.log(values.shape[1])
    pooled = np.concatenate([values.mean(axis=1), top, soft])
    return pooled, share / total[:, np.newaxis], best


def score_stretches(scorer: Scorer, series: FloatArray | None) -> tuple[float, FloatArray] | None:
    """Return what the taught score loses without each stretch of a recording.

    One stretch after another is replaced by usual beats, on all sensors at once, and the recording
    is scored again (occlusion, Zeiler and Fergus 2014). These scores come from the scorer as taught
    beforehand, because every training fold adapts its own.

    Parameters
    ----------
    scorer : Scorer
        The taught scorer.
    series : (4, 5, N) array, or None
        As in `Scorer.features`.

    Returns
    -------
    score : float
        Score of the whole recording; None instead of both if the scorer gives no score.
    loss : (M,) array
        The score minus the score without the stretch; above 0 if the stretch indicates a nodule.
    """
    if series is None or series.shape[0] != SENSORS:
        return None
    x = standardised(series)
    whole = scorer.forward(x)[0]
    starts = range(0, max(x.shape[-1] - STRETCH_WIDTH, 0) + 1, STRETCH_STEP)
    loss = np.empty(len(starts))
    for number, start in enumerate(starts):
        without = x.copy()
        without[:, :SERIES_ROWS, start : start + STRETCH_WIDTH] = 0.0
        loss[number] = whole - scorer.forward(without)[0]
    return whole, loss
