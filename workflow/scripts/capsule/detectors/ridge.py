"""Ridge regression that can leave recordings out without a new fit.

With the centred features C, the penalty l and ``W = (C^T C + l)^-1 C^T``, the hat matrix is
``H = 1 / n + C W``. Without the recordings I the residuals r become
``r' = r + H[:, I] (1 - H[I, I])^-1 r[I]``. The leverages become
``h + diag(H[:, I] (1 - H[I, I])^-1 H[I, :])`` (Cook and Weisberg 1982). The coefficients are the
sum of the teaching recordings' centred features, each weighted by its residual over the penalty.
The residuals sum to 0, so any centre will do. Since ``C^T C W = C^T - l W``, they follow from the
coefficients of all recordings without a pass over all features.

No matrix of recordings by recordings is stored. Memory, and the time to leave one recording out,
grow linearly with the number of recordings. Many recordings are left out by a new fit.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from capsule.arrays import FloatArray, IntArray, RealArray

# Columns of the hat matrix that are computed together, and how many such blocks are kept.
_TOGETHER, _KEPT = 64, 3
# Recordings times recordings left out. Beyond it, a new fit of the others takes less memory.
_LARGEST_UPDATE = 2**22
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


class Centred:
    """Features without their mean, which regressions with several penalties share.

    Parameters
    ----------
    features : (n, P) array
        Features of the recordings.
    """

    def __init__(self, features: RealArray) -> None:
        # Only the centred features are held, because an archive's features are large.
        self.mean: FloatArray = np.empty(0)
        self.values: FloatArray = np.empty((0, 0))
        if features.size:
            self.mean = features.mean(axis=0, dtype=np.float64)
            self.values = features - self.mean


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
    """A ridge regression without penalty on the mean, from which recordings can be left out.

    Parameters
    ----------
    features : Centred
        Features of n recordings.
    targets : (n, T) array
        The values to predict, T of each recording.
    penalty : float
        Penalty on the squared coefficients; above 0.
    """

    def __init__(self, features: Centred, targets: FloatArray, penalty: float) -> None:
        self._targets, self._penalty = targets, penalty
        self._mean, self._centred = features.mean, features.values
        self._block = lru_cache(_KEPT)(self._columns_of_block)
        # A caller may ask for a fold to weigh the regression, and again to use it.
        self._fold = lru_cache(2)(self._learn)
        count, dimensions = self._centred.shape
        if count == 0:
            return
        # Both forms give the same weights W; the one with the smaller matrix is faster. The second
        # holds no weights, because they are as large as the features.
        self._weights: FloatArray | None = None
        if count <= dimensions:
            gram = self._centred @ self._centred.T + penalty * np.eye(count)
            self._weights = np.asarray(np.linalg.solve(gram, self._centred), np.float64)
        else:
            normal = self._centred.T @ self._centred + penalty * np.eye(dimensions)
            self._inverse: FloatArray = np.asarray(np.linalg.inv(normal), np.float64)
        self._leverage, slope = np.empty(count), np.zeros((dimensions, targets.shape[1]))
        for part in _parts(count):
            centred, weights = self._centred[part], self._weights_of(part)
            self._leverage[part] = 1.0 / count + np.einsum("np,np->n", centred, weights)
            slope += weights.T @ targets[part]
        self._residuals = targets - (targets.mean(axis=0) + self._centred @ slope)
        self._moment = self._centred.T @ self._residuals

    def without(self, left_out: IntArray) -> Fold | None:
        """Learn from all recordings except some.

        Parameters
        ----------
        left_out : (m,) array of int
            The recordings that teach nothing.

        Returns
        -------
        Fold or None
            What the others teach; None if fewer than two are left.
        """
        return self._fold(tuple(left_out.tolist()))

    def _learn(self, places: tuple[int, ...]) -> Fold | None:
        left_out = np.array(places, dtype=int)
        taught = np.ones(len(self._targets), dtype=bool)
        taught[left_out] = False
        if np.count_nonzero(taught) < 2:
            return None
        if left_out.size * taught.size > _LARGEST_UPDATE:
            return self._anew(np.flatnonzero(taught))
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

    def _anew(self, taught: IntArray) -> Fold:
        """Learn from some recordings by a new fit that holds the features of a part at a time."""
        targets = self._targets[taught]
        wanted = targets - targets.mean(axis=0)
        parts = _parts(taught.size)
        shift = sum(self._centred[taught[part]].sum(axis=0) for part in parts) / taught.size
        normal = self._penalty * np.eye(shift.size)
        moment = np.zeros((shift.size, targets.shape[1]))
        for part in parts:
            centred = self._centred[taught[part]] - shift
            normal += centred.T @ centred
            moment += centred.T @ wanted[part]
        coefficients: FloatArray = np.asarray(np.linalg.solve(normal, moment), np.float64)
        predictions = np.empty_like(targets)
        for part in parts:
            centred = self._centred[taught[part]] - shift
            leverage = 1.0 / taught.size + np.vecdot(centred, np.linalg.solve(normal, centred.T).T)
            residuals = wanted[part] - centred @ coefficients
            predictions[part] = targets[part] - residuals / (1.0 - leverage[:, np.newaxis])
        intercepts = targets.mean(axis=0) - (self._mean + shift) @ coefficients
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
