"""Ridge regression that tells at once what it learns without some of its recordings.

Everything follows from the hat matrix H of all recordings and their residuals r (Cook and Weisberg
1982). Without the recordings I the residuals become ``r + H[:, I] (1 - H[I, I])^-1 r[I]`` and the
leverages ``h + diag(H[:, I] (1 - H[I, I])^-1 H[I, :])``. The coefficients are the features of the
recordings that teach, weighted by their residuals over the penalty.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Regression:
    """A linear function of the features.

    Attributes
    ----------
    coefficients : (P,) array
        One a feature.
    intercept : float
        Value at features of 0.
    """

    coefficients: np.ndarray
    intercept: float

    def of(self, features: np.ndarray) -> float:
        """Return the value at some features (P,)."""
        return self.intercept + float(np.asarray(features, np.float64) @ self.coefficients)


class RidgeWithout:
    """Ridge regressions, with an unpenalised mean, from which recordings may be left out.

    Parameters
    ----------
    features : (n, P) array
        Features of the recordings.
    targets : (n,) array
        What is to be predicted.
    penalty : float
        On the squared coefficients; above 0.
    """

    def __init__(self, features: np.ndarray, targets: np.ndarray, penalty: float) -> None:
        self._features = np.asarray(features, np.float64)
        self._targets, self._penalty = targets, penalty
        count, dimensions = self._features.shape
        if count == 0:
            return
        centred = self._features - self._features.mean(axis=0)
        # Of two equal forms the one with the smaller matrix.
        if count <= dimensions:
            gram = centred @ centred.T
            smooth = np.linalg.solve(gram + penalty * np.eye(count), gram)
        else:
            normal = centred.T @ centred + penalty * np.eye(dimensions)
            smooth = centred @ np.linalg.solve(normal, centred.T)
        self._hat = 1.0 / count + (smooth + smooth.T) / 2
        self._residuals = targets - self._hat @ targets

    def without(self, left_out: np.ndarray) -> tuple[Regression, np.ndarray] | None:
        """Learn from all recordings but some.

        Parameters
        ----------
        left_out : (m,) array of int
            The recordings that teach nothing.

        Returns
        -------
        regression : Regression
            What the others teach.
        predictions : (n - m,) array
            Of each of the others, by the rest of them.
        None
            Where fewer than two are left to teach.
        """
        taught = np.ones(self._targets.size, dtype=bool)
        taught[left_out] = False
        if np.count_nonzero(taught) < 2:
            return None
        residuals, leverage = self._residuals, np.diagonal(self._hat)
        if left_out.size:
            columns = self._hat[:, left_out]
            inner = np.eye(left_out.size) - columns[left_out]
            solved = np.linalg.solve(inner, np.column_stack([residuals[left_out], columns.T]))
            residuals = residuals + columns @ solved[:, 0]
            leverage = leverage + np.einsum("ni,in->n", columns, solved[:, 1:])
        features, targets = self._features[taught], self._targets[taught]
        residuals, leverage = residuals[taught], leverage[taught]
        coefficients = features.T @ residuals / self._penalty
        intercept = float(np.mean(targets - features @ coefficients - residuals))
        return Regression(coefficients, intercept), targets - residuals / (1.0 - leverage)
