"""What every detector shares: what teaches it, what it judges, its verdict, and how it is stored.

A detector that compares one score with a threshold says only what it sees of a recording, which
part of this tells the size, and what it learns for its score. The rest is the same for all: the
places that are left out, the threshold, the probability and the sizes.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar, Protocol, Self, TypeAlias

import numpy as np

from capsule.arrays import FloatArray, IntArray, plain
from capsule.detectors.calibrate import (
    Probability,
    Regression,
    SizeModel,
    fit_probability,
    fit_sizes,
    rank_threshold,
)
from capsule.detectors.network import UNKNOWN_FEATURES, Features
from capsule.detectors.search import UNKNOWN, Passage
from capsule.detectors.wave_traits import UNKNOWN_TRAITS, WaveTraits
from capsule.kinds import Settings
from capsule.method.particle import Particle
from capsule.method.templates import TemplateSet

# Penalty of the size regression of a detector without a setting for it.
_SIZE_RIDGE = 1.0
# Number of each recording whose row teaches; the rows, the sizes in mm and the places.
_Rows: TypeAlias = tuple[dict[str, int], FloatArray, FloatArray, IntArray]


class JudgedRecording(Protocol):
    """What the detectors see of a recording, whether it is stored or described when they ask."""

    @property
    def matrix(self) -> FloatArray:
        """Matrix V, (S, L)."""

    @property
    def passage(self) -> Passage:
        """Its best candidate for a nodule."""

    @property
    def traits(self) -> WaveTraits:
        """The traits of its wave."""

    @property
    def features(self) -> Features:
        """The taught scorer's features of it."""


@dataclass(frozen=True, eq=False)
class StoredRecording:
    """A recording whose description is known; ``load()`` reads its matrix, (S, L)."""

    load: Callable[[], FloatArray]
    passage: Passage = UNKNOWN
    traits: WaveTraits = UNKNOWN_TRAITS
    features: Features = UNKNOWN_FEATURES

    @property
    def matrix(self) -> FloatArray:
        """Matrix V, (S, L); an archive may hold too many to keep them."""
        return self.load()


@dataclass(frozen=True, eq=False)
class TrainingArchive:
    """The recordings of an archive with all data that the detectors learn from.

    Attributes
    ----------
    sizes_mm : mapping of str to float
        The labelled recordings that teach, and their sizes, 0 for no nodule. Recordings that
        cannot be judged are removed.
    recordings : mapping of str to JudgedRecording
        What the detectors see of each recording that can be judged, labelled or not.
    templates : TemplateSet
        The templates of all sizes.
    particles : mapping of str to Particle
        The fits of the recordings that may be left out of the templates.
    settings : mapping
        The section ``evaluation`` of the configuration, and the sections of the detectors.
    no_verdict : mapping of str to str
        The reason why no detector judges a recording; empty or absent if it is judged.
    places : mapping of str to str
        The place of each recording, from `capsule.recordings.origin.places_of`; one that is
        absent is a place of its own.
    """

    sizes_mm: Mapping[str, float]
    recordings: Mapping[str, JudgedRecording]
    templates: TemplateSet
    particles: Mapping[str, Particle]
    settings: Settings
    no_verdict: Mapping[str, str] = field(default_factory=dict)
    places: Mapping[str, str] = field(default_factory=dict)
    _rows: dict[Callable[[JudgedRecording], FloatArray], _Rows] = field(
        default_factory=dict, init=False
    )

    def __post_init__(self) -> None:
        judged = {n: size for n, size in self.sizes_mm.items() if not self.no_verdict.get(n)}
        object.__setattr__(self, "sizes_mm", judged)

    def teaching(
        self, seen: Callable[[JudgedRecording], FloatArray], left_out: Collection[str]
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return what is seen of the recordings that teach, except those left out.

        ``seen(recording)`` returns a row (F,) of numbers, which is kept. A recording whose row
        begins with NaN teaches nothing. The results are the rows (n, F), the true sizes in mm, 0
        for none, and the numbers of the places, (n,).
        """
        if seen not in self._rows:
            self._rows[seen] = self._rows_of(seen)
        number, rows, sizes_mm, places = self._rows[seen]
        teaches = np.ones(len(rows), dtype=bool)
        teaches[[number[name] for name in number.keys() & left_out]] = False
        return rows[teaches], sizes_mm[teaches], places[teaches]

    def _rows_of(self, seen: Callable[[JudgedRecording], FloatArray]) -> _Rows:
        rows = {name: seen(self.recordings[name]) for name in self.sizes_mm}
        names = [name for name, row in rows.items() if not np.isnan(row[0])]
        stacked = np.array([rows[name] for name in names] or np.empty((0, 1)), np.float64)
        sizes_mm = np.array([self.sizes_mm[name] for name in names], dtype=np.float64)
        places = np.unique([self.places.get(name, name) for name in names], return_inverse=True)[1]
        return {name: number for number, name in enumerate(names)}, stacked, sizes_mm, places


@dataclass(frozen=True)
class Verdict:
    """A detector's verdict on one recording, with the same fields for every detector.

    Attributes
    ----------
    predicted_mm : float
        0 for no nodule, otherwise one of the archive's sizes in mm; NaN for no verdict.
    score : float
        Higher if a nodule is more likely.
    threshold : float
        A score above it means a nodule.
    probability : float
        Probability of a nodule at the configured prevalence; NaN for a detector that gives none.
    estimate_mm : float
        Size of the nodule in mm; NaN if none is detected.
    estimate_low_mm, estimate_high_mm : float
        Ends of the interval of the size in mm; NaN for a detector that gives none.
    location_samples, location_mm : float
        When the first sensor passes the nodule, in samples from the start; and how far the capsule
        has moved until then, in mm. NaN if none is detected, or if unknown.
    distances : tuple of float, or None
        Distance to every template, T^0 first; None for a detector that does not use them.
    """

    predicted_mm: float
    score: float
    threshold: float
    probability: float = np.nan
    estimate_mm: float = np.nan
    location_samples: float = np.nan
    location_mm: float = np.nan
    estimate_low_mm: float = np.nan
    estimate_high_mm: float = np.nan
    distances: tuple[float, ...] | None = None


NO_VERDICT = Verdict(np.nan, np.nan, np.nan)


def why_unknown(verdict: Verdict) -> str:
    """Return why a detector gives no verdict; empty if it gives one."""
    if not np.isnan(verdict.predicted_mm):
        return ""
    # If the score is known, only the recordings that teach the threshold are missing.
    return (
        "no score: a wave, a sensor or labelled recordings are missing"
        if np.isnan(verdict.score)
        else "no threshold: labelled recordings to learn it from are missing"
    )


class Detector(ABC):
    """A detector that an archive has taught; it judges other recordings without the archive."""

    @classmethod
    @abstractmethod
    def taught(cls, archive: TrainingArchive, left_out: Collection[str] = ()) -> Self:
        """Learn from all labelled recordings of an archive except those left out."""

    @abstractmethod
    def verdict(self, recording: JudgedRecording) -> Verdict:
        """Judge one recording."""

    @abstractmethod
    def stored(self) -> dict[str, Any]:
        """Return its own keys and plain values for results/detectors.json."""

    @classmethod
    @abstractmethod
    def restored(cls, stored: Settings, templates: TemplateSet) -> Self:
        """Return the detector from what `stored` gave and the templates of all recordings."""


@dataclass(frozen=True)
class ScoredDetector(Detector):
    """The base of a detector that compares one score with a threshold.

    A subclass names itself and says what it sees. Its name is also the key of its values in
    results/detectors.json.

    Attributes
    ----------
    threshold : float
        A score above it means a nodule; NaN if there is no healthy recording.
    learned : Regression or None
        What the score needs besides the recording; None if it needs nothing.
    probability : Probability or None
        Curve from the score to the probability of a nodule.
    sizes : SizeModel or None
        Model from the columns `sized_by` to the size.
    """

    name: ClassVar[str]
    # The columns of `seen` that tell the size.
    sized_by: ClassVar[slice] = slice(None)

    threshold: float
    learned: Regression | None
    probability: Probability | None
    sizes: SizeModel | None

    @staticmethod
    @abstractmethod
    def seen(recording: JudgedRecording) -> FloatArray:
        """Return what the detector sees of a recording, (F,); NaN in the first place: no verdict.

        If nothing is learned for the score, the first value is the score.
        """

    @staticmethod
    def learn(
        seen: FloatArray, sizes_mm: FloatArray, places: IntArray, settings: Settings
    ) -> tuple[Regression | None, FloatArray]:
        """Learn what the score needs; if not defined, nothing.

        For the first three parameters see `TrainingArchive.teaching`; the settings are the
        detector's section of the configuration. The first result is what `score` needs. The second
        (n,) is the score of each recording by a model that its place did not teach; NaN if unknown.
        """
        return None, seen[:, 0]

    def score(self, seen: FloatArray) -> float:
        """Return the score of one recording: higher if a nodule is more likely, NaN if unknown."""
        return float(seen[0])

    @classmethod
    def taught(cls, archive: TrainingArchive, left_out: Collection[str] = ()) -> Self:
        """Learn from all labelled recordings of an archive except those left out."""
        settings, rules = archive.settings.get(cls.name, {}), archive.settings["evaluation"]
        seen, sizes_mm, places = archive.teaching(cls.seen, left_out)
        learned, scores = cls.learn(seen, sizes_mm, places, settings)
        known = ~np.isnan(scores)
        nodule, healthy = sizes_mm > 0, known & (sizes_mm == 0)
        threshold = rank_threshold(scores[healthy], places[healthy], rules["specificity"])
        return cls(
            threshold,
            learned,
            fit_probability(scores[known], nodule[known], places[known], rules["prevalence"]),
            fit_sizes(
                seen[nodule, cls.sized_by],
                sizes_mm[nodule],
                places[nodule],
                scores[nodule] > threshold,
                ridge=settings.get("size_ridge", _SIZE_RIDGE),
                confidence=rules["size_confidence"],
            ),
        )

    def verdict(self, recording: JudgedRecording) -> Verdict:
        """Judge one recording."""
        seen = self.seen(recording)
        score = self.score(seen)
        if np.isnan(score) or np.isnan(self.threshold):
            return Verdict(np.nan, score, self.threshold)
        chance = np.nan if self.probability is None else float(self.probability.of(score))
        if score <= self.threshold:
            return Verdict(0.0, score, self.threshold, chance)
        if self.sizes is None:
            return Verdict(np.nan, score, self.threshold, chance)
        estimate = float(self.sizes.estimate(seen[self.sized_by]))
        where = recording.passage
        return Verdict(
            self.sizes.nearest(estimate),
            score,
            self.threshold,
            chance,
            estimate,
            where.location_samples,
            where.location_mm,
            *self.sizes.interval(estimate),
        )

    def stored(self) -> dict[str, Any]:
        """Return the model in a form that JSON can store, under the detector's name."""
        return {self.name: plain(asdict(self))}

    @classmethod
    def restored(cls, stored: Settings, templates: TemplateSet | None = None) -> Self:
        """Return the detector from what `stored` gave; it needs no template."""
        values = stored[cls.name]
        threshold, probability = values["threshold"], values["probability"]
        return cls(
            np.nan if threshold is None else threshold,
            values["learned"] and Regression.restored(values["learned"]),
            probability and Probability(**probability),
            values["sizes"] and SizeModel.restored(values["sizes"]),
        )
