"""Provide the detectors as estimators of scikit-learn.

X holds the readings of one recording per row, as in `LoadedArchive.X`. y holds the sizes of the
nodules in mm, 0 for none. A prediction is a size, or NaN without a verdict.

For scikit-learn, these estimators are neither classifiers nor regressors: 2.5 and NaN cannot be
classes, and regressors have no probabilities.
"""

from collections.abc import Sequence

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.familiar import Familiarity, FamiliarTeacher
from capsule.detectors.registry import detector_row
from capsule.detectors.training import TrainingArchive, detector_class
from capsule.detectors.verdicts import NO_VERDICT, Verdict
from capsule.errors import CapsuleError
from capsule.evaluation.lead import balanced_accuracy
from capsule.interface.described import DescribedRecording, JudgingSettings
from capsule.interface.frames import frame
from capsule.interface.sample_rows import as_readings
from capsule.interface.settings import shipped_settings
from capsule.kinds import Settings
from capsule.particles import Particle
from capsule.templates import build_templates

try:
    from sklearn.base import BaseEstimator, TransformerMixin
    from sklearn.utils import Tags
    from sklearn.utils.validation import check_is_fitted, validate_data
except ImportError:
    raise CapsuleError(
        'the estimators need scikit-learn: pip install "origami-capsule[learn]"'
    ) from None


class _OfReadings(BaseEstimator):
    """Base class of all that takes readings, one recording per row."""

    def __init__(self, settings: Settings | None = None) -> None:
        self.settings = settings

    def __sklearn_tags__(self) -> Tags:
        tags = super().__sklearn_tags__()
        tags.input_tags.allow_nan = True
        return tags

    def _settings(self) -> Settings:
        return shipped_settings() if self.settings is None else self.settings

    def _validated(self, X: object, **options: object) -> FloatArray:
        rows: FloatArray = validate_data(
            self, X, dtype=np.float64, ensure_all_finite="allow-nan", **options
        )
        return rows

    def _described(self, rows: np.ndarray) -> list[DescribedRecording]:
        settings = self._settings()
        sensors = settings["recording"]["sensors"]
        length = settings["preprocessing"]["length"]
        judging = JudgingSettings(settings)
        described = [DescribedRecording(as_readings(row, sensors), judging) for row in rows]
        for number, each in enumerate(described):
            if each.values.shape[1] > length:
                raise ValueError(
                    f"row {number} of X holds {each.values.shape[1]} samples of {sensors} sensors; "
                    f"at most {length} are allowed (preprocessing.length of the settings)"
                )
        return described


class _DetectorEstimator(_OfReadings):
    """Base class of the detectors; each subclass sets `detector`."""

    detector: str

    def __sklearn_tags__(self) -> Tags:
        tags = super().__sklearn_tags__()
        tags.target_tags.required = True
        # y holds sizes.
        tags.target_tags.positive_only = True
        return tags

    def fit(self, X: object, y: object) -> "_DetectorEstimator":
        """Learn from recordings of known size.

        Parameters
        ----------
        X : (n, N) array
            Readings, one recording per row; NaN where a reading is missing.
        y : (n,) array
            Sizes of the nodules in mm, 0 for none.

        Returns
        -------
        self

        Raises
        ------
        ValueError
            If X is not an array of readings, or y holds a size below 0.
        """
        rows, sizes_mm = self._validated(X, y=y, y_numeric=True)
        if (sizes_mm < 0).any():
            raise ValueError(f"y holds {sizes_mm.min():g}; sizes are 0 (no nodule) or more, in mm")
        pairs = list(zip(self._described(rows), sizes_mm.astype(float).tolist(), strict=True))
        usable = [(each, size_mm) for each, size_mm in pairs if not each.no_verdict]
        # Sort, because the sum of the same numbers depends on their order.
        usable.sort(key=lambda pair: (pair[0].name, pair[1]))
        archive = self._archive(usable)
        detector = detector_class(self.detector)
        # The stored values are all that a verdict needs, and they can be pickled.
        learned = detector(archive).without([]).stored()
        self.model_ = detector.Model.restored(learned, archive.templates)
        self.familiar_ = FamiliarTeacher(archive).without([])
        return self

    def predict(self, X: object) -> np.ndarray:
        """Return the sizes in mm, 0 for no nodule, NaN for no verdict, (n,)."""
        return np.array([verdict.predicted_mm for verdict in self.verdicts(X)])

    def decision_function(self, X: object) -> np.ndarray:
        """Return score minus threshold, which is above 0 for a nodule, (n,)."""
        return np.array([verdict.score - verdict.threshold for verdict in self.verdicts(X)])

    def score(self, X: object, y: object) -> float:
        """Return the balanced accuracy; a recording without a verdict counts as wrong.

        The report shows the detector with the highest balanced accuracy first.
        """
        predicted_mm, size_mm = self.predict(X), np.asarray(y, dtype=np.float64)
        rows = [
            {"size_mm": true, "predicted_mm": predicted}
            for true, predicted in zip(size_mm, predicted_mm, strict=True)
        ]
        return balanced_accuracy(frame(["size_mm", "predicted_mm"], rows))

    def verdicts(self, X: object) -> list[Verdict]:
        """Return the detector's full verdict on each recording: size, interval, place, ..."""
        check_is_fitted(self)
        return [
            NO_VERDICT if each.no_verdict else self.model_.verdict(each)
            for each in self._described(self._validated(X, reset=False))
        ]

    def familiar(self, X: object) -> list[Familiarity]:
        """Return whether each recording is of the kind that taught the detector.

        Nobody can tell of a recording without a verdict.
        """
        check_is_fitted(self)
        return [
            Familiarity(None, each.no_verdict)
            if each.no_verdict
            else self.familiar_.judge(each.traits)
            for each in self._described(self._validated(X, reset=False))
        ]

    def _archive(self, usable: Sequence[tuple[DescribedRecording, float]]) -> TrainingArchive:
        """Return the detector's training data, without data that it does not use."""
        settings, row = self._settings(), detector_row(self.detector)
        # Number the names, because the same readings may occur twice.
        named = {f"{each.name} {place}": each for place, (each, _) in enumerate(usable)}
        sizes_mm = dict(zip(named, [size_mm for _, size_mm in usable], strict=True))
        particles: dict[str, Particle] = {}
        by_size: dict[float, list[Particle]] = {}
        if row.by_templates:
            nodules = [name for name, size_mm in sizes_mm.items() if size_mm > 0]
            particles = {name: named[name].fit.particle for name in nodules}
            for name, particle in particles.items():
                by_size.setdefault(sizes_mm[name], []).append(particle)
        templates = build_templates(
            by_size,
            sensors=settings["recording"]["sensors"],
            first_peak=settings["fit"]["first_peak"],
            length=settings["preprocessing"]["length"],
        )
        passages = {} if row.by_templates else {n: each.passage for n, each in named.items()}
        features = {n: each.features for n, each in named.items()} if row.by_features else {}
        return TrainingArchive(
            sizes_mm,
            templates,
            particles,
            passages,
            lambda name: named[name].matrix,
            settings,
            features,
            traits={name: each.traits for name, each in named.items()},
        )


class _WithProbability(_DetectorEstimator):
    """Base class of the detectors that state a probability."""

    def predict_proba(self, X: object) -> np.ndarray:
        """Return the probabilities of no nodule and of a nodule, (n, 2); NaN if none is stated.

        The probabilities hold at the configured prevalence.
        """
        nodule = np.array([verdict.probability for verdict in self.verdicts(X)])
        return np.column_stack([1.0 - nodule, nodule])


class TemplateEstimator(_DetectorEstimator):
    """The paper's detector, which takes the nearest template.

    Parameters
    ----------
    settings : mapping, optional
        The configuration, such as ``archive.settings``; the one that ships with the library if
        not given.

    Attributes
    ----------
    model_ : capsule.detectors.training.Model
        The fitted model.
    """

    detector = "template"


class TemplateThresholdEstimator(_DetectorEstimator):
    """The paper's margin with a learned threshold; parameters as for `TemplateEstimator`."""

    detector = "template_threshold"


class DiagonalEstimator(_WithProbability):
    """The project's own detector, of the diagonal; parameters as for `TemplateEstimator`."""

    detector = "diagonal"


class TaughtEstimator(_WithProbability):
    """A network, trained on simulated benches and adapted by `fit`; as `TemplateEstimator`."""

    detector = "taught"


class MatrixTransformer(TransformerMixin, _OfReadings):
    """A transformer from readings to the padded matrices V, for general estimators.

    Parameters
    ----------
    settings : mapping, optional
        As for `TemplateEstimator`.
    """

    def fit(self, X: object, y: object = None) -> "MatrixTransformer":
        """Store the number of columns of X; nothing else is learned."""
        self._validated(X)
        return self

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "n_features_in_")

    def transform(self, X: object) -> np.ndarray:
        """Return the matrices V as rows, sensor after sensor: (n, S L); NaN without a wave.

        ``result.reshape(n, S, L)`` returns the matrices themselves.
        """
        check_is_fitted(self)
        settings = self._settings()
        size = settings["recording"]["sensors"] * settings["preprocessing"]["length"]
        unknown = np.full(size, np.nan)
        return np.array(
            [
                unknown if each.no_verdict else each.matrix.ravel()
                for each in self._described(self._validated(X, reset=False))
            ]
        )
