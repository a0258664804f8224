"""The paper's detector on every recording of an archive, by its own rule and by a threshold."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from capsule.detection import nearest_size, template_distances
from capsule.detectors.margin import first_peak_sample, template_margins
from capsule.detectors.operating_point import threshold_at
from capsule.detectors.verdicts import Verdict, template_verdict, threshold_verdict
from capsule.particles import Particle
from capsule.templates import TemplateSet


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
        self.healthy = [name for name, size in sizes_mm.items() if size == 0]
        self._gains: dict[str, np.ndarray] = {}
        self._norms: dict[str, float] = {}
        for name in self.healthy:
            matrix = load(name)
            self._gains[name], _ = template_margins(matrix, templates.matrices[1:])
            self._norms[name] = float(np.linalg.norm(matrix))
        self._thresholds: dict[frozenset[str], float] = {}

    def judge(self, name: str, left_out: Sequence[str]) -> tuple[np.ndarray, Verdict, Verdict]:
        """Judge one recording by what the others teach.

        Parameters
        ----------
        name : str
            The recording.
        left_out : sequence of str
            The recordings that teach nothing.

        Returns
        -------
        distances : (1 + B,) array
            Smallest RMSE to every template.
        by_rule, by_threshold : Verdict
            By the least RMSE, as in the paper; by the margin against a threshold.
        """
        matrices = self.templates.without_all(
            [(self.sizes_mm[other], self.particles.get(other)) for other in left_out]
        )
        return judge_matrix(
            self.load(name),
            matrices,
            self.templates.sizes_mm,
            self.templates.first_peak,
            self._threshold(frozenset(left_out), matrices),
        )

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
            healthy = [name for name in self.healthy if name not in left_out]
            self._thresholds[left_out] = self._fold_threshold(healthy, matrices)
        return self._thresholds[left_out]

    def _fold_threshold(self, healthy: Sequence[str], matrices: Sequence[np.ndarray]) -> float:
        pairs = list(zip(self.templates.matrices[1:], matrices[1:], strict=True))
        changed = [index for index, (whole, fold) in enumerate(pairs) if whole is not fold]
        gains = np.array([self._gains[name] for name in healthy]).reshape(len(healthy), len(pairs))
        if not changed or not healthy:
            return threshold_at(_margins(gains), self.specificity)
        lost = [index for index in changed if np.isnan(pairs[index][1]).any()]
        gains[:, lost] = np.nan
        margins = _margins(gains)
        if margins.size == 0:
            return float("nan")
        kept = [index for index in changed if index not in lost]
        norms = np.array([self._norms[name] for name in healthy])
        reach = np.zeros(len(healthy))
        for index in kept:
            whole, fold = pairs[index]
            energy = abs(float((fold**2).sum() - (whole**2).sum()))
            reach = np.maximum(reach, 2 * norms * np.linalg.norm(fold - whole) + energy)
        lowest = threshold_at(margins - reach, self.specificity)
        highest = threshold_at(margins + reach, self.specificity)
        near = (margins + reach >= lowest) & (margins - reach <= highest)
        for place in np.flatnonzero(near):
            matrix = self.load(healthy[place])
            gains[place, kept], _ = template_margins(matrix, [pairs[k][1] for k in kept])
        return threshold_at(_margins(gains), self.specificity)


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
    distances = template_distances(matrix, matrices)
    gains, lags = template_margins(matrix, matrices[1:])
    location = float("nan")
    if np.any(~np.isnan(gains)):
        lag = float(lags[int(np.nanargmax(gains))])
        location = first_peak_sample(lag, first_peak, matrix.shape[1])
    return (
        distances,
        template_verdict(nearest_size(distances, sizes_mm), gains, location),
        threshold_verdict(distances, gains, sizes_mm, threshold, location),
    )
