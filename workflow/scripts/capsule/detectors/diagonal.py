"""What the diagonal detector learns from recordings of known size, and how it judges by it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from capsule.detectors.leaving_out import ProbabilityWithout, SizesWithout
from capsule.detectors.operating_point import Probability, fit_probability, threshold_at
from capsule.detectors.passage import Passage
from capsule.detectors.sizing import SizeModel, fit_sizes, nearest_known
from capsule.detectors.verdicts import Verdict

UNKNOWN_VALUE = float("nan")
# In usual depths; a place where nothing rises has a logarithm, too.
_LEAST_CHANNEL = 0.03


@dataclass(frozen=True)
class DiagonalModel:
    """What the diagonal detector learns from a training fold.

    Attributes
    ----------
    threshold : float
        Of the evidence.
    probability : Probability or None
        From the evidence.
    sizes : SizeModel or None
        From the features of the passage.
    known_mm : tuple of float
        Nodule sizes of the archive.
    """

    threshold: float
    probability: Probability | None
    sizes: SizeModel | None
    known_mm: tuple[float, ...]

    def verdict(self, passage: Passage) -> Verdict:
        """Judge one recording by its passage."""
        score = passage.evidence
        if np.isnan(score) or np.isnan(self.threshold):
            return Verdict(UNKNOWN_VALUE, score, self.threshold)
        detected = score > self.threshold
        chance = UNKNOWN_VALUE if self.probability is None else float(self.probability.of(score))
        if not detected:
            return Verdict(0.0, score, self.threshold, chance)
        estimate = UNKNOWN_VALUE
        if self.sizes is not None:
            estimate = float(self.sizes.estimate(size_features([passage]))[0])
        predicted = nearest_known(estimate, self.known_mm)
        place = passage.location_samples, passage.location_mm
        return Verdict(predicted, score, self.threshold, chance, estimate, *place)


def size_features(passages: Sequence[Passage]) -> np.ndarray:
    """Lay out the features from which sizes are estimated, (n, 9).

    The channels at the place, depth and shape also by their logarithms, since a size multiplies
    them; the logarithms of the channels' spreads over the run; and the time from sensor to sensor,
    since a large nodule slows the capsule down.
    """
    names = (
        "level",
        "depth",
        "shape",
        "lag_samples",
        "level_spread",
        "depth_spread",
        "shape_spread",
    )
    table = np.array([[getattr(passage, name) for name in names] for passage in passages])
    table = table.reshape(-1, len(names))
    risen = np.maximum(table[:, 1:3], _LEAST_CHANNEL)
    return np.column_stack([table[:, :4], np.log(risen), np.log(table[:, 4:])])


def fit_diagonal(
    scores: np.ndarray,
    features: np.ndarray,
    sizes_mm: np.ndarray,
    *,
    known_mm: Sequence[float],
    specificity: float,
    prevalence: float,
    size_ridge: float,
) -> DiagonalModel:
    """Learn from the labelled recordings of a training fold.

    Parameters
    ----------
    scores : (n,) array
        Evidence of each recording's passage; one without (NaN) teaches nothing.
    features : (n, 9) array
        From `size_features`.
    sizes_mm : (n,) array
        True sizes, 0 for no nodule.
    known_mm : sequence of float
        Nodule sizes of the whole archive, to which predictions are rounded.
    specificity : float
        Wanted of the threshold.
    prevalence : float
        For which the probability is stated.
    size_ridge : float
        Penalty of the size regression.

    Returns
    -------
    DiagonalModel
    """
    usable = ~np.isnan(scores)
    scores, features, sizes_mm = scores[usable], features[usable], sizes_mm[usable]
    nodule = sizes_mm > 0
    return DiagonalModel(
        threshold_at(scores[~nodule], specificity),
        fit_probability(scores, nodule, prevalence),
        fit_sizes(features[nodule], sizes_mm[nodule], size_ridge),
        tuple(known_mm),
    )


class DiagonalDetector:
    """Judges recordings by what the others of an archive teach.

    Parameters
    ----------
    passages : mapping of str to Passage
        One of each recording, labelled or not.
    sizes_mm : mapping of str to float
        True sizes of the labelled recordings.
    specificity, prevalence, size_ridge : float
        As in `fit_diagonal`.
    """

    def __init__(
        self,
        passages: Mapping[str, Passage],
        sizes_mm: Mapping[str, float],
        *,
        specificity: float,
        prevalence: float,
        size_ridge: float,
    ) -> None:
        self.passages = passages
        labelled = [passages[name] for name in sizes_mm]
        scores = np.array([passage.evidence for passage in labelled])
        usable = ~np.isnan(scores)
        names = np.array(list(sizes_mm), dtype=object)[usable]
        self._place = {name: place for place, name in enumerate(names)}
        self._scores, self._features = scores[usable], size_features(labelled)[usable]
        self._sizes_mm = np.array(list(sizes_mm.values()), dtype=np.float64)[usable]
        self._nodule = self._sizes_mm > 0
        self._among_nodules = np.cumsum(self._nodule) - 1
        self._known_mm = tuple(sorted({size for size in sizes_mm.values() if size > 0}))
        self._specificity = specificity
        self._probability = ProbabilityWithout(self._scores, self._nodule, prevalence)
        self._sizes = SizesWithout(
            self._features[self._nodule], self._sizes_mm[self._nodule], size_ridge
        )
        self._models: dict[frozenset[str], DiagonalModel] = {}

    def judge(self, name: str, left_out: Sequence[str]) -> Verdict:
        """Judge one recording; those left out teach nothing."""
        return self.model(left_out).verdict(self.passages[name])

    def model(self, left_out: Sequence[str]) -> DiagonalModel:
        """Learn from all labelled recordings but those left out."""
        key = frozenset(left_out)
        if key not in self._models:
            places = [self._place[other] for other in key if other in self._place]
            self._models[key] = self._learn(np.array(sorted(places), dtype=int))
        return self._models[key]

    def _learn(self, left_out: np.ndarray) -> DiagonalModel:
        """Learn as `fit_diagonal` does without some recordings, from what all of them teach."""
        taught = np.ones(self._scores.size, dtype=bool)
        taught[left_out] = False
        nodules = self._among_nodules[left_out[self._nodule[left_out]]]
        return DiagonalModel(
            threshold_at(self._scores[taught & ~self._nodule], self._specificity),
            self._probability.without(left_out),
            self._sizes.without(nodules),
            self._known_mm,
        )
