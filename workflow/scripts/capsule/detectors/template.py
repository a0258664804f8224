"""The paper's detector ``template``, and ``template_threshold`` with a learned threshold."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.margins import margin_reach, near_threshold
from capsule.detectors.matching import (
    Comparison,
    compare_templates,
    first_peak_sample,
    nearest_size,
    template_margin,
)
from capsule.detectors.operating_point import threshold_at
from capsule.detectors.training import JudgedRecording, TrainingArchive
from capsule.detectors.verdicts import Verdict, template_verdict, threshold_verdict
from capsule.kinds import Settings
from capsule.sliding import SlidingComparison
from capsule.templates import TemplateSet

Compare = Callable[[JudgedRecording], Comparison]


class TemplateMatching:
    """A comparison of an archive's recordings with templates that leave some of them out.

    Parameters
    ----------
    archive : TrainingArchive
        The archive of the recordings.
    """

    def __init__(self, archive: TrainingArchive) -> None:
        self.archive, self.templates = archive, archive.templates
        self._specificity = archive.settings["evaluation"]["specificity"]
        self._place = {name: place for place, name in enumerate(archive.sizes_mm)}
        # Results with the templates of all recordings; in a fold, only a few templates differ.
        self._compared: dict[str, Comparison] = {}
        healthy = [name for name, size in archive.sizes_mm.items() if size == 0]
        self._healthy = np.array(healthy, dtype=object)
        self._row = {name: row for row, name in enumerate(healthy)}
        # In every fold, the same few recordings lie near the threshold.
        self._near = lru_cache(maxsize=64)(self._sliding_comparison)
        # A recording is compared twice in turn: with all templates, and with those of its fold.
        self._sliding = lru_cache(maxsize=1)(self._sliding_comparison)
        gains = [self._with_all(name).gains[1:] for name in healthy]
        self._gains = np.array(gains).reshape(len(healthy), len(self.templates.matrices) - 1)
        self._norms = np.array([np.linalg.norm(archive.load(name)) for name in healthy])
        # Both detectors ask for the same fold, and then for the same recording in that fold.
        self._fold = lru_cache(maxsize=2)(self._render)
        self._same: Callable[[frozenset[str]], frozenset[str]] = lru_cache(maxsize=2)(_itself)
        self._latest: tuple[frozenset[str], str, Comparison] | None = None

    def fold(self, left_out: Sequence[str]) -> frozenset[str]:
        """Return the recordings left out as a set, for the same ones as the same object.

        To find that two large sets are equal takes longer than a comparison with a template.
        """
        return self._same(frozenset(left_out))

    def comparison(self, fold: frozenset[str], recording: JudgedRecording) -> Comparison:
        """Return the comparison of a recording of the archive with the templates of a `fold`."""
        name = recording.name
        if self._latest is None or self._latest[0] is not fold or self._latest[1] != name:
            self._latest = fold, name, self._compare(fold, name)
        return self._latest[2]

    def _compare(self, fold: frozenset[str], name: str) -> Comparison:
        matrices = self._fold(fold)
        changed = _changed(self.templates.matrices, matrices)
        if not changed:
            return self._with_all(name)
        # T^0 never changes.
        if len(changed) == len(matrices) - 1:
            return compare_templates(self._sliding(name), matrices)
        anew = compare_templates(self._sliding(name), [matrices[index] for index in changed])
        return self._with_all(name).replaced(changed, anew)

    def threshold(self, fold: frozenset[str]) -> float:
        """Return the threshold from the margins of the healthy recordings that teach a `fold`.

        The templates of a fold differ little from those of all recordings, and so do the margins
        (`margin_reach`). Only margins that may lie at the threshold are computed anew.
        """
        taught = np.ones(len(self._healthy), dtype=bool)
        taught[[self._row[name] for name in fold if name in self._row]] = False
        wholes, folds = self.templates.matrices[1:], self._fold(fold)[1:]
        gains = self._gains[taught]
        changed = _changed(wholes, folds)
        if not changed or gains.size == 0:
            return threshold_at(_margins(gains), self._specificity)
        lost = [index for index in changed if np.isnan(folds[index]).any()]
        gains[:, lost] = np.nan
        margins = _margins(gains)
        if margins.size == 0:
            return float("nan")
        kept = [index for index in changed if index not in lost]
        reach = np.zeros(margins.size)
        for index in kept:
            each = margin_reach(self._norms[taught], wholes[index], folds[index])
            reach = np.maximum(reach, each)
        names = self._healthy[taught]
        for row in near_threshold(margins, reach, self._specificity):
            for index in kept:
                gains[row, index], _ = template_margin(self._near(names[row]), folds[index])
        return threshold_at(_margins(gains), self._specificity)

    def _render(self, left_out: frozenset[str]) -> tuple[FloatArray, ...]:
        """Return the 1 + B templates (S, L) without the recordings left out."""
        sizes_mm, particles = self.archive.sizes_mm, self.archive.particles
        # Always in the same order, because rounding makes a sum depend on the order.
        ordered = sorted(left_out & self._place.keys(), key=self._place.__getitem__)
        return self.templates.without_all(
            [(sizes_mm[name], particles.get(name)) for name in ordered]
        )

    def _with_all(self, name: str) -> Comparison:
        """Return the comparison with the templates of all recordings, computed once."""
        if name not in self._compared:
            self._compared[name] = compare_templates(self._sliding(name), self.templates.matrices)
        return self._compared[name]

    def _sliding_comparison(self, name: str) -> SlidingComparison:
        return SlidingComparison(self.archive.load(name))


def _changed(wholes: Sequence[FloatArray], folds: Sequence[FloatArray]) -> list[int]:
    """Return the indexes of the templates in which a fold differs from all recordings."""
    pairs = enumerate(zip(wholes, folds, strict=True))
    return [index for index, (whole, fold) in pairs if whole is not fold]


def _margins(gains: FloatArray) -> FloatArray:
    """Return each recording's largest known gain, (n, B) -> (n,)."""
    known = np.where(np.isnan(gains), -np.inf, gains)
    best = known.max(axis=1, initial=-np.inf)
    margins: FloatArray = best[np.isfinite(best)]
    return margins


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
        return cls(templates, partial(_compare_with, templates.matrices))


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
            partial(_compare_with, templates.matrices),
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


def _compare_with(matrices: Sequence[FloatArray], recording: JudgedRecording) -> Comparison:
    return compare_templates(SlidingComparison(recording.matrix), matrices)


def _itself(names: frozenset[str]) -> frozenset[str]:
    return names


def _first_peak(comparison: Comparison, templates: TemplateSet) -> float:
    """Return when the first sensor meets the best template's first peak, in samples."""
    # T^0 comes first and stands for no nodule.
    gains, lags = comparison.gains[1:], comparison.lags[1:]
    if np.isnan(gains).all():
        return float("nan")
    length = templates.matrices[0].shape[1]
    return first_peak_sample(float(lags[int(np.nanargmax(gains))]), templates.first_peak, length)
