"""The detector ``template``: the paper's rule, with the templates of a training fold."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from capsule.detectors.base import Detector, JudgedRecording, TrainingArchive, Verdict
from capsule.kinds import Settings
from capsule.method.nearest_template import (
    compare_templates,
    first_peak_sample,
    index_of_largest,
    nearest_size,
)
from capsule.method.sliding import RepeatedParticle
from capsule.method.templates import TemplateSet


@dataclass(frozen=True)
class NearestTemplate(Detector):
    """The paper's rule: the size of the nearest template of a fold.

    The templates of all recordings, `whole`, give the sizes and the first peak; `templates` are
    the 1 + B of the fold, T^0 first.
    """

    whole: TemplateSet
    templates: tuple[RepeatedParticle, ...]

    @classmethod
    def taught(cls, archive: TrainingArchive, left_out: Collection[str] = ()) -> Self:
        """Average the templates of the recordings that are not left out."""
        apart = frozenset(left_out)
        # In the order of the archive, because rounding makes a sum depend on the order.
        matrices = archive.templates.without(
            (size_mm, archive.particles.get(name))
            for name, size_mm in archive.sizes_mm.items()
            if name in apart
        )
        return cls(archive.templates, tuple(map(RepeatedParticle, matrices)))

    def verdict(self, recording: JudgedRecording) -> Verdict:
        """Judge one recording; the score is the margin, of which a nodule has one above 0."""
        distances, gains, lags = compare_templates(recording.matrix, self.templates)
        predicted_mm = nearest_size(distances, self.whole.sizes_mm)
        # T^0 comes first and stands for no nodule.
        best = index_of_largest(gains[1:])
        margin = np.nan if best is None else float(gains[1 + best])
        size_mm = location = np.nan
        if best is not None and predicted_mm > 0:
            size_mm, length = predicted_mm, self.templates[0].values.shape[1]
            location = first_peak_sample(float(lags[1 + best]), self.whole.first_peak, length)
        return Verdict(
            predicted_mm,
            margin,
            0.0,
            estimate_mm=size_mm,
            location_samples=location,
            distances=tuple(distances.tolist()),
        )

    def stored(self) -> dict[str, Any]:
        """Return an empty dict, because the templates have a file of their own."""
        return {}

    @classmethod
    def restored(cls, stored: Settings, templates: TemplateSet) -> Self:
        """Return the detector with the templates of all recordings."""
        return cls(templates, tuple(map(RepeatedParticle, templates.matrices)))
