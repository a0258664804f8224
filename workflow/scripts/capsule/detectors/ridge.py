"""Ridge regressions with several penalties that can leave recordings out.

**A few** are left out without a new fit. With the centred features C, the penalty l and
``W = (C^T C + l)^-1 C^T``, the hat matrix is ``H = 1 / n + C W``. Without the recordings I the
residuals r become ``r' = r + H[:, I] (1 - H[I, I])^-1 r[I]``. The leverages become
``h + diag(H[:, I] (1 - H[I, I])^-1 H[I, :])`` (Cook and Weisberg 1982). The coefficients are the
sum of the teaching recordings' centred features, each weighted by its residual over the penalty.
The residuals sum to 0, so any centre will do. Since ``C^T C W = C^T - l W``, they follow from the
coefficients of all recordings without a pass over all features.

**Many** are left out by a new fit along the principal axes of the others, which all penalties
share. With the squared lengths d of the features along the axes, a penalty divides by ``d + l``
what the features along an axis teach, and what they add to a leverage.

No matrix of recordings by recordings is stored. Memory, and the time to leave recordings out, grow
linearly with the number of recordings.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from capsule.arrays import BoolArray, FloatArray, IntArray, RealArray

# Columns of the hat matrix that are computed together, and how many such blocks are kept.
_TOGETHER, _KEPT = 64, 3
# If more recordings than these are left out, a new fit of the others is faster.
_FEW = 32
# Recordings whose weights, or whose features for a new fit, are held at a time.
_PART = 1024


@dataclass(frozen=True)
class Regression:
    """A linear function of the features.

    Attributes
    ----------
    coefficients : (P,) array
        One coefficient for each feature.
    intercept : float
        Value at features of 0.
    """

    coefficients: FloatArray
    intercept: float

    def of(self, features: RealArray) -> float:
        """Return the value at some features (P,)."""
        return self.intercept + float(np.asarray(features, np.float64) @ self.coefficients)


class Fold(NamedTuple):
    """The regressions that some recordings teach.

    Attributes
    ----------
    regressions : list of T Regression
        One regression for each target.
    predictions : (n - m, T) array
        Targets of each recording that teaches, predicted by the rest of them.
    """

    regressions: list[Regression]
    predictions: FloatArray


class RidgeWithout:
    """Ridge regressions without penalty on the mean, from which recordings can be left out.

    Parameters
    ----------
    features : (n, P) array
        Features of the recordings.
    targets : (n, T) array
        The values to predict, T of each recording.
    penalties : sequence of float
        Penalty of each regression on its squared coefficients; above 0.
    """

    def __init__(
        self, features: RealArray, targets: FloatArray, penalties: Sequence[float]
    ) -> None:
        self._targets, self._penalties = targets, np.array(penalties, dtype=np.float64)
        # Only the centred features are held, because an archive's features are large.
        self._mean: FloatArray = np.zeros(features.shape[1])
        if features.size:
            self._mean = features.mean(axis=0, dtype=np.float64)
        self._centred: FloatArray = features - self._mean
        # A caller may ask for a fold to weigh the regressions, and again to use them.
        self._folds = lru_cache(2)(self._learn)

    def without(self, left_out: IntArray) -> list[Fold] | None:
        """Learn from all recordings except some.

        Parameters
        ----------
        left_out : (m,) array of int
            The recordings that teach nothing.

        Returns
        -------
        list of Fold, or None
            What the others teach, with each penalty; None if fewer than two are left.
        """
        return self._folds(tuple(left_out.tolist()))

    def _learn(self, places: tuple[int, ...]) -> list[Fold] | None:
        count, dimensions = self._centred.shape
        left_out, taught = np.array(places, dtype=int), np.ones(count, dtype=bool)
        taught[left_out] = False
        if np.count_nonzero(taught) < 2:
            return None
        if left_out.size > _FEW and count > dimensions:
            return self._learn_anew(left_out, np.flatnonzero(taught))
        return [whole.without(left_out, taught) for whole in self._wholes]

    @cached_property
    def _wholes(self) -> list["_Whole"]:
        count, dimensions = self._centred.shape
        product = self._products[0] if count > dimensions else self._centred @ self._centred.T
        return [
            _Whole(self._mean, self._centred, product, self._targets, penalty)
            for penalty in self._penalties.tolist()
        ]

    @cached_property
    def _products(self) -> tuple[FloatArray, FloatArray]:
        """The products C^T C, (P, P), and C^T Y with the targets Y, (P, T)."""
        return self._centred.T @ self._centred, self._centred.T @ self._targets

    def _learn_anew(self, left_out: IntArray, taught: IntArray) -> list[Fold]:
        """Learn by a new fit that holds the features of a part of the recordings at a time."""
        targets, gone, count = self._targets[taught], self._centred[left_out], taught.size
        # The centred features of all recordings sum to 0.
        shift, middle = -gone.sum(axis=0) / count, targets.mean(axis=0)
        whole, moment = self._products
        squares, axes = np.linalg.eigh(whole - gone.T @ gone - count * np.outer(shift, shift))
        moment = moment - gone.T @ self._targets[left_out] - count * np.outer(shift, middle)
        # Rounding can leave a length of 0 below 0.
        inverse = 1.0 / (np.maximum(squares, 0.0)[:, np.newaxis] + self._penalties)
        slopes = inverse.T[:, :, np.newaxis] * (axes.T @ moment)
        predictions = np.empty((len(slopes), *targets.shape))
        for part in _parts(count):
            along = (self._centred[taught[part]] - shift) @ axes
            leverage = 1.0 / count + (along**2 @ inverse).T
            residuals = targets[part] - middle - along @ slopes
            predictions[:, part] = targets[part] - residuals / (1.0 - leverage[..., np.newaxis])
        coefficients = axes @ slopes
        intercepts = middle - (self._mean + shift) @ coefficients
        fitted = zip(coefficients, intercepts, predictions, strict=True)
        return [Fold(_regressions(each, constant), of) for each, constant, of in fitted]


class _Whole:
    """The regression with one penalty that all recordings teach, and a few can leave.

    Parameters
    ----------
    mean : (P,) array
        Mean of the features.
    centred : (n, P) array
        The features without it, C.
    product : (P, P) or (n, n) array
        C^T C, or C C^T if there are no more recordings than features.
    targets, penalty
        As in `RidgeWithout`.
    """

    def __init__(
        self,
        mean: FloatArray,
        centred: FloatArray,
        product: FloatArray,
        targets: FloatArray,
        penalty: float,
    ) -> None:
        self._mean, self._centred = mean, centred
        self._targets, self._penalty = targets, penalty
        self._block = lru_cache(_KEPT)(self._columns_of_block)
        count, dimensions = centred.shape
        # Both forms give the same weights W; the one with the smaller matrix is faster. The second
        # holds no weights, because they are as large as the features.
        self._weights: FloatArray | None = None
        if count <= dimensions:
            gram = product + penalty * np.eye(count)
            self._weights = np.asarray(np.linalg.solve(gram, centred), np.float64)
        else:
            normal = product + penalty * np.eye(dimensions)
            self._inverse: FloatArray = np.asarray(np.linalg.inv(normal), np.float64)
        self._leverage, slope = np.empty(count), np.zeros((dimensions, targets.shape[1]))
        for part in _parts(count):
            weights = self._weights_of(part)
            self._leverage[part] = 1.0 / count + np.einsum("np,np->n", centred[part], weights)
            slope += weights.T @ targets[part]
        self._residuals = targets - (targets.mean(axis=0) + centred @ slope)
        self._moment = centred.T @ self._residuals

    def without(self, left_out: IntArray, taught: BoolArray) -> Fold:
        """Leave some recordings out (m,), so that the others teach (n,)."""
        residuals, leverage, moment = self._residuals, self._leverage, self._moment
        gone = self._centred[left_out]
        if left_out.size:
            columns, weights = self._columns(left_out)
            inverse = np.linalg.inv(np.eye(left_out.size) - columns[left_out])
            moving = inverse @ residuals[left_out]
            residuals = residuals + columns @ moving
            leverage = leverage + np.vecdot(columns @ inverse, columns)
            moment = moment + (gone - self._penalty * weights).T @ moving
            moment -= gone.T @ residuals[left_out]
        targets, residuals = self._targets[taught], residuals[taught]
        coefficients = moment / self._penalty
        mean = self._mean - gone.sum(axis=0) / len(targets)
        intercepts = (targets - residuals).mean(axis=0) - mean @ coefficients
        predictions = targets - residuals / (1.0 - leverage[taught, np.newaxis])
        return Fold(_regressions(coefficients, intercepts), predictions)

    def _columns(self, left_out: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return some columns of the hat matrix, (n, m), and the weights of these, (m, P).

        Neighbouring recordings are mostly left out one after the other. Computing their columns
        together takes a fraction of the time.
        """
        blocks, places = np.divmod(left_out, _TOGETHER)
        if blocks.max() - blocks.min() >= _KEPT - 1:
            return self._columns_of(left_out)
        columns, weights = [], []
        for block, place in zip(blocks.tolist(), places.tolist(), strict=True):
            of_block = self._block(block)
            columns.append(of_block[0][:, place])
            weights.append(of_block[1][place])
        return np.column_stack(columns), np.array(weights)

    def _columns_of_block(self, block: int) -> tuple[FloatArray, FloatArray]:
        return self._columns_of(slice(block * _TOGETHER, (block + 1) * _TOGETHER))

    def _columns_of(self, rows: IntArray | slice) -> tuple[FloatArray, FloatArray]:
        weights = self._weights_of(rows)
        return 1.0 / len(self._targets) + self._centred @ weights.T, weights

    def _weights_of(self, rows: IntArray | slice) -> FloatArray:
        """Return the weights W of some recordings, (m, P)."""
        if self._weights is None:
            weights: FloatArray = self._centred[rows] @ self._inverse
            return weights
        return self._weights[rows]


def _regressions(coefficients: FloatArray, intercepts: FloatArray) -> list[Regression]:
    pairs = zip(coefficients.T, intercepts.tolist(), strict=True)
    return [Regression(column, intercept) for column, intercept in pairs]


def _parts(count: int) -> list[slice]:
    return [slice(start, start + _PART) for start in range(0, count, _PART)]
