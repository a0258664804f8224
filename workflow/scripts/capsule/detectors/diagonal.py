"""The diagonal detector: learning from recordings of known size, and its verdict."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.intervals import conformal_reach, size_interval
from capsule.detectors.leaving_out import ProbabilityWithout, SizesWithout
from capsule.detectors.operating_point import threshold_at
from capsule.detectors.passage import Passage
from capsule.detectors.plain import plain
from capsule.detectors.probability import Probability
from capsule.detectors.sizing import SizeModel, nearest_known
from capsule.detectors.training import JudgedRecording, TrainingArchive
from capsule.detectors.verdicts import Verdict
from capsule.kinds import Settings
from capsule.templates import TemplateSet

UNKNOWN_VALUE = float("nan")
# In usual depths. A lower limit, so that a place without raised beats has a logarithm, too.
_LEAST_CHANNEL = 0.03


@dataclass(frozen=True)
class DiagonalModel:
    """The diagonal detector's model, learned from a training fold.

    Attributes
    ----------
    threshold : float
        Threshold of the evidence.
    probability : Probability or None
        Curve from the evidence to the probability of a nodule.
    sizes : SizeModel or None
        Model from the features of the passage to the size.
    size_reach_mm : float
        Half the width of the interval of a size, in mm; infinite if too few nodules teach it.
    known_mm : tuple of float
        Nodule sizes of the archive.
    """

    threshold: float
    probability: Probability | None
    sizes: SizeModel | None
    size_reach_mm: float
    known_mm: tuple[float, ...]

    def verdict(self, recording: JudgedRecording) -> Verdict:
        """Judge one recording by its passage."""
        passage = recording.passage
        score = passage.evidence
        if np.isnan(score) or np.isnan(self.threshold):
            return Verdict(UNKNOWN_VALUE, score, self.threshold)
        detected = score > self.threshold
        chance = UNKNOWN_VALUE if self.probability is None else float(self.probability.of(score))
        if not detected:
            return Verdict(0.0, score, self.threshold, chance)
        estimate = low = high = UNKNOWN_VALUE
        if self.sizes is not None:
            estimate = float(self.sizes.estimate(size_features([passage]))[0])
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
        return {"diagonal": plain(asdict(self))}

    @classmethod
    def restored(cls, stored: Settings, templates: TemplateSet | None) -> "DiagonalModel":
        """Return the model from the values of `stored`; it needs no template."""
        content = dict(stored["diagonal"])
        sizes, probability = content.pop("sizes"), content.pop("probability")
        if sizes is not None:
            arrays = {name: np.array(sizes[name]) for name in ("mean", "scale", "coefficients")}
            sizes = SizeModel(**{**sizes, **arrays})
        threshold, known_mm = content.pop("threshold"), content.pop("known_mm")
        reach_mm = content.pop("size_reach_mm")
        return cls(
            threshold=UNKNOWN_VALUE if threshold is None else float(threshold),
            probability=None if probability is None else Probability(**probability),
            sizes=sizes,
            size_reach_mm=float("inf") if reach_mm is None else float(reach_mm),
            known_mm=tuple(known_mm),
            **content,
        )


def size_features(passages: Sequence[Passage]) -> FloatArray:
    """Return the features from which sizes are estimated, (n, 9).

    The features are the channels at the place, the time from sensor to sensor, the logarithms of
    depth and shape, and the logarithms of the channels' spreads over the run. Logarithms fit,
    because the size multiplies depth and shape. The time fits, because a large nodule slows the
    capsule down.
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


class DiagonalDetector:
    """The detector ``diagonal``, taught by an archive.

    Parameters
    ----------
    archive : TrainingArchive
        The archive whose passages teach; a recording without one (NaN) teaches nothing.
    """

    Model = DiagonalModel

    def __init__(self, archive: TrainingArchive) -> None:
        sizes_mm, rules = archive.sizes_mm, archive.settings["evaluation"]
        labelled = [archive.passages[name] for name in sizes_mm]
        scores = np.array([passage.evidence for passage in labelled])
        usable = ~np.isnan(scores)
        names = np.array(list(sizes_mm), dtype=object)[usable]
        self._place = {name: place for place, name in enumerate(names)}
        self._scores, self._features = scores[usable], size_features(labelled)[usable]
        self._sizes_mm = np.array(list(sizes_mm.values()), dtype=np.float64)[usable]
        self._nodule = self._sizes_mm > 0
        self._among_nodules = np.cumsum(self._nodule) - 1
        self._known_mm = tuple(sorted({size for size in sizes_mm.values() if size > 0}))
        self._rules = rules
        self._probability = ProbabilityWithout(self._scores, self._nodule, rules["prevalence"])
        self._sizes = SizesWithout(
            self._features[self._nodule],
            self._sizes_mm[self._nodule],
            archive.settings["diagonal"]["size_ridge"],
        )

    def without(self, left_out: Sequence[str]) -> DiagonalModel:
        """Learn from all labelled recordings except those left out."""
        places = sorted(self._place[name] for name in set(left_out) if name in self._place)
        gone = np.array(places, dtype=int)
        taught = np.ones(self._scores.size, dtype=bool)
        taught[gone] = False
        gone_nodules = self._among_nodules[gone[self._nodule[gone]]]
        threshold = threshold_at(self._scores[taught & ~self._nodule], self._rules["specificity"])
        # Only detected nodules get a size. No nodule influences the threshold, so a new detected
        # nodule is like those detected here (selection-conditional conformal, Jin and Ren 2025).
        detected = self._scores[taught & self._nodule] > threshold
        errors = self._sizes.errors_without(gone_nodules)[detected]
        return DiagonalModel(
            threshold,
            self._probability.without(gone),
            self._sizes.without(gone_nodules),
            conformal_reach(errors, self._rules["size_confidence"]),
            self._known_mm,
        )
