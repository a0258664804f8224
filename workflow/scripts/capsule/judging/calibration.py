"""Whether a stated probability comes true."""

import numpy as np


def prevalence_weights(nodule: np.ndarray, prevalence: float) -> np.ndarray:
    """Weigh recordings so that nodules have the stated prevalence; the weights sum to 1."""
    count = np.count_nonzero(nodule)
    if count in (0, nodule.size):
        return np.full(nodule.size, np.nan)
    return np.where(nodule, prevalence / count, (1 - prevalence) / (nodule.size - count))


def brier_score(probability: np.ndarray, nodule: np.ndarray, prevalence: float) -> float:
    """Give the mean squared error of the probability at the stated prevalence; 0 is best."""
    weights = prevalence_weights(nodule, prevalence)
    return float(np.sum(weights * (probability - nodule) ** 2))


def calibration_table(
    probability: np.ndarray,
    nodule: np.ndarray,
    prevalence: float,
    bins: int,
    generator: np.random.Generator,
    repeats: int,
    confidence: float,
) -> list[dict]:
    """Compare the stated probability with the frequency observed, bin by bin.

    Parameters
    ----------
    probability : (n,) array
        Of a nodule, stated for the prevalence.
    nodule : (n,) array of bool
        The truth.
    prevalence : float
        To which the archive's recordings are weighted.
    bins : int
        Number of equal intervals of the probability.
    generator : numpy.random.Generator
        Source of the bootstrap's draws, healthy recordings and nodules apart.
    repeats : int
        Number of draws.
    confidence : float
        Level of the percentile intervals.

    Returns
    -------
    list of dict
        One row a bin: ``stated_low``, ``stated_high``, ``recordings``, ``stated`` (mean) and
        ``observed`` with ``_low`` and ``_high``; NaN where the bin is empty.
    """
    place = np.minimum((probability * bins).astype(int), bins - 1)
    weights = prevalence_weights(nodule, prevalence)
    kinds = [np.flatnonzero(nodule), np.flatnonzero(~nodule)]
    draws = np.full((repeats, bins), np.nan)
    if all(kind.size for kind in kinds):
        for repeat in range(repeats):
            drawn = np.concatenate([generator.choice(kind, kind.size) for kind in kinds])
            draws[repeat] = _observed(place[drawn], nodule[drawn], weights[drawn], bins)
    observed = _observed(place, nodule, weights, bins)
    tails = [(1 - confidence) / 2, (1 + confidence) / 2]
    rows = []
    for index in range(bins):
        inside = place == index
        known = draws[:, index][~np.isnan(draws[:, index])]
        low, high = np.quantile(known, tails) if known.size else (np.nan, np.nan)
        total = weights[inside].sum()
        stated = (weights * probability)[inside].sum() / total if total > 0 else np.nan
        rows.append(
            {
                "stated_low": index / bins,
                "stated_high": (index + 1) / bins,
                "recordings": int(inside.sum()),
                "stated": float(stated),
                "observed": float(observed[index]),
                "observed_low": float(low),
                "observed_high": float(high),
            }
        )
    return rows


def _observed(place: np.ndarray, nodule: np.ndarray, weights: np.ndarray, bins: int) -> np.ndarray:
    total = np.bincount(place, weights, bins)
    found = np.bincount(place, weights * nodule, bins)
    return np.divide(found, total, out=np.full(bins, np.nan), where=total > 0)
