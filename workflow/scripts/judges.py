"""Every configured detector on one recording, as rows of a table."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np

import files
from capsule.detectors.diagonal import Passage
from capsule.detectors.learned import Learned
from capsule.detectors.learning import DiagonalDetector
from capsule.detectors.paper import TemplateDetector
from capsule.detectors.verdicts import Verdict
from capsule.naming import folder_of, size_label
from capsule.particles import Particle
from capsule.templates import TemplateSet

COLUMNS = ["score", "threshold", "probability", "estimate_mm", "location_s", "location_mm"]


class Judges:
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
        self.detectors = settings["detectors"]
        self.labels = [f"rmse_{size_label(size)}" for size in templates.sizes_mm]
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
        templates, model = self._template.without(left_out), self._diagonal.model(left_out)
        unknown = dict.fromkeys(self.labels)
        for name in names:
            distances, by_rule, by_threshold = self._template.judge(name, templates)
            known = dict(zip(self.labels, distances.tolist(), strict=True))
            for detector in self.detectors:
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


def read_array(folder: Path, recording: str) -> np.ndarray:
    """Read a recording's array, such as its matrix, that a stage before has written."""
    return np.load(folder / f"{recording}.npy")


def read_passages(folder: Path, recordings: Iterable[str]) -> dict[str, Passage]:
    """Read the passages of some recordings, a table a folder; an empty cell is unknown."""
    wanted = set(recordings)
    names = [field.name for field in fields(Passage)]
    return {
        row["recording"]: Passage(**{name: float(row[name] or "nan") for name in names})
        for label in sorted({folder_of(name) for name in wanted})
        for row in files.read_csv(folder / f"{label}.csv")
        if row["recording"] in wanted
    }
