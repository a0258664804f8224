"""What the configured detectors say of the recordings of an archive, as rows of tables."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from capsule.detectors.diagonal import DiagonalDetector
from capsule.detectors.learned import Learned
from capsule.detectors.passage import Passage
from capsule.detectors.template import TemplateDetector
from capsule.detectors.verdicts import Verdict
from capsule.evaluation.folds import Folds
from capsule.naming import size_label
from capsule.particles import Particle
from capsule.templates import TemplateSet

_COLUMNS = ("score", "threshold", "probability", "estimate_mm", "location_s", "location_mm")


class Detectors:
    """The configured detectors, taught by the accepted labelled recordings.

    Parameters
    ----------
    sizes_mm : mapping of str to float
        The accepted labelled recordings and their sizes.
    templates : TemplateSet
        The templates of all sizes.
    particles : mapping of str to Particle
        The fits of the recordings that may be left out of them.
    passages : mapping of str to Passage
        One of each recording.
    load : callable
        ``load(name)`` gives the matrix of a recording.
    settings : mapping
        The sections ``detectors``, ``recording``, ``diagonal`` and ``evaluation``.

    Attributes
    ----------
    names : list of str
        The detectors, in the order of the configuration.
    columns : list of str
        Of a row, beside those that say which recording and which detector: the verdict, the
        distance to each template (None for a detector that does not judge by them), and the rest.
    """

    def __init__(
        self,
        sizes_mm: Mapping[str, float],
        templates: TemplateSet,
        particles: Mapping[str, Particle],
        passages: Mapping[str, Passage],
        load: Callable[[str], np.ndarray],
        settings: Mapping,
    ) -> None:
        self.names = settings["detectors"]
        self._distances = [f"rmse_{size_label(size)}" for size in templates.sizes_mm]
        self.columns = ["predicted_mm", *self._distances, *_COLUMNS]
        self._rate_hz = settings["recording"]["rate_hz"]
        judged = settings["evaluation"]
        self._template = TemplateDetector(
            templates, particles, sizes_mm, load, judged["specificity"]
        )
        self._passages = passages
        self._diagonal = DiagonalDetector(
            passages,
            sizes_mm,
            specificity=judged["specificity"],
            prevalence=judged["prevalence"],
            size_ridge=settings["diagonal"]["size_ridge"],
        )

    def rows(self, names: Sequence[str], left_out: Sequence[str]) -> Iterator[dict]:
        """Give each detector's verdict on some recordings; those left out have taught nothing."""
        fold, model = self._template.without(left_out), self._diagonal.model(left_out)
        unknown = dict.fromkeys(self._distances)
        for name in names:
            distances, by_rule, by_threshold = self._template.judge(name, fold)
            known = dict(zip(self._distances, distances.tolist(), strict=True))
            for detector in self.names:
                if detector == "diagonal":
                    yield self._row(name, detector, model.verdict(self._passages[name])) | unknown
                else:
                    verdict = by_rule if detector == "template" else by_threshold
                    yield self._row(name, detector, verdict) | known

    def learned(self) -> Learned:
        """Give what all labelled recordings teach, to judge others without them."""
        count = len(self._template.sizes_mm)
        return Learned(count, self._template.threshold(), self._diagonal.model([]))

    def _row(self, name: str, detector: str, verdict: Verdict) -> dict:
        row = {"recording": name, "detector": detector, **vars(verdict)}
        return row | {"location_s": row.pop("location_samples") / self._rate_hz}


def by_folds(
    detectors: Detectors, sizes_mm: Mapping[str, float], schemes: Sequence[Folds]
) -> list[dict]:
    """Let the detectors judge recordings of known size, each by what its training fold teaches.

    Parameters
    ----------
    detectors : Detectors
        Taught by the same recordings.
    sizes_mm : mapping of str to float
        The recordings and their true sizes.
    schemes : sequence of Folds
        The folds of these recordings, in the same order, under each scheme.

    Returns
    -------
    list of dict
        One row a detector, recording and scheme, in this order: those of `Detectors.rows` with
        ``size_mm`` and ``scheme``.
    """
    names, found = list(sizes_mm), {}
    for folds in schemes:
        for part in folds.parts():
            judged, left_out = ([names[place] for place in places] for places in part)
            for row in detectors.rows(judged, left_out):
                row |= {"size_mm": sizes_mm[row["recording"]], "scheme": folds.scheme}
                found[row["detector"], row["recording"], row["scheme"]] = row
    order = product(detectors.names, names, [folds.scheme for folds in schemes])
    return [found[key] for key in order]
