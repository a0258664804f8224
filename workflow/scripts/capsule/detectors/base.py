"""The base of a detector that compares one score with a threshold.

A detector says only what it sees of a recording, what it learns for its score, and which features
tell the size. The rest is the same for all: the place that is left out, the threshold, the
probability, the sizes, and how the model is stored.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import numpy as np

from capsule.arrays import FloatArray, IntArray, RealArray, plain
from capsule.detectors.calibrate import (
    Probability,
    Regression,
    SizeModel,
    fit_probability,
    fit_sizes,
    rank_threshold,
)
from capsule.detectors.training import JudgedRecording, TrainingArchive
from capsule.detectors.verdicts import Verdict
from capsule.kinds import Settings
from capsule.templates import TemplateSet

_UNKNOWN = float("nan")
# Penalty of the size regression of a detector without a setting for it.
_SIZE_RIDGE = 1.0


@dataclass(frozen=True)
class ScoredModel(ABC):
    """The model of a detector, learned from the recordings of a training fold.

    A subclass names itself and defines the score. Its name is also the key of its values in
    results/detectors.json.

    Attributes
    ----------
    threshold : float
        A score above it means a nodule; NaN if there is no healthy recording.
    learned : Regression or None
        What the score needs besides the recording; None if it needs nothing.
    probability : Probability or None
        Curve from the score to the probability of a nodule.
    sizes : SizeModel or None
        Model from features of the recording to the size.
    """

    name: ClassVar[str]

    threshold: float
    learned: Regression | None
    probability: Probability | None
    sizes: SizeModel | None

    @staticmethod
    @abstractmethod
    def seen(recording: JudgedRecording) -> RealArray:
        """Return what the detector sees of a recording, (F,); NaN in the first place: no verdict.

        Without anything learned, the first value is the score.
        """

    @classmethod
    def size_features(cls, recording: JudgedRecording) -> RealArray:
        """Return the features that tell the size, (P,); if not defined, what the detector sees."""
        return cls.seen(recording)

    @staticmethod
    def learn(
        seen: RealArray, sizes_mm: FloatArray, places: IntArray, settings: Settings
    ) -> tuple[Regression | None, FloatArray]:
        """Learn what the score needs; if not defined, nothing.

        Parameters
        ----------
        seen : (n, F) array
            From `seen`, of the training recordings.
        sizes_mm, places : (n,) array
            Their true sizes in mm, 0 for none, and the numbers of their places.
        settings : mapping
            The detector's section of the configuration.

        Returns
        -------
        Regression or None
            From `seen` to what is added to the first value.
        (n,) array
            Score of each recording by a model that its place did not teach; NaN if unknown.
        """
        return None, np.asarray(seen[:, 0], dtype=np.float64)

    def score(self, recording: JudgedRecording) -> float:
        """Return the score of one recording: higher if a nodule is more likely, NaN if unknown."""
        seen = self.seen(recording)
        return float(seen[0]) + (float(self.learned.of(seen)) if self.learned else 0.0)

    def verdict(self, recording: JudgedRecording) -> Verdict:
        """Judge one recording."""
        score = self.score(recording)
        if np.isnan(score) or np.isnan(self.threshold):
            return Verdict(_UNKNOWN, score, self.threshold)
        chance = _UNKNOWN if self.probability is None else float(self.probability.of(score))
        if score <= self.threshold:
            return Verdict(0.0, score, self.threshold, chance)
        if self.sizes is None:
            return Verdict(_UNKNOWN, score, self.threshold, chance)
        estimate = float(self.sizes.estimate(self.size_features(recording)))
        low, high = self.sizes.interval(estimate)
        where = recording.passage
        return Verdict(
            self.sizes.nearest(estimate),
            score,
            self.threshold,
            chance,
            estimate,
            where.location_samples,
            where.location_mm,
            estimate_low_mm=low,
            estimate_high_mm=high,
        )

    def stored(self) -> dict[str, Any]:
        """Return the model in a form that JSON can store, under the detector's name."""
        return {self.name: plain(asdict(self))}

    @classmethod
    def restored(cls, stored: Settings, templates: TemplateSet | None = None) -> "ScoredModel":
        """Return the model from the values of `stored`; it needs no template."""
        names = ("threshold", "learned", "probability", "sizes")
        threshold, learned, probability, sizes = (stored[cls.name][name] for name in names)
        return cls(
            _UNKNOWN if threshold is None else threshold,
            learned and Regression.restored(learned),
            probability and Probability(**probability),
            sizes and SizeModel.restored(sizes),
        )


class ScoredDetector:
    """A detector that an archive teaches, and that can leave recordings out.

    A recording of the archive that the detector sees nothing of teaches nothing.
    """

    Model: type[ScoredModel]

    def __init__(self, archive: TrainingArchive) -> None:
        self._settings = archive.settings.get(self.Model.name, {})
        self._rules = archive.settings["evaluation"]
        seen = {name: self.Model.seen(archive.recording(name)) for name in archive.sizes_mm}
        self._names = [name for name, row in seen.items() if not np.isnan(row[0])]
        self._seen = _table([seen[name] for name in self._names])
        self._sizes_mm = np.array([archive.sizes_mm[name] for name in self._names], dtype=float)
        self._places = archive.place_numbers(self._names)
        self._size_features = _table(
            [self.Model.size_features(archive.recording(name)) for name in self._names]
        )

    def without(self, left_out: Sequence[str]) -> ScoredModel:
        """Learn from all labelled recordings except those left out."""
        apart = set(left_out)
        teaches = np.array([name not in apart for name in self._names], dtype=bool)
        sizes_mm, places = self._sizes_mm[teaches], self._places[teaches]
        learned, scores = self.Model.learn(self._seen[teaches], sizes_mm, places, self._settings)
        known = ~np.isnan(scores)
        nodule, healthy = sizes_mm > 0, known & (sizes_mm == 0)
        threshold = rank_threshold(scores[healthy], places[healthy], self._rules["specificity"])
        prevalence = self._rules["prevalence"]
        return self.Model(
            threshold,
            learned,
            fit_probability(scores[known], nodule[known], places[known], prevalence),
            fit_sizes(
                self._size_features[teaches][nodule],
                sizes_mm[nodule],
                places[nodule],
                scores[nodule] > threshold,
                ridge=self._settings.get("size_ridge", _SIZE_RIDGE),
                confidence=self._rules["size_confidence"],
            ),
        )


def _table(rows: list[RealArray]) -> RealArray:
    """Return rows as one array (n, F), or (0, 1) for none."""
    return np.array(rows) if rows else np.empty((0, 1))
