"""Rates by which judge_thresholds.py tells ranking from threshold.

Archives have 120 recordings. A nodule's score is that of a model which its place did not teach: the
errors of a ridge regression tell it without a further fit. Further healthy recordings are of other
set-ups: of seeds of their own, or of the other archives of a stored bench. A recording without a
verdict is a failure.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from healthy_pools import OUTSIDE, Pool
from unseen_archives import RUNS

from capsule.detectors.calibrate import Regression, fit_ridge, rank_threshold
from capsule.detectors.network import EMBEDDED
from capsule.detectors.taught import Taught

SPECIFICITY = 0.95
DIAGONAL, TAUGHT = "diagonal", "taught"
SIZES = {"1 mm": (1.0, 1.0), "from 2 mm": (2.0, np.inf)}
# Penalties of the regression that many recordings teach, for features of deviation 1.
_PENALTIES = (1.0, 10.0, 100.0, 1000.0)


class Scores(NamedTuple):
    """Scores of recordings that teach, each without itself, and of healthy ones that do not."""

    sizes_mm: np.ndarray
    taught: np.ndarray
    others: np.ndarray

    @property
    def healthy(self) -> np.ndarray:
        """The scores that set the threshold."""
        return self.taught[(self.sizes_mm == 0) & ~np.isnan(self.taught)]

    @property
    def threshold(self) -> float:
        """The threshold, as the detectors set it."""
        return rank_threshold(self.healthy, np.arange(self.healthy.size), SPECIFICITY)

    def nodules(self, sizes: str) -> np.ndarray:
        """Return the scores of the nodules of a range of sizes."""
        low, high = SIZES[sizes]
        return self.taught[(low <= self.sizes_mm) & (self.sizes_mm <= high)]

    def found(self, threshold: float) -> list[float]:
        """Return the share of nodules found, by range of sizes."""
        return [float(np.mean(self.nodules(sizes) > threshold)) for sizes in SIZES]


def scores_of(
    pool: Pool, teaching: np.ndarray, others: np.ndarray, detector: str, config: Mapping
) -> Scores:
    """Teach a detector by some recordings of a pool, and score them and others."""
    sizes_mm = pool.sizes_mm[teaching]
    if detector == DIAGONAL:
        return Scores(sizes_mm, pool.evidence[teaching], pool.evidence[others])
    seen, unseen = pool.seen[teaching], pool.seen[others]
    scores, known = np.full(teaching.size, np.nan), ~np.isnan(seen[:, 0])
    places = np.arange(np.count_nonzero(known))
    model, scores[known] = Taught.learn(seen[known], sizes_mm[known], places, config[TAUGHT])
    return Scores(sizes_mm, scores, unseen[:, 0] + model.of(unseen[:, :-EMBEDDED]))


def archives_of(pool: Pool, draws: int) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Yield each archive, several times: number, recordings, and shuffled healthy others."""
    numbers = np.random.default_rng(1)
    simulated = OUTSIDE in pool.archive
    for number in range(pool.archive.max() + 1):
        outside = pool.archive == OUTSIDE if simulated else pool.archive != number
        others = np.flatnonzero(outside & (pool.sizes_mm == 0))
        for _ in range(draws):
            yield number, np.flatnonzero(pool.archive == number), numbers.permutation(others)


def verdicts(pool: Pool, healthy: int, draws: int, config: Mapping) -> list[float]:
    """Return the shares found, and the specificity, if so many healthy recordings teach.

    Empty if too few are left to measure the specificity.
    """
    rows = []
    for _, own, others in archives_of(pool, draws):
        further, fresh = np.split(others, [healthy - RUNS])
        if fresh.size < RUNS:
            return []
        scores = scores_of(pool, np.append(own, further), fresh, TAUGHT, config)
        specificity = float(np.mean(scores.others <= scores.threshold))
        rows.append([*scores.found(scores.threshold), specificity])
    return np.mean(rows, axis=0).tolist()


def ranking(pool: Pool, config: Mapping) -> list[float]:
    """Return the shares found at the true threshold, the quantile of all healthy others."""
    rows = []
    for _, own, others in archives_of(pool, 1):
        scores = scores_of(pool, own, others, TAUGHT, config)
        rows.append(scores.found(_true_quantile(scores.others)))
    return np.mean(rows, axis=0).tolist()


def _true_quantile(healthy: np.ndarray) -> float:
    return float(np.nanquantile(healthy, SPECIFICITY))


def ranking_by_many(pool: Pool, config: Mapping) -> tuple[list[float], int]:
    """Return the shares found at the true threshold, by a regression that many archives teach.

    It learns from all that the network tells, with the best of some penalties. Half of the archives
    teach and the other half is judged, in turn. Of a stored bench, one at a time is judged.

    Returns
    -------
    list of float
        The shares.
    int
        The number of recordings that teach.
    """
    count = int(pool.archive.max()) + 1
    parts = [[*range(first, count, 2)] for first in (0, 1)]
    if OUTSIDE not in pool.archive:
        parts = [[number] for number in range(count)]
    features = pool.seen[:, 1:]
    known, scores = ~np.isnan(pool.seen[:, 0]), np.full(pool.sizes_mm.size, np.nan)
    for part in parts:
        judged = known & np.isin(pool.archive, [*part, OUTSIDE])
        teaches = known & ~judged
        scale = features[teaches].std(axis=0) + 1e-9
        model = _best_of_penalties(pool, teaches, features[teaches] / scale, config)
        scores[judged] = pool.seen[judged, 0] + model.of(features[judged] / scale)
    rows = Scores(pool.sizes_mm, scores, np.empty(0))
    taught = np.count_nonzero(~np.isin(pool.archive, [*parts[0], OUTSIDE]))
    return rows.found(_true_quantile(rows.healthy)), int(taught)


def _best_of_penalties(
    pool: Pool, teaches: np.ndarray, features: np.ndarray, config: Mapping
) -> Regression | None:
    """Return the regression that finds most of the nodules which it leaves out."""
    sizes_mm, own = pool.sizes_mm[teaches], pool.seen[teaches, 0]
    # What is wanted of a nodule, as `capsule.detectors.taught` wants it.
    rise = np.interp(sizes_mm, (0.0, 1.0, 2.0, 3.0), (0.0, 0.6, 0.9, 1.0))
    wanted = config[TAUGHT]["height"] * rise - own
    best, most = None, -1.0
    for penalty in _PENALTIES:
        model, left_out = fit_ridge(features, wanted, np.arange(own.size), penalty)
        scores = own + left_out
        found = float(np.mean(scores[sizes_mm > 0] > _true_quantile(scores[sizes_mm == 0])))
        if found > most:
            best, most = model, found
    return best
