"""What is learned without a few recordings, from sums over all of them.

Learning anew for every recording that is left out costs a pass over all others each time. Here it
costs the same however large the archive is, and differs by rounding; where what is left is too far
from the whole for that, it is learned anew.
"""

from math import comb

import numpy as np

from capsule.detectors.operating_point import Probability, fit_probability
from capsule.detectors.sizing import SizeModel, fit_sizes

# Terms of the logistic function's Taylor series, and how far it is trusted: with poles at +-i pi
# the rest is of the order of (reach / pi)^(terms + 1), below the rounding of a float.
_TERMS = 10
_REACH = 0.15
# Differences of sums that keep less than this of them have lost too many digits.
_LEAST_REST = 1e-6


class ProbabilityWithout:
    """The logistic curve of `fit_probability` without a few recordings.

    The curve hardly moves when one recording of many is left out. The log likelihood's gradient
    there follows from that of all recordings by a Taylor series in the two coefficients, whose
    sums over the recordings are made once; those left out are subtracted, and Newton's method
    finds the new curve.

    Parameters
    ----------
    scores : (n,) array
        Scores of all training recordings, none unknown.
    nodule : (n,) array of bool
        Which of them were made over a nodule.
    prevalence : float
        As in `fit_probability`.
    """

    def __init__(self, scores: np.ndarray, nodule: np.ndarray, prevalence: float) -> None:
        self._scores, self._nodule, self._prevalence = scores, nodule, prevalence
        self.whole = fit_probability(scores, nodule, prevalence)
        if self.whole is None:
            return
        self._scaled = (scores - self.whole.centre) / self.whole.scale
        self._ends = np.array([[1.0, self._scaled.min()], [1.0, self._scaled.max()]])
        odds = self.whole.intercept + self.whole.slope * self._scaled
        terms = _logistic_series(odds)
        powers = self._scaled ** np.arange(_TERMS + 2)[:, np.newaxis]
        # Sums over the healthy recordings and over the nodules, (2, terms, powers of the score).
        sums = np.stack([terms[:, kind] @ powers[:, kind].T for kind in (~nodule, nodule)])
        # Coefficients of d0^a d1^b in the sums of sigma and of sigma times the score.
        self._series = np.zeros((2, 2, _TERMS + 1, _TERMS + 1))
        for a in range(_TERMS + 1):
            for b in range(_TERMS + 1 - a):
                for moment in (0, 1):
                    self._series[:, moment, a, b] = comb(a + b, b) * sums[:, a + b, b + moment]
        ones = np.ones_like(self._scaled)
        design = np.stack([ones, self._scaled])
        self._observed = design[:, nodule].sum(axis=1)
        self._count = np.array([np.count_nonzero(~nodule), np.count_nonzero(nodule)])

    def without(self, left_out: np.ndarray) -> Probability | None:
        """Give the curve without some recordings, by their places; None as in `fit_probability`."""
        if left_out.size == 0:
            return self.whole
        found = None if self.whole is None else self._from_sums(left_out)
        if found is not None:
            return found
        taught = np.delete(np.arange(self._scores.size), left_out)
        return fit_probability(self._scores[taught], self._nodule[taught], self._prevalence)

    def _from_sums(self, left_out: np.ndarray) -> Probability | None:
        """Give the curve without some recordings; None where it moves too far."""
        gone, gone_nodule = self._scaled[left_out], self._nodule[left_out]
        count = self._count - [np.count_nonzero(~gone_nodule), np.count_nonzero(gone_nodule)]
        if count[0] < 2 or count[1] < 1:
            return None
        # The healthy recordings' mean and variance, from 0 and 1 with all of them.
        quiet = gone[~gone_nodule]
        centre = -quiet.sum() / count[0]
        variance = (self._count[0] - (quiet**2).sum()) / count[0] - centre**2
        if variance < _LEAST_REST:
            return None
        scale = np.sqrt(variance)
        weight = np.array([1 - self._prevalence, self._prevalence]) * count.sum() / count
        series = np.tensordot(weight, self._series, axes=1)
        design = np.stack([np.ones_like(gone), gone])
        each = weight[gone_nodule.astype(int)]
        observed = weight[1] * (self._observed - design[:, gone_nodule].sum(axis=1))
        # From the coefficients of the new scaled score to those of the old one.
        turn = np.array([[1.0, -centre / scale], [0.0, 1.0 / scale]])
        whole = np.array([self.whole.intercept, self.whole.slope])
        prior = np.diag([0.0, 0.1])
        found = np.linalg.solve(turn, whole)
        exponents = np.arange(_TERMS + 1)
        for _ in range(20):
            moved = turn @ found - whole
            if np.abs(self._ends @ moved).max() > _REACH:
                return None
            powers = moved[:, np.newaxis] ** exponents
            slopes = np.zeros_like(powers)
            slopes[:, 1:] = exponents[1:] * powers[:, :-1]
            said = 1.0 / (1.0 + np.exp(-(whole + moved) @ design))
            gradient = observed - powers[0] @ series @ powers[1] + design @ (each * said)
            curvature = np.stack([slopes[0] @ series @ powers[1], powers[0] @ series @ slopes[1]])
            curvature = curvature - (design * (each * said * (1 - said))) @ design.T
            step = np.linalg.solve(
                turn.T @ curvature @ turn + prior, turn.T @ gradient - prior @ found
            )
            found = found + step
            if np.abs(step).max() < 1e-12:
                return Probability(
                    self.whole.centre + self.whole.scale * float(centre),
                    self.whole.scale * float(scale),
                    float(found[0]),
                    float(found[1]),
                )
        return None


def _logistic_series(odds: np.ndarray) -> np.ndarray:
    """Give the Taylor coefficients of the logistic function sigma at each of n places, (T, n)."""
    sigma = 1.0 / (1.0 + np.exp(-np.clip(odds, -50.0, 50.0)))
    # Every derivative of sigma is a polynomial of sigma, since sigma' = sigma - sigma^2.
    derivative, change = np.polynomial.Polynomial([0, 1]), np.polynomial.Polynomial([0, 1, -1])
    terms = []
    for order in range(_TERMS + 1):
        terms.append(derivative(sigma))
        derivative = derivative.deriv() * change / (order + 1)
    return np.array(terms)


class SizesWithout:
    """The size model of `fit_sizes` without a few recordings: sums over all, minus those.

    Parameters
    ----------
    features : (n, F) array
        Features of all training recordings made over nodules.
    sizes_mm : (n,) array
        Their true sizes.
    ridge : float
        As in `fit_sizes`.
    """

    def __init__(self, features: np.ndarray, sizes_mm: np.ndarray, ridge: float) -> None:
        self._features, self._sizes_mm, self._ridge = features, sizes_mm, ridge
        self.whole = fit_sizes(features, sizes_mm, ridge)
        if self.whole is None:
            return
        self._mean, self._mean_mm = features.mean(axis=0), sizes_mm.mean()
        self._centred, self._centred_mm = features - self._mean, sizes_mm - self._mean_mm
        self._square = self._centred.T @ self._centred
        self._product = self._centred.T @ self._centred_mm
        self._known_mm, self._of_size = np.unique(sizes_mm, return_counts=True)

    def without(self, left_out: np.ndarray) -> SizeModel | None:
        """Give the model without some recordings, by their places; None without any other."""
        if left_out.size == 0:
            return self.whole
        found = self._from_sums(left_out)
        if found is not None:
            return found
        taught = np.delete(np.arange(self._sizes_mm.size), left_out)
        return fit_sizes(self._features[taught], self._sizes_mm[taught], self._ridge)

    def _from_sums(self, left_out: np.ndarray) -> SizeModel | None:
        """Give the model without some recordings; None where too few digits would be left."""
        count = self._sizes_mm.size - left_out.size
        if count < 1:
            return None
        gone, gone_mm = self._centred[left_out], self._centred_mm[left_out]
        # The sums about the new means, from those about the means of all.
        shift, shift_mm = -gone.sum(axis=0) / count, -gone_mm.sum() / count
        square = self._square - gone.T @ gone - count * np.outer(shift, shift)
        product = self._product - gone.T @ gone_mm - count * shift * shift_mm
        spread = np.diag(square)
        if np.any(spread < _LEAST_REST * np.diag(self._square)) or not np.all(spread > 0):
            return None
        scale = np.sqrt(spread / count)
        normal = square / np.outer(scale, scale) + self._ridge * np.eye(scale.size)
        coefficients = np.linalg.solve(normal, product / scale)
        places = np.searchsorted(self._known_mm, self._sizes_mm[left_out])
        rest = self._of_size - np.bincount(places, minlength=self._known_mm.size)
        left_mm = self._known_mm[rest > 0]
        return SizeModel(
            self._mean + shift,
            scale,
            coefficients,
            float(self._mean_mm + shift_mm),
            float(left_mm[0]),
            float(left_mm[-1]),
        )
