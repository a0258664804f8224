"""The paper's detector ``template``, and ``template_threshold`` with a learned threshold."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.calibrate import rank_threshold
from capsule.detectors.matching import (
    Comparison,
    compare_templates,
    first_peak_sample,
    nearest_size,
    place_of_largest,
)
from capsule.detectors.training import JudgedRecording, TrainingArchive
from capsule.detectors.verdicts import Verdict, template_verdict, threshold_verdict
from capsule.kinds import Settings
from capsule.sliding import RepeatedParticle, SlidingComparison
from capsule.templates import TemplateSet

Compare = Callable[[JudgedRecording], Comparison]


@dataclass(frozen=True, eq=False)
class FoldTemplates:
    """The templates of a fold.

    Two of these are equal only if they are the same object. To compare the names of thousands of
    recordings would take longer than to compare a recording with a template.

    Attributes
    ----------
    left_out : frozenset of str
        The recordings that teach nothing.
    templates : tuple of 1 + B RepeatedParticle
        The templates without these recordings.
    changed : list of int
        Which of them differ from the templates of all recordings.
    """

    left_out: frozenset[str]
    templates: tuple[RepeatedParticle, ...]
    changed: list[int]


class TemplateMatching:
    """A comparison of an archive's recordings with templates that leave some of them out.

    Parameters
    ----------
    archive : TrainingArchive
        The archive of the recordings.
    """

    def __init__(self, archive: TrainingArchive) -> None:
        self.archive, self.templates = archive, archive.templates
        self._wholes = tuple(map(RepeatedParticle, self.templates.matrices))
        self._specificity = archive.settings["evaluation"]["specificity"]
        self._place = {name: place for place, name in enumerate(archive.sizes_mm)}
        # Results with the templates of all recordings; in a fold, only a few templates differ.
        self._compared: dict[str, Comparison] = {}
        healthy = [name for name, size in archive.sizes_mm.items() if size == 0]
        self._healthy = np.array(healthy, dtype=object)
        self._places = archive.place_numbers(healthy)
        self._row = {name: row for row, name in enumerate(healthy)}
        # In every fold, the same few recordings lie near the threshold.
        self._near = lru_cache(maxsize=128)(self._sliding_comparison)
        # A recording is compared twice in turn: with all templates, and with those of its fold.
        self._sliding = lru_cache(maxsize=1)(self._sliding_comparison)
        self._gains = np.empty((len(healthy), len(self.templates.matrices) - 1))
        self._norms = np.empty(len(healthy))
        for row, name in enumerate(healthy):
            self._gains[row] = self._with_all(name).gains[1:]
            self._norms[row] = np.linalg.norm(self._sliding(name).matrix)
        # Both detectors ask for the same fold, and then for the same recording in that fold.
        self._fold = lru_cache(maxsize=2)(self._render)
        self._compare = lru_cache(maxsize=1)(self._compare_anew)

    def fold(self, left_out: Sequence[str]) -> FoldTemplates:
        """Return the templates without some recordings."""
        return self._fold(frozenset(left_out))

    def comparison(self, fold: FoldTemplates, recording: JudgedRecording) -> Comparison:
        """Return the comparison of a recording of the archive with the templates of a fold."""
        return self._compare(fold, recording.name)

    def _compare_anew(self, fold: FoldTemplates, name: str) -> Comparison:
        templates, changed = fold.templates, fold.changed
        if not changed:
            return self._with_all(name)
        # T^0 never changes.
        if len(changed) == len(templates) - 1:
            return compare_templates(self._sliding(name), templates)
        anew = compare_templates(self._sliding(name), [templates[index] for index in changed])
        return self._with_all(name).replaced(changed, anew)

    def threshold(self, fold: FoldTemplates) -> float:
        """Return the threshold from the margins of the healthy recordings that teach a fold.

        The templates of a fold differ little from those of all recordings, and so do the margins
        (`margin_reach`). Only margins that may lie at the threshold are computed anew: of 200
        healthy recordings, 10 on average.
        """
        teaches = np.ones(len(self._healthy), dtype=bool)
        teaches[[self._row[name] for name in fold.left_out if name in self._row]] = False
        # The gains leave T^0 out.
        changed = [index - 1 for index in fold.changed]
        wholes, folds, gains = self._wholes[1:], fold.templates[1:], self._gains[teaches]
        lost = [index for index in changed if not folds[index].is_known]
        gains[:, lost] = np.nan
        margins = _margins(gains)
        known = np.isfinite(margins)
        margins, places = margins[known], self._places[teaches][known]
        kept = [index for index in changed if index not in lost]
        if not kept or not known.any():
            return rank_threshold(margins, places, self._specificity)
        gains, norms = gains[known], self._norms[teaches][known]
        names = self._healthy[teaches][known]
        reach = np.max(
            [margin_reach(norms, wholes[index].values, folds[index].values) for index in kept],
            axis=0,
        )
        lowest, highest = (
            rank_threshold(margins + sign * reach, places, self._specificity) for sign in (-1, 1)
        )
        # The threshold lies between these two. Any other margin stays on its side of it.
        near = (margins + reach >= lowest) & (margins - reach <= highest)
        for row in np.flatnonzero(near):
            for index in kept:
                gains[row, index], _ = self._near(names[row]).gain_of(folds[index])
        return rank_threshold(_margins(gains), places, self._specificity)

    def _render(self, left_out: frozenset[str]) -> FoldTemplates:
        sizes_mm, particles = self.archive.sizes_mm, self.archive.particles
        # Always in the same order, because rounding makes a sum depend on the order.
        ordered = sorted(left_out & self._place.keys(), key=self._place.__getitem__)
        matrices = self.templates.without_all(
            [(sizes_mm[name], particles.get(name)) for name in ordered]
        )
        templates = tuple(
            whole if matrix is whole.values else RepeatedParticle(matrix)
            for whole, matrix in zip(self._wholes, matrices, strict=True)
        )
        pairs = enumerate(zip(self._wholes, templates, strict=True))
        changed = [index for index, (whole, fold) in pairs if whole is not fold]
        return FoldTemplates(left_out, templates, changed)

    def _with_all(self, name: str) -> Comparison:
        """Return the comparison with the templates of all recordings, computed once."""
        if name not in self._compared:
            self._compared[name] = compare_templates(self._sliding(name), self._wholes)
        return self._compared[name]

    def _sliding_comparison(self, name: str) -> SlidingComparison:
        return SlidingComparison(self.archive.load(name))


def _margins(gains: FloatArray) -> FloatArray:
    """Return each recording's largest known gain, (n, B) -> (n,); -infinity if none is known."""
    margins: FloatArray = np.where(np.isnan(gains), -np.inf, gains).max(axis=1, initial=-np.inf)
    return margins


def margin_reach(norms: FloatArray, whole: FloatArray, fold: FloatArray) -> FloatArray:
    """Return a bound on the change of a margin when T' replaces a template T.

    The gain of a template is 2 <V, T shifted> - |T|^2 at its best lag
    (`capsule.detectors.matching.Comparison`). At every lag <V, T' - T> is at most |V| |T' - T|
    (Cauchy and Schwarz). The best gain therefore changes by at most
    2 |V| |T' - T| + ||T'|^2 - |T|^2|.

    Parameters
    ----------
    norms : (n,) array
        |V| of each recording.
    whole, fold : (S, L) array
        T and T'.

    Returns
    -------
    (n,) array
    """
    energy = abs(float((fold**2).sum() - (whole**2).sum()))
    return 2 * norms * np.linalg.norm(fold - whole) + energy


@dataclass(frozen=True)
class NearestTemplateModel:
    """The paper's rule: the size of the nearest template.

    Attributes
    ----------
    templates : TemplateSet
        Source of the sizes, the first peak and the length.
    compare : callable
        Function that compares a recording with the templates of a fold.
    """

    templates: TemplateSet
    compare: Compare

    def verdict(self, recording: JudgedRecording) -> Verdict:
        """Judge one recording."""
        comparison = self.compare(recording)
        return template_verdict(
            nearest_size(comparison.distances, self.templates.sizes_mm),
            comparison,
            _first_peak(comparison, self.templates),
        )

    def stored(self) -> dict[str, Any]:
        """Return an empty dict, because the templates have a file of their own."""
        return {}

    @classmethod
    def restored(cls, stored: Settings, templates: TemplateSet) -> "NearestTemplateModel":
        """Return the model with the templates of all recordings."""
        return cls(templates, _comparing_with(templates))


@dataclass(frozen=True)
class TemplateMarginModel:
    """The comparison of the paper's margin with a threshold.

    Attributes
    ----------
    templates, compare
        As in `NearestTemplateModel`.
    threshold : float
        Threshold of the margin; NaN if there is no healthy recording.
    """

    templates: TemplateSet
    compare: Compare
    threshold: float

    def verdict(self, recording: JudgedRecording) -> Verdict:
        """Judge one recording."""
        comparison, templates = self.compare(recording), self.templates
        location = _first_peak(comparison, templates)
        return threshold_verdict(comparison, templates.sizes_mm, self.threshold, location)

    def stored(self) -> dict[str, Any]:
        """Return the threshold, None if it is unknown."""
        return {"margin_threshold": None if np.isnan(self.threshold) else self.threshold}

    @classmethod
    def restored(cls, stored: Settings, templates: TemplateSet) -> "TemplateMarginModel":
        """Return the model with the stored threshold and the templates of all recordings."""
        threshold = stored["margin_threshold"]
        return cls(
            templates,
            _comparing_with(templates),
            float("nan") if threshold is None else float(threshold),
        )


class NearestTemplate:
    """The detector ``template``: the paper's own."""

    Model = NearestTemplateModel

    def __init__(self, archive: TrainingArchive) -> None:
        self._matching = archive.shared(TemplateMatching)

    def without(self, left_out: Sequence[str]) -> NearestTemplateModel:
        """Learn from all labelled recordings except those left out."""
        compare = partial(self._matching.comparison, self._matching.fold(left_out))
        return NearestTemplateModel(self._matching.templates, compare)


class TemplateMargin:
    """The detector ``template_threshold``: the paper's templates, with a learned threshold."""

    Model = TemplateMarginModel

    def __init__(self, archive: TrainingArchive) -> None:
        self._matching = archive.shared(TemplateMatching)

    def without(self, left_out: Sequence[str]) -> TemplateMarginModel:
        """Learn from all labelled recordings except those left out."""
        fold = self._matching.fold(left_out)
        return TemplateMarginModel(
            self._matching.templates,
            partial(self._matching.comparison, fold),
            self._matching.threshold(fold),
        )


def _comparing_with(templates: TemplateSet) -> Compare:
    return partial(_compare_with, tuple(map(RepeatedParticle, templates.matrices)))


def _compare_with(templates: Sequence[RepeatedParticle], recording: JudgedRecording) -> Comparison:
    return compare_templates(SlidingComparison(recording.matrix), templates)


def _first_peak(comparison: Comparison, templates: TemplateSet) -> float:
    """Return when the first sensor meets the best template's first peak, in samples."""
    # T^0 comes first and stands for no nodule.
    place = place_of_largest(comparison.gains[1:])
    if place is None:
        return float("nan")
    length = templates.matrices[0].shape[1]
    return first_peak_sample(float(comparison.lags[1 + place]), templates.first_peak, length)
