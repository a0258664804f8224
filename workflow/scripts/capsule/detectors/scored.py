"""Base classes for a detector that compares one score with a threshold.

The threshold is learned from healthy recordings. A subclass computes the score of a recording. The
size of a detected nodule is the one whose mean score is nearest.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from capsule.detectors.operating_point import threshold_at
from capsule.detectors.training import JudgedRecording, TrainingArchive
from capsule.detectors.verdicts import Verdict
from capsule.kinds import Settings
from capsule.templates import TemplateSet

_UNKNOWN = float("nan")


@dataclass(frozen=True)
class ScoredModel(ABC):
    """The model of a scored detector, learned from the recordings of a training fold.

    Attributes
    ----------
    threshold : float
        A score above it means a nodule; NaN if there is no healthy recording.
    usual : dict of float to float
        Mean score of each nodule size in mm.
    """

    threshold: float
    usual: Mapping[float, float]
    # The detector's name, under which results/detectors.json keeps the model.
    name: ClassVar[str]

    @staticmethod
    @abstractmethod
    def score(recording: JudgedRecording) -> float:
        """Return the score of one recording: higher if a nodule is more likely, NaN if unknown."""

    def verdict(self, recording: JudgedRecording) -> Verdict:
        """Judge one recording."""
        score = self.score(recording)
        if np.isnan(score) or np.isnan(self.threshold):
            return Verdict(_UNKNOWN, score, self.threshold)
        if score <= self.threshold or not self.usual:
            return Verdict(0.0 if score <= self.threshold else _UNKNOWN, score, self.threshold)
        size_mm = min(self.usual, key=lambda size: abs(self.usual[size] - score))
        return Verdict(size_mm, score, self.threshold, estimate_mm=size_mm)

    def stored(self) -> dict[str, Any]:
        """Return the model in a form that JSON can store, under the detector's name."""
        threshold = None if np.isnan(self.threshold) else self.threshold
        return {self.name: {"threshold": threshold, "usual": list(self.usual.items())}}

    @classmethod
    def restored(cls, stored: Settings, templates: TemplateSet) -> "ScoredModel":
        """Return the model from the values of `stored`; it needs no template."""
        threshold, usual = stored[cls.name]["threshold"], stored[cls.name]["usual"]
        return cls(_UNKNOWN if threshold is None else threshold, dict(map(tuple, usual)))


class ScoredDetector:
    """A detector that learns the threshold of a score; a subclass sets its `Model`.

    Parameters
    ----------
    archive : TrainingArchive
        The archive whose labelled recordings are scored once; an unknown score teaches nothing.
    """

    Model: type[ScoredModel]

    def __init__(self, archive: TrainingArchive) -> None:
        scores = {name: self.Model.score(archive.recording(name)) for name in archive.sizes_mm}
        known = [name for name, score in scores.items() if not np.isnan(score)]
        self._place = {name: place for place, name in enumerate(known)}
        self._scores = np.array([scores[name] for name in known], dtype=np.float64)
        self._sizes_mm = np.array([archive.sizes_mm[name] for name in known], dtype=np.float64)
        self._known_mm = sorted({size for size in archive.sizes_mm.values() if size > 0})
        self._specificity = archive.settings["evaluation"]["specificity"]

    def without(self, left_out: Sequence[str]) -> ScoredModel:
        """Learn from all labelled recordings except those left out."""
        taught = np.ones(self._scores.size, dtype=bool)
        taught[[self._place[name] for name in left_out if name in self._place]] = False
        scores, sizes_mm = self._scores[taught], self._sizes_mm[taught]
        # Sorted, because rounding makes a mean depend on the order.
        of_size = {size: np.sort(scores[sizes_mm == size]) for size in self._known_mm}
        usual = {size: float(np.mean(each)) for size, each in of_size.items() if each.size}
        return self.Model(threshold_at(scores[sizes_mm == 0], self._specificity), usual)
