"""The paper's detector ``template``, and ``template_threshold`` with a learned threshold.

The paper's rule takes the nearest template. It compares RMSE^2 = (|V|^2 - gain) / (3 S L), where
gain = 2 sum V T(shifted) - |T|^2 (eq. RMSE). The gain of T^0 is 0, so the verdict is a nodule if
the largest gain of another template, the margin, is above 0. Any other threshold than 0 gives
another operating point.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Self, TypeAlias

import numpy as np

from capsule.arrays import FloatArray, plain
from capsule.detectors.base import Detector, JudgedRecording, TrainingArchive, Verdict
from capsule.detectors.calibrate import rank_threshold
from capsule.kinds import Settings
from capsule.method.sliding import RepeatedParticle, SlidingComparison, rmse_at_lag
from capsule.method.templates import TemplateSet

# Distance, gain and lag of a template on a recording.
_Compared: TypeAlias = tuple[float, float, float]


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
    return np.nan if nearest is None else float(sizes_mm[nearest])


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
    sliding = _sliding_over(matrix)
    return _as_arrays([_compare(matrix, sliding, template) for template in templates])


def _sliding_over(matrix: FloatArray) -> SlidingComparison | None:
    """Return what slides templates over a matrix; None if the matrix holds NaN."""
    return None if np.isnan(matrix).any() else SlidingComparison(matrix)


def _compare(
    matrix: FloatArray, sliding: SlidingComparison | None, template: RepeatedParticle
) -> _Compared:
    """Return distance, gain and lag of one template."""
    if sliding is None or not template.is_known:
        return np.nan, np.nan, np.nan
    gain, lag = sliding.gain_of(template)
    return rmse_at_lag(matrix, template.values, lag), gain, lag


def _as_arrays(compared: Sequence[_Compared]) -> tuple[FloatArray, FloatArray, FloatArray]:
    distances, gains, lags = np.array(compared, dtype=np.float64).reshape(-1, 3).T
    return distances, gains, lags


def first_peak_sample(lag: float, first_peak: int, length: int) -> float:
    """Return when sensor 1 feels the template's first peak, in samples from the first reading.

    `first_peak` is u, counted from 1. At a `lag` (tau) of L + 1, the template is not shifted.
    """
    return first_peak - 1 + lag - (length + 1)


@dataclass(frozen=True)
class NearestTemplate(Detector):
    """The detector ``template``: the paper's rule, the size of the nearest template of a fold.

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

    @classmethod
    def taught(cls, archive: TrainingArchive, left_out: Collection[str] = ()) -> Self:
        """Average the templates of the recordings that are not left out."""
        return cls(archive.templates, _fold(archive, frozenset(left_out)))

    def predicted_mm(self, distances: FloatArray, margin: float) -> float:
        """Return the size of a recording's nodule, 0 for none, NaN if unknown."""
        return nearest_size(distances, self.whole.sizes_mm)

    def verdict(self, recording: JudgedRecording) -> Verdict:
        """Judge one recording."""
        distances, gains, lags = _as_arrays(
            [_compared(recording, template) for template in self.templates]
        )
        # T^0 comes first and stands for no nodule.
        best = place_of_largest(gains[1:])
        margin = np.nan if best is None else float(gains[1 + best])
        predicted_mm = self.predicted_mm(distances, margin)
        size_mm = location = np.nan
        if best is not None and predicted_mm > 0:
            size_mm, length = predicted_mm, self.templates[0].values.shape[1]
            location = first_peak_sample(float(lags[1 + best]), self.whole.first_peak, length)
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
    def restored(cls, stored: Settings, templates: TemplateSet) -> Self:
        """Return the detector with the templates of all recordings."""
        return cls(templates, tuple(map(RepeatedParticle, templates.matrices)))


class TemplateMargin(NearestTemplate):
    """The detector ``template_threshold``: the paper's margin against a learned threshold."""

    @classmethod
    def taught(cls, archive: TrainingArchive, left_out: Collection[str] = ()) -> Self:
        """Average the templates of a fold, and learn the threshold of its healthy margins."""
        nearest, healthy = super().taught(archive, left_out), list(_healthy(archive))
        # T^0 has no gain. An unknown gain counts as the least.
        gains = [np.full(len(healthy), -np.inf)]
        gains += [_healthy_gains(archive, template) for template in nearest.templates[1:]]
        margins, apart = np.max(gains, axis=0), frozenset(left_out)
        teach = np.isfinite(margins) & np.array([name not in apart for name in healthy], dtype=bool)
        places = archive.place_numbers(healthy)[teach]
        specificity = archive.settings["evaluation"]["specificity"]
        return replace(nearest, threshold=rank_threshold(margins[teach], places, specificity))

    def predicted_mm(self, distances: FloatArray, margin: float) -> float:
        """Return 0 up to the threshold, otherwise the size of the nearest nodule template."""
        if np.isnan(margin) or np.isnan(self.threshold):
            return np.nan
        if margin <= self.threshold:
            return 0.0
        return nearest_size(distances[1:], self.whole.sizes_mm[1:])

    def stored(self) -> dict[str, Any]:
        """Return the threshold, None if it is unknown."""
        return {"margin_threshold": plain(self.threshold)}

    @classmethod
    def restored(cls, stored: Settings, templates: TemplateSet) -> Self:
        """Return the detector with the stored threshold and the templates of all recordings."""
        threshold = stored["margin_threshold"]
        known = np.nan if threshold is None else float(threshold)
        return replace(super().restored(stored, templates), threshold=known)


# Nearly every fold needs all of them, in the same order; each takes some 50 kB.
@lru_cache(maxsize=1)
def _healthy(archive: TrainingArchive) -> dict[str, SlidingComparison]:
    healthy = (name for name, size_mm in archive.sizes_mm.items() if size_mm == 0)
    return {name: SlidingComparison(archive.recordings[name].matrix) for name in healthy}


# Most templates are the same in all folds.
@lru_cache(maxsize=32)
def _healthy_gains(archive: TrainingArchive, template: RepeatedParticle) -> FloatArray:
    """Return the gains of a template on the healthy recordings; the least of all if unknown."""
    comparisons = _healthy(archive).values()
    if not template.is_known:
        return np.full(len(comparisons), -np.inf)
    return np.fmax([each.gain_of(template)[0] for each in comparisons], -np.inf)


@lru_cache(maxsize=1)
def _read(recording: JudgedRecording) -> tuple[FloatArray, SlidingComparison | None]:
    """Read a recording once for both detectors and for all folds that judge it in turn."""
    matrix = recording.matrix
    return matrix, _sliding_over(matrix)


# Those folds share most templates.
@lru_cache(maxsize=32)
def _compared(recording: JudgedRecording, template: RepeatedParticle) -> _Compared:
    return _compare(*_read(recording), template)


# The last fold, and the one that leaves nothing out.
@lru_cache(maxsize=2)
def _fold(archive: TrainingArchive, left_out: frozenset[str]) -> tuple[RepeatedParticle, ...]:
    """Return the templates without some recordings; those that stay are the same objects."""
    if not left_out:
        return tuple(map(RepeatedParticle, archive.templates.matrices))
    # In the order of the archive, because rounding makes a sum depend on the order.
    matrices = archive.templates.without(
        (size_mm, archive.particles.get(name))
        for name, size_mm in archive.sizes_mm.items()
        if name in left_out
    )
    return tuple(
        whole if matrix is whole.values else RepeatedParticle(matrix)
        for whole, matrix in zip(_fold(archive, frozenset()), matrices, strict=True)
    )
