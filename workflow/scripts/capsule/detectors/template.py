"""The paper's detector ``template``, and ``template_threshold`` with a learned threshold.

The paper's rule takes the nearest template. It compares RMSE^2 = (|V|^2 - gain) / (3 S L), where
gain = 2 sum V T(shifted) - |T|^2 (eq. RMSE). The gain of T^0 is 0, so the verdict is a nodule if
the largest gain of another template, the margin, is above 0. Any other threshold than 0 gives
another operating point.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.calibrate import rank_threshold
from capsule.detectors.training import JudgedRecording, TrainingArchive
from capsule.detectors.verdicts import Verdict
from capsule.kinds import Settings
from capsule.sliding import RepeatedParticle, SlidingComparison, rmse_at_lag
from capsule.templates import TemplateSet

_UNKNOWN = float("nan")


def template_distances(matrix: FloatArray, templates: Iterable[FloatArray]) -> FloatArray:
    """Compare a recording with every template (eq. F' to eq. RMSEmin).

    Parameters
    ----------
    matrix : (S, L) array
        The recording's matrix V.
    templates : iterable of B (S, L) arrays
        The templates T^b; one that holds NaN has no distance.

    Returns
    -------
    (B,) array
        The smallest RMSE over all lags; NaN if the matrix or the template holds NaN.
    """
    return compare_templates(matrix, list(map(RepeatedParticle, templates)))[0]


def nearest_size(distances: FloatArray, sizes_mm: Sequence[float]) -> float:
    """Return the size of the nearest template in mm, NaN if no distance is known.

    Parameters
    ----------
    distances : (B,) array
        From `template_distances`.
    sizes_mm : sequence of B floats
        The templates' sizes in mm; 0 is no nodule. Of equal distances the smaller size wins.
    """
    nearest = place_of_largest(-distances)
    return _UNKNOWN if nearest is None else float(sizes_mm[nearest])


def place_of_largest(values: FloatArray) -> int | None:
    """Return the place of the largest value that is not NaN, of equal ones the first, or None.

    For the few values of a recording's templates, this is faster than functions on arrays.
    """
    listed = values.tolist()
    known = [place for place, value in enumerate(listed) if value == value]
    return max(known, key=listed.__getitem__, default=None)


def compare_templates(
    matrix: FloatArray, templates: Sequence[RepeatedParticle]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return distances, gains and lags of B templates on a recording's matrix (S, L), each (B,).

    A distance is the smallest RMSE over all lags (eq. RMSEmin). A gain is the largest over all
    lags, 0 for T^0, at the lag tau in 1..2L. All three are NaN if matrix or template holds NaN.
    """
    distances, gains, lags = np.full((3, len(templates)), np.nan)
    if not np.isnan(matrix).any():
        comparison = SlidingComparison(matrix)
        for index, template in enumerate(templates):
            if template.is_known:
                gains[index], lag = comparison.gain_of(template)
                lags[index] = lag
                distances[index] = rmse_at_lag(matrix, template.values, lag)
    return distances, gains, lags


def first_peak_sample(lag: float, first_peak: int, length: int) -> float:
    """Return when sensor 1 feels the template's first peak, in samples from the first reading.

    `first_peak` is u, counted from 1. At a `lag` (tau) of L + 1, the template is not shifted.
    """
    return first_peak - 1 + lag - (length + 1)


def lag_of_first_peak(sample: float, first_peak: int, length: int) -> int:
    """Return the lag tau at which sensor 1 feels the first peak then; see `first_peak_sample`."""
    return round(sample - first_peak + 1) + length + 1


@dataclass(frozen=True)
class NearestTemplateModel:
    """The paper's rule: the size of the nearest of the templates of a fold.

    Attributes
    ----------
    whole : TemplateSet
        The templates of all recordings, which give the sizes and the first peak.
    templates : tuple of 1 + B RepeatedParticle
        Those of the fold, T^0 first.
    threshold : float
        A margin above it means a nodule; NaN if there is no healthy recording.
    """

    whole: TemplateSet
    templates: tuple[RepeatedParticle, ...]
    threshold: float = 0.0

    def predicted_mm(self, distances: FloatArray, margin: float) -> float:
        """Return the size of a recording's nodule, 0 for none, NaN if unknown."""
        return nearest_size(distances, self.whole.sizes_mm)

    def verdict(self, recording: JudgedRecording) -> Verdict:
        """Judge one recording."""
        distances, gains, lags = compare_templates(recording.matrix, self.templates)
        # T^0 comes first and stands for no nodule.
        best = place_of_largest(gains[1:])
        margin = _UNKNOWN if best is None else float(gains[1 + best])
        predicted_mm = self.predicted_mm(distances, margin)
        size_mm = location = _UNKNOWN
        if best is not None and predicted_mm > 0:
            size_mm, lag = predicted_mm, float(lags[1 + best])
            location = first_peak_sample(lag, self.whole.first_peak, recording.matrix.shape[1])
        return Verdict(
            predicted_mm,
            margin,
            self.threshold,
            estimate_mm=size_mm,
            location_samples=location,
            distances=tuple(distances.tolist()),
        )

    def stored(self) -> dict[str, Any]:
        """Return an empty dict, because the templates have a file of their own."""
        return {}

    @classmethod
    def restored(cls, stored: Settings, templates: TemplateSet) -> "NearestTemplateModel":
        """Return the model with the templates of all recordings."""
        return cls(templates, _repeated(templates))


class TemplateMarginModel(NearestTemplateModel):
    """The comparison of the paper's margin with a threshold."""

    def predicted_mm(self, distances: FloatArray, margin: float) -> float:
        """Return 0 up to the threshold, otherwise the size of the nearest nodule template."""
        if np.isnan(margin) or np.isnan(self.threshold):
            return _UNKNOWN
        if margin <= self.threshold:
            return 0.0
        return nearest_size(distances[1:], self.whole.sizes_mm[1:])

    def stored(self) -> dict[str, Any]:
        """Return the threshold, None if it is unknown."""
        return {"margin_threshold": None if np.isnan(self.threshold) else self.threshold}

    @classmethod
    def restored(cls, stored: Settings, templates: TemplateSet) -> "TemplateMarginModel":
        """Return the model with the stored threshold and the templates of all recordings."""
        threshold = stored["margin_threshold"]
        known = _UNKNOWN if threshold is None else float(threshold)
        return cls(templates, _repeated(templates), known)


class NearestTemplate:
    """The detector ``template``: the paper's own."""

    Model: ClassVar[type[NearestTemplateModel]] = NearestTemplateModel

    def __init__(self, archive: TrainingArchive) -> None:
        self._archive = archive
        self._wholes = _repeated(archive.templates)

    def without(self, left_out: Sequence[str]) -> NearestTemplateModel:
        """Learn from all labelled recordings except those left out."""
        sizes_mm, particles = self._archive.sizes_mm, self._archive.particles
        apart = set(left_out)
        # In the order of the archive, because rounding makes a sum depend on the order.
        matrices = self._archive.templates.without(
            (size_mm, particles.get(name)) for name, size_mm in sizes_mm.items() if name in apart
        )
        # Templates that stay are the same objects.
        templates = tuple(
            whole if matrix is whole.values else RepeatedParticle(matrix)
            for whole, matrix in zip(self._wholes, matrices, strict=True)
        )
        return self.Model(self._archive.templates, templates, self._threshold(templates, apart))

    def _threshold(self, templates: Sequence[RepeatedParticle], left_out: set[str]) -> float:
        """Return the threshold of the margins in a fold; that of the paper's rule is fixed."""
        return 0.0


class TemplateMargin(NearestTemplate):
    """The detector ``template_threshold``: the paper's templates, with a learned threshold.

    The threshold comes from the margins of the healthy recordings that teach a fold. The templates
    of a fold differ little from those of all recordings, and so do the margins (`margin_reach`).
    Only margins that may lie at the threshold are computed anew.
    """

    Model = TemplateMarginModel

    def __init__(self, archive: TrainingArchive) -> None:
        super().__init__(archive)
        self._healthy = [name for name, size_mm in archive.sizes_mm.items() if size_mm == 0]
        self._places = archive.place_numbers(self._healthy)
        self._gains = np.empty((len(self._healthy), len(self._wholes) - 1))
        self._norm = 0.0
        for row, name in enumerate(self._healthy):
            matrix = archive.load(name)
            # T^0 has no gain. An unknown gain counts as the least.
            self._gains[row] = np.fmax(compare_templates(matrix, self._wholes[1:])[1], -np.inf)
            self._norm = max(self._norm, float(np.linalg.norm(matrix)))
        # In every fold, the same few recordings lie near the threshold.
        self._near = lru_cache(maxsize=128)(lambda name: SlidingComparison(archive.load(name)))

    def _threshold(self, templates: Sequence[RepeatedParticle], left_out: set[str]) -> float:
        """Return the threshold from the margins of the healthy recordings that teach the fold."""
        teaches = [row for row, name in enumerate(self._healthy) if name not in left_out]
        gains, places = self._gains[teaches], self._places[teaches]
        specificity = self._archive.settings["evaluation"]["specificity"]
        reach, changed = 0.0, {}
        for index, (whole, fold) in enumerate(zip(self._wholes[1:], templates[1:], strict=True)):
            if not fold.is_known:
                gains[:, index] = -np.inf
            elif fold is not whole:
                changed[index] = fold
                reach = max(reach, margin_reach(self._norm, whole.values, fold.values))
        margins = gains.max(axis=1, initial=-np.inf)
        known = np.isfinite(margins)
        threshold = rank_threshold(margins[known], places[known], specificity)
        # Neither a margin nor the threshold moves farther than the reach. So every other margin
        # stays on its side of the threshold.
        for row in np.flatnonzero(np.abs(margins - threshold) <= 2 * reach):
            comparison = self._near(self._healthy[teaches[row]])
            for index, fold in changed.items():
                gains[row, index], _ = comparison.gain_of(fold)
        margins = gains.max(axis=1, initial=-np.inf)
        return rank_threshold(margins[known], places[known], specificity)


def margin_reach(norm: float, whole: FloatArray, fold: FloatArray) -> float:
    """Return a bound on the change of a margin when T' replaces a template T, both (S, L).

    At every lag, <V, T' - T> is at most |V| |T' - T| (Cauchy and Schwarz). So the best gain
    2 <V, T shifted> - |T|^2 changes by at most 2 |V| |T' - T| + ||T'|^2 - |T|^2|. `norm` is |V|.
    """
    energy = abs(float((fold**2).sum() - (whole**2).sum()))
    return 2 * norm * float(np.linalg.norm(fold - whole)) + energy


def _repeated(templates: TemplateSet) -> tuple[RepeatedParticle, ...]:
    return tuple(map(RepeatedParticle, templates.matrices))
