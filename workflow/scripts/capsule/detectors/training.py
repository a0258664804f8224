"""Interfaces of the detectors: the archive that teaches, the recordings, models and detectors."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from typing import Any, Protocol

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.detectors.network import Features
from capsule.detectors.registry import detector_row
from capsule.detectors.search import Passage
from capsule.detectors.verdicts import Verdict
from capsule.detectors.wave_traits import WaveTraits
from capsule.kinds import Settings
from capsule.particle import Particle
from capsule.templates import TemplateSet


class JudgedRecording(Protocol):
    """The interface of a recording for the detectors."""

    @property
    def matrix(self) -> FloatArray:
        """Matrix V, (S, L)."""

    @property
    def passage(self) -> Passage:
        """Best candidate for a nodule."""

    @property
    def features(self) -> Features:
        """Features from the taught scorer."""


@dataclass(frozen=True)
class TrainingArchive:
    """The recordings of an archive with all data that the detectors learn from.

    Attributes
    ----------
    sizes_mm : mapping of str to float
        The labelled recordings that teach, and their sizes, 0 for no nodule. Recordings that
        cannot be judged are removed.
    templates : TemplateSet
        The templates of all sizes.
    particles : mapping of str to Particle
        The fits of the recordings that may be left out of the templates.
    passages : mapping of str to Passage
        The passage of each recording, labelled or not.
    load : callable
        ``load(name)`` returns the matrix V of a recording, (S, L).
    settings : mapping
        The section ``evaluation`` of the configuration, and the sections of the detectors.
    features : mapping of str to Features
        The features of each recording; empty if no detector uses them.
    no_verdict : mapping of str to str
        The reason why no detector judges a recording; empty or absent if it is judged.
    places : mapping of str to str
        The place of each recording, from `capsule.held_out.places_of`; one that is absent is a
        place of its own.
    traits : mapping of str to WaveTraits
        The traits of each recording's wave; empty if nobody asks which recordings are familiar.
    """

    sizes_mm: Mapping[str, float]
    templates: TemplateSet
    particles: Mapping[str, Particle]
    passages: Mapping[str, Passage]
    load: Callable[[str], FloatArray]
    settings: Settings
    features: Mapping[str, Features] = field(default_factory=dict)
    no_verdict: Mapping[str, str] = field(default_factory=dict)
    places: Mapping[str, str] = field(default_factory=dict)
    traits: Mapping[str, WaveTraits] = field(default_factory=dict)

    def __post_init__(self) -> None:
        judged = {n: size for n, size in self.sizes_mm.items() if not self.no_verdict.get(n)}
        object.__setattr__(self, "sizes_mm", judged)

    def place_numbers(self, names: Sequence[str]) -> IntArray:
        """Return the place of each recording as a number, (n,); passes over one place share it."""
        of_each = [self.places.get(name, name) for name in names]
        numbers: IntArray = np.unique(of_each, return_inverse=True)[1]
        return numbers

    def recording(self, name: str) -> "ArchivedRecording":
        """Return a recording of the archive for the detectors."""
        return ArchivedRecording(name, self)


@dataclass(frozen=True)
class ArchivedRecording:
    """A recording of an archive; its matrix is read when a detector asks for it."""

    name: str
    archive: TrainingArchive

    @cached_property
    def matrix(self) -> FloatArray:
        """Matrix V, (S, L)."""
        return self.archive.load(self.name)

    @property
    def passage(self) -> Passage:
        """Best candidate for a nodule."""
        return self.archive.passages[self.name]

    @property
    def features(self) -> Features:
        """Features from the taught scorer."""
        return self.archive.features[self.name]


class Model(Protocol):
    """The interface of a learned model, which judges recordings without the archive."""

    def verdict(self, recording: JudgedRecording) -> Verdict:
        """Judge one recording."""

    def stored(self) -> dict[str, Any]:
        """Return the model's own keys and plain values for results/detectors.json."""

    @classmethod
    def restored(cls, stored: Settings, templates: TemplateSet) -> "Model":
        """Return the model from the values of `stored` and the templates of all recordings."""


class Detector(Protocol):
    """The interface of a detector that an archive teaches and that can leave recordings out."""

    def __init__(self, archive: TrainingArchive) -> None: ...

    def without(self, left_out: Sequence[str]) -> Model:
        """Learn from all labelled recordings except those left out."""

    Model: type[Model]


def detector_class(name: str) -> type[Detector]:
    """Import and return the class of a detector; raise `CapsuleError` if there is none."""
    row = detector_row(name)
    detector: type[Detector] = getattr(import_module(row.module), row.built_by)
    return detector
