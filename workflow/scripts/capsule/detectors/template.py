"""The paper's detector on every recording of an archive, by its own rule and by a threshold."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from capsule.detectors.margin import (
    Comparison,
    compare_templates,
    first_peak_sample,
    template_margin,
)
from capsule.detectors.matching import nearest_size
from capsule.detectors.operating_point import threshold_at
from capsule.detectors.verdicts import Verdict, template_verdict, threshold_verdict
from capsule.particles import Particle
from capsule.sliding import SlidingComparison
from capsule.templates import TemplateSet


@dataclass(frozen=True)
class TemplateFold:
    """What the recordings of a training fold teach.

    Attributes
    ----------
    matrices : tuple of 1 + B (S, L) arrays
        The templates, T^0 first.
    threshold : float
        Of the margin.
    """

    matrices: tuple[np.ndarray, ...]
    threshold: float


class TemplateDetector:
    """Judges recordings by templates from which any of them may be left out.

    Parameters
    ----------
    templates : TemplateSet
        The templates of all sizes.
    particles : mapping of str to Particle
        The fits of the nodule recordings.
    sizes_mm : mapping of str to float
        True sizes of the labelled recordings.
    load : callable
        ``load(name)`` gives the matrix V of a recording.
    specificity : float
        Wanted of the threshold.
    """

    def __init__(
        self,
        templates: TemplateSet,
        particles: Mapping[str, Particle],
        sizes_mm: Mapping[str, float],
        load: Callable[[str], np.ndarray],
        specificity: float,
    ) -> None:
        self.templates = templates
        self.particles = particles
        self.sizes_mm = sizes_mm
        self.load = load
        self.specificity = specificity
        # With the templates of all recordings; a fold's differ in one or a few.
        self._compared: dict[str, Comparison] = {}
        healthy = [name for name, size in sizes_mm.items() if size == 0]
        self._healthy = np.array(healthy, dtype=object)
        self._row = {name: row for row, name in enumerate(healthy)}
        gains = [self._compare(name).gains[1:] for name in healthy]
        self._gains = np.array(gains).reshape(len(healthy), len(templates.matrices) - 1)
        self._norms = np.array([np.linalg.norm(load(name)) for name in healthy])
        self._thresholds: dict[frozenset[str], float] = {}
        # The same few recordings lie near the threshold of every fold.
        self._near = lru_cache(maxsize=64)(lambda name: SlidingComparison(load(name)))

    def without(self, left_out: Sequence[str]) -> "TemplateFold":
        """Learn from all recordings but those left out."""
        matrices = self.templates.without_all(
            [(self.sizes_mm[other], self.particles.get(other)) for other in left_out]
        )
        return TemplateFold(matrices, self._threshold(frozenset(left_out), matrices))

    def judge(self, name: str, fold: "TemplateFold") -> tuple[np.ndarray, Verdict, Verdict]:
        """Judge one recording by what a fold teaches.

        Parameters
        ----------
        name : str
            The recording.
        fold : TemplateFold
            From `without`.

        Returns
        -------
        distances : (1 + B,) array
            Smallest RMSE to every template.
        by_rule, by_threshold : Verdict
            By the least RMSE, as in the paper; by the margin against a threshold.
        """
        compared = self._compare(name)
        changed = _changed(self.templates.matrices, fold.matrices)
        if changed:
            anew = compare_templates(self.load(name), [fold.matrices[index] for index in changed])
            compared = compared.replaced(changed, anew)
        sizes_mm, first_peak = self.templates.sizes_mm, self.templates.first_peak
        length = fold.matrices[0].shape[1]
        return _verdicts(compared, sizes_mm, first_peak, length, fold.threshold)

    def _compare(self, name: str) -> Comparison:
        """Compare a recording with the templates of all, once for all folds."""
        if name not in self._compared:
            self._compared[name] = compare_templates(self.load(name), self.templates.matrices)
        return self._compared[name]

    def threshold(self) -> float:
        """Give the threshold that all healthy recordings teach."""
        return self._threshold(frozenset(), self.templates.matrices)

    def _threshold(self, left_out: frozenset[str], matrices: Sequence[np.ndarray]) -> float:
        """Choose the threshold on the margins of the fold's healthy recordings.

        A fold's templates differ little from those of all recordings, and so do the margins, by
        no more than 2 |V| |T' - T| + ||T'|^2 - |T|^2|. Only margins near enough to the threshold
        are computed anew, which gives the same threshold as all of them would.
        """
        if left_out not in self._thresholds:
            rows = [self._row[name] for name in left_out if name in self._row]
            self._thresholds[left_out] = self._fold_threshold(rows, matrices)
        return self._thresholds[left_out]

    def _fold_threshold(self, left_out: Sequence[int], matrices: Sequence[np.ndarray]) -> float:
        taught = np.ones(len(self._healthy), dtype=bool)
        taught[left_out] = False
        gains, wholes, folds = self._gains[taught], self.templates.matrices[1:], matrices[1:]
        changed = _changed(wholes, folds)
        if not changed or gains.size == 0:
            return threshold_at(_margins(gains), self.specificity)
        lost = [index for index in changed if np.isnan(folds[index]).any()]
        gains[:, lost] = np.nan
        margins = _margins(gains)
        if margins.size == 0:
            return float("nan")
        kept = [index for index in changed if index not in lost]
        norms = self._norms[taught]
        reach = np.zeros(norms.size)
        for index in kept:
            whole, fold = wholes[index], folds[index]
            energy = abs(float((fold**2).sum() - (whole**2).sum()))
            reach = np.maximum(reach, 2 * norms * np.linalg.norm(fold - whole) + energy)
        lowest = threshold_at(margins - reach, self.specificity)
        highest = threshold_at(margins + reach, self.specificity)
        near = (margins + reach >= lowest) & (margins - reach <= highest)
        names = self._healthy[taught]
        for place in np.flatnonzero(near):
            comparison = self._near(names[place])
            for index in kept:
                gains[place, index], _ = template_margin(comparison, folds[index])
        return threshold_at(_margins(gains), self.specificity)


def _changed(wholes: Sequence[np.ndarray], folds: Sequence[np.ndarray]) -> list[int]:
    """Tell which templates a fold does not share with all recordings."""
    pairs = enumerate(zip(wholes, folds, strict=True))
    return [index for index, (whole, fold) in pairs if whole is not fold]


def _margins(gains: np.ndarray) -> np.ndarray:
    """Take each recording's largest known gain (n, B) -> (n,)."""
    known = np.where(np.isnan(gains), -np.inf, gains)
    best = known.max(axis=1, initial=-np.inf)
    return best[np.isfinite(best)]


def judge_matrix(
    matrix: np.ndarray,
    matrices: Sequence[np.ndarray],
    sizes_mm: Sequence[float],
    first_peak: int,
    threshold: float,
) -> tuple[np.ndarray, Verdict, Verdict]:
    """Judge one recording by templates and by a threshold of the margin.

    Parameters
    ----------
    matrix : (S, L) array
        V.
    matrices : sequence of 1 + B (S, L) arrays
        The templates, T^0 first.
    sizes_mm : sequence of 1 + B floats
        Their sizes, 0 first.
    first_peak : int
        u.
    threshold : float
        Of the margin.

    Returns
    -------
    distances, by_rule, by_threshold
        As of `TemplateDetector.judge`.
    """
    compared = compare_templates(matrix, matrices)
    return _verdicts(compared, sizes_mm, first_peak, matrix.shape[1], threshold)


def _verdicts(
    compared: Comparison,
    sizes_mm: Sequence[float],
    first_peak: int,
    length: int,
    threshold: float,
) -> tuple[np.ndarray, Verdict, Verdict]:
    # T^0 is first, and no nodule.
    distances, gains, lags = compared.distances, compared.gains[1:], compared.lags[1:]
    location = float("nan")
    if np.any(~np.isnan(gains)):
        location = first_peak_sample(float(lags[int(np.nanargmax(gains))]), first_peak, length)
    return (
        distances,
        template_verdict(nearest_size(distances, sizes_mm), gains, location),
        threshold_verdict(distances, gains, sizes_mm, threshold, location),
    )
