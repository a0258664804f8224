"""The detector ``taught``: a scorer that many simulated benches taught, adapted to the archive.

Ridge regression on the scorer's gradients adapts its weights to first order. The archive decides
how far the score may leave the one taught beforehand (`capsule.detectors.adaptation`). The evidence
of the best passage is a further feature beside the gradients. It counts if the archive shows that
it indicates nodules.

Everything is learned inside the training fold: the adaptation, the threshold (from cross-validated
scores of the healthy recordings), the probability, the sizes and their intervals.
"""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from statistics import NormalDist
from typing import Any

import numpy as np

from capsule.arrays import FloatArray, RealArray
from capsule.detectors.adaptation import Adaptation
from capsule.detectors.intervals import conformal_reach, size_interval
from capsule.detectors.passage import Passage
from capsule.detectors.plain import plain
from capsule.detectors.probability import Probability, fit_probability
from capsule.detectors.ridge import Regression, RidgeWithout
from capsule.detectors.scorer import Features
from capsule.detectors.sizing import nearest_known
from capsule.detectors.training import JudgedRecording, TrainingArchive
from capsule.detectors.verdicts import Verdict
from capsule.kinds import Settings
from capsule.templates import TemplateSet

_UNKNOWN = float("nan")
# Evidence is clipped to this range; values beyond it add no information.
_EVIDENCE = (-1.0, 4.0)


@dataclass(frozen=True)
class TaughtModel:
    """The taught detector's model, learned from a training fold.

    Attributes
    ----------
    score : Regression or None
        Correction that the adaptation adds to the score, from `adaptation_features`; None with
        fewer than two recordings.
    evidence_weight : float
        As in `adaptation_features`.
    threshold : float
        Threshold of the adapted score; NaN with fewer than three healthy recordings.
    probability : Probability or None
        Curve from the adapted score to the probability of a nodule.
    size : Regression or None
        Regression from the embedding to the size in mm; None with fewer than two nodules.
    size_reach_mm : float
        Half the width of the interval of a size, in mm; infinite if too few nodules teach it.
    known_mm : tuple of float
        Nodule sizes of the archive.
    """

    score: Regression | None
    evidence_weight: float
    threshold: float
    probability: Probability | None
    size: Regression | None
    size_reach_mm: float
    known_mm: tuple[float, ...]

    def verdict(self, recording: JudgedRecording) -> Verdict:
        """Judge one recording."""
        features = recording.features
        if np.isnan(features.score) or self.score is None:
            return Verdict(_UNKNOWN, _UNKNOWN, self.threshold)
        passage = recording.passage
        described = adaptation_features(features, passage, self.evidence_weight)
        score = features.score + self.score.of(described)
        if np.isnan(self.threshold):
            return Verdict(_UNKNOWN, score, self.threshold)
        chance = _UNKNOWN if self.probability is None else float(self.probability.of(score))
        if score <= self.threshold:
            return Verdict(0.0, score, self.threshold, chance)
        estimate = low = high = _UNKNOWN
        if self.size is not None:
            predicted = self.size.of(features.embedding)
            estimate = min(max(predicted, self.known_mm[0]), self.known_mm[-1])
            low, high = size_interval(estimate, self.size_reach_mm, self.known_mm)
        return Verdict(
            nearest_known(estimate, self.known_mm),
            score,
            self.threshold,
            chance,
            estimate,
            passage.location_samples,
            passage.location_mm,
            estimate_low_mm=low,
            estimate_high_mm=high,
        )

    def stored(self) -> dict[str, Any]:
        """Return the model in a form that JSON can store."""
        return {"taught": plain(asdict(self))}

    @classmethod
    def restored(cls, stored: Settings, templates: TemplateSet) -> "TaughtModel":
        """Return the model from the values of `stored`; it needs no template."""
        content = dict(stored["taught"])
        for name in ("score", "size"):
            if content[name] is not None:
                coefficients = np.array(content[name]["coefficients"])
                content[name] = Regression(coefficients, content[name]["intercept"])
        if content["probability"] is not None:
            content["probability"] = Probability(**content["probability"])
        for name, absent in (("threshold", _UNKNOWN), ("size_reach_mm", float("inf"))):
            content[name] = absent if content[name] is None else float(content[name])
        return cls(**{**content, "known_mm": tuple(content["known_mm"])})


class TaughtDetector:
    """The detector ``taught``, adapted to an archive from which recordings can be left out.

    Parameters
    ----------
    archive : TrainingArchive
        The archive whose features teach; a recording without a score (NaN) teaches nothing.
    """

    Model = TaughtModel

    def __init__(self, archive: TrainingArchive) -> None:
        self._settings, self._rules = archive.settings["taught"], archive.settings["evaluation"]
        sizes_mm = archive.sizes_mm
        usable = [name for name in sizes_mm if not np.isnan(archive.features[name].score)]
        self._place = {name: place for place, name in enumerate(usable)}
        features = [archive.features[name] for name in usable]
        self._sizes_mm = np.array([sizes_mm[name] for name in usable])
        self._nodule = self._sizes_mm > 0
        self._among_nodules = np.cumsum(self._nodule) - 1
        self._known_mm = tuple(sorted({size for size in sizes_mm.values() if size > 0}))
        weight = self._settings["evidence_weight"]
        described = (
            adaptation_features(archive.features[name], archive.passages[name], weight)
            for name in usable
        )
        self._adaptation = Adaptation(
            _table(described, len(usable)),
            np.array([each.score for each in features]),
            self._sizes_mm,
            self._settings["height"],
            self._settings["penalties"],
        )
        self._sizes = RidgeWithout(
            _table((each.embedding for each in features), len(usable))[self._nodule],
            self._sizes_mm[self._nodule, np.newaxis],
            [self._settings["size_penalty"]],
        )

    def without(self, left_out: Sequence[str]) -> TaughtModel:
        """Learn from all labelled recordings except those left out."""
        places = sorted(self._place[name] for name in set(left_out) if name in self._place)
        gone = np.array(places, dtype=int)
        adapted = self._adaptation.without(gone)
        score, threshold, probability = None, _UNKNOWN, None
        if adapted is not None:
            score, scores = adapted
            nodule = np.delete(self._nodule, gone)
            threshold = upper_bound(scores[~nodule], self._rules["specificity"])
            probability = fit_probability(scores, nodule, self._rules["prevalence"])
        sized = self._sizes.without(self._among_nodules[gone[self._nodule[gone]]])
        size, reach = None, float("inf")
        if sized is not None:
            (((size,), predictions),) = sized
            true_mm = np.delete(self._sizes_mm, gone)
            errors_mm = predictions[:, 0] - true_mm[true_mm > 0]
            reach = conformal_reach(errors_mm, self._rules["size_confidence"])
        weight = self._settings["evidence_weight"]
        return TaughtModel(score, weight, threshold, probability, size, reach, self._known_mm)


def adaptation_features(features: Features, passage: Passage, evidence_weight: float) -> FloatArray:
    """Return the features of a recording that adapt its score.

    Parameters
    ----------
    features : Features
        The scorer's features of one recording.
    passage : Passage
        The recording's best candidate for a nodule.
    evidence_weight : float
        Factor on the passage's evidence. A larger factor weakens the penalty on its coefficient.

    Returns
    -------
    (129,) array
        The gradient, and the weighted evidence, which is 0 if it is unknown.
    """
    lowest, highest = _EVIDENCE
    evidence = 0.0 if np.isnan(passage.evidence) else passage.evidence
    bounded = min(max(evidence, lowest), highest)
    return np.append(features.gradient, evidence_weight * bounded)


def _table(rows: Iterable[RealArray], count: int) -> RealArray:
    """Return the features of n recordings as one array (n, P), or (0, 1) for no recording."""
    table: RealArray = np.empty((0, 1))
    for place, row in enumerate(rows):
        if place == 0:
            # Filled row by row, because a list of all rows would take the same memory again.
            table = np.empty((count, row.size), row.dtype)
        table[place] = row
    return table


def upper_bound(scores: FloatArray, share: float) -> float:
    """Return an upper bound for a new score from the same distribution.

    The bound is ``median + t sqrt(1 + pi / (2 n)) spread``. The spread is that of the upper half:
    ``spread^2 = 2 sum max(score - median, 0)^2 / (n - 1)``. So unusually low scores do not raise
    the bound, while a long upper tail does. The spread rests on half of the scores. So t is
    Student's quantile of (n - 1) / 2 degrees of freedom. The variance of the median of normal
    scores is pi / (2 n) times that of a score.

    Parameters
    ----------
    scores : (n,) array
        Scores of healthy recordings.
    share : float
        Share of new scores that should lie below the bound, such as 0.95.

    Returns
    -------
    float
        NaN with fewer than three scores.
    """
    count = scores.size
    if count < 3:
        return float("nan")
    z, freedom = NormalDist().inv_cdf(share), (count - 1) / 2
    # Student's quantile, expanded about the normal quantile (Abramowitz and Stegun 26.7.5).
    student = z + (z**3 + z) / (4 * freedom) + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * freedom**2)
    middle = np.median(scores)
    spread = np.sqrt((np.maximum(scores - middle, 0.0) ** 2).sum() / freedom)
    return float(middle + student * np.sqrt(1 + np.pi / (2 * count)) * spread)
