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
from functools import cached_property, lru_cache

import numpy as np

from capsule.arrays import FloatArray, IntArray, RealArray

# Columns of the hat matrix that are computed together, and how many such blocks are kept.
_TOGETHER, _KEPT = 64, 6
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


class RidgeWithout:
    """A ridge regression without penalty on the mean, from which recordings can be left out.

    Parameters
    ----------
    features : (n, P) array
        Features of the recordings.
    targets : (n,) array
        The values to predict.
    penalty : float
        Penalty on the squared coefficients; above 0.
    """

    def __init__(self, features: RealArray, targets: FloatArray, penalty: float) -> None:
        self._targets, self._penalty = targets, penalty
        count, dimensions = features.shape
        if count == 0:
            return
        # Only the centred features are held, because an archive's features are large.
        self._mean = features.mean(axis=0, dtype=np.float64)
        self._centred = features - self._mean
        # Both forms give the same weights W; the one with the smaller matrix is faster. The second
        # holds no weights, because they are as large as the features.
        self._weights = self._inverse = None
        if count <= dimensions:
            gram = self._centred @ self._centred.T + penalty * np.eye(count)
            self._weights = np.linalg.solve(gram, self._centred)
        else:
            normal = self._centred.T @ self._centred + penalty * np.eye(dimensions)
            self._inverse = np.linalg.inv(normal)
        self._leverage, slope = np.empty(count), np.zeros(dimensions)
        for part in _parts(count):
            centred, weights = self._centred[part], self._weights_of(part)
            self._leverage[part] = 1.0 / count + np.einsum("np,np->n", centred, weights)
            slope += weights.T @ targets[part]
        self._residuals = targets - (targets.mean() + self._centred @ slope)
        self._moment = self._centred.T @ self._residuals
        self._block = lru_cache(_KEPT)(self._columns_of_block)

    def without(self, left_out: IntArray) -> tuple[Regression, FloatArray] | None:
        """Learn from all recordings except some.

        Parameters
        ----------
        left_out : (m,) array of int
            The recordings that teach nothing.

        Returns
        -------
        regression : Regression
            The regression that the other recordings teach.
        predictions : (n - m,) array
            Prediction for each of the others, made by the rest of them.
        None
            Instead of both, if fewer than two recordings are left.
        """
        return self._learn(left_out) if left_out.size else self._of_all

    @cached_property
    def _of_all(self) -> tuple[Regression, FloatArray] | None:
        return self._learn(np.array([], dtype=int))

    def _learn(self, left_out: IntArray) -> tuple[Regression, FloatArray] | None:
        taught = np.ones(self._targets.size, dtype=bool)
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
        targets, residuals, leverage = self._targets[taught], residuals[taught], leverage[taught]
        coefficients = moment / self._penalty
        mean = self._mean - gone.sum(axis=0) / targets.size
        intercept = float(np.mean(targets - residuals) - mean @ coefficients)
        return Regression(coefficients, intercept), targets - residuals / (1.0 - leverage)

    def _anew(self, taught: IntArray) -> tuple[Regression, FloatArray]:
        """Learn from some recordings by a new fit that holds the features of a part at a time."""
        targets = self._targets[taught]
        wanted = targets - targets.mean()
        parts = _parts(taught.size)
        shift = sum(self._centred[taught[part]].sum(axis=0) for part in parts) / taught.size
        normal, moment = self._penalty * np.eye(shift.size), np.zeros(shift.size)
        for part in parts:
            centred = self._centred[taught[part]] - shift
            normal += centred.T @ centred
            moment += centred.T @ wanted[part]
        coefficients: FloatArray = np.asarray(np.linalg.solve(normal, moment), np.float64)
        predictions = np.empty(taught.size)
        for part in parts:
            centred = self._centred[taught[part]] - shift
            leverage = 1.0 / taught.size + np.vecdot(centred, np.linalg.solve(normal, centred.T).T)
            residuals = wanted[part] - centred @ coefficients
            predictions[part] = targets[part] - residuals / (1.0 - leverage)
        intercept = float(targets.mean() - (self._mean + shift) @ coefficients)
        return Regression(coefficients, intercept), predictions

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
        return 1.0 / self._targets.size + self._centred @ weights.T, weights

    def _weights_of(self, rows: IntArray | slice) -> FloatArray:
        """Return the weights W of some recordings, (m, P)."""
        if self._weights is None:
            weights: FloatArray = self._centred[rows] @ self._inverse
            return weights
        return self._weights[rows]


def _parts(count: int) -> list[slice]:
    return [slice(start, start + _PART) for start in range(0, count, _PART)]
