"""Provide the detectors as estimators of scikit-learn.

X holds the readings of one recording per row, as in `LoadedArchive.X`. y holds the sizes of the
nodules in mm, 0 for none. A prediction is a size, or NaN without a verdict.

For scikit-learn, these estimators are neither classifiers nor regressors: 2.5 and NaN cannot be
classes, and regressors have no probabilities.
"""

from collections.abc import Mapping
from functools import cache

import numpy as np
import pandas as pd

from capsule.arrays import FloatArray
from capsule.described_recording import (
    DescribedRecording,
    described,
    template_options,
    training_archive,
)
from capsule.detectors.familiar import Familiarity, FamiliarTeacher
from capsule.detectors.registry import DETECTORS, detector_row
from capsule.detectors.training import TrainingArchive, detector_class
from capsule.detectors.verdicts import NO_VERDICT, Verdict
from capsule.errors import CapsuleError
from capsule.evaluation.lead import balanced_accuracy
from capsule.interface.arguments import ArgumentError, refuse
from capsule.kinds import Settings
from capsule.project import how_to_install
from capsule.settings import read_settings
from capsule.templates import build_templates

try:
    from sklearn.base import BaseEstimator, TransformerMixin
    from sklearn.utils import Tags
    from sklearn.utils.metaestimators import available_if
    from sklearn.utils.validation import check_is_fitted, validate_data
except ImportError:
    raise CapsuleError(
        f"the estimators need scikit-learn, which is not installed; run {how_to_install('learn')}"
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
        if self.settings is None:
            return _shipped_settings()
        if not isinstance(self.settings, Mapping) or "preprocessing" not in self.settings:
            raise refuse("settings", self.settings, "a configuration such as archive.settings")
        return self.settings

    def _validated(self, X: object, **options: object) -> FloatArray:
        sensors = self._settings()["recording"]["sensors"]
        window = self._settings()["preprocessing"]["window"]
        rows, columns = (*getattr(X, "shape", ()), 0, 0)[:2]
        # Nobody can judge recordings of one sample, and a recording has several windows of them.
        if columns == sensors and rows > 2 * window:
            raise ArgumentError(
                f"X: {rows} rows of {sensors} readings are the samples of one recording; a row of "
                "X holds a whole recording, sample after sample with NaN behind the last: "
                "archive.rows(names) makes it"
            )
        checked: FloatArray = validate_data(
            self, X, dtype=np.float64, ensure_all_finite="allow-nan", **options
        )
        return checked

    def _described(self, rows: FloatArray) -> list[DescribedRecording]:
        options = template_options(self._settings())
        sensors, length = options["sensors"], options["length"]
        readings = [_readings(row, sensors) for row in rows]
        for number, values in enumerate(readings):
            if values.shape[1] > length:
                raise ArgumentError(
                    f"row {number} of X holds {values.shape[1]} samples of {sensors} sensors; "
                    f"at most {length} are allowed (preprocessing.length of the settings)"
                )
        return described(readings, self._settings())

    def _judged(self, X: object) -> list[DescribedRecording]:
        check_is_fitted(self)
        return self._described(self._validated(X, reset=False))


@cache
def _shipped_settings() -> Settings:
    return read_settings()


def _readings(row: FloatArray, sensors: int) -> FloatArray:
    """Return the readings (S, K) in a row, which may end within a sample."""
    padded = np.pad(row, (0, -row.size % sensors), constant_values=np.nan)
    values = padded.reshape(-1, sensors).T
    known = np.flatnonzero(~np.isnan(values).all(axis=0))
    return np.ascontiguousarray(values[:, : known[-1] + 1 if known.size else 0])


def _states_probability(estimator: "DetectorEstimator") -> bool:
    row = DETECTORS.get(estimator.detector)
    return row is not None and not row.by_templates


class DetectorEstimator(_OfReadings):
    """A detector of the report as an estimator.

    Parameters
    ----------
    detector : {"taught", "diagonal", "template", "template_threshold"}
        The detector, as in the configuration. The first two also state a probability.
    settings : mapping, optional
        The configuration, such as ``archive.settings``; by default the one that ships.

    Attributes
    ----------
    model_ : capsule.detectors.training.Model
        The fitted model.
    """

    def __init__(self, detector: str = "taught", settings: Settings | None = None) -> None:
        super().__init__(settings)
        self.detector = detector

    def __sklearn_tags__(self) -> Tags:
        tags = super().__sklearn_tags__()
        tags.target_tags.required = True
        # y holds sizes.
        tags.target_tags.positive_only = True
        return tags

    def fit(self, X: object, y: object) -> "DetectorEstimator":
        """Learn from recordings of known size.

        Parameters
        ----------
        X : (n, N) array
            Readings, one recording per row; NaN where a reading is missing.
        y : (n,) array
            Sizes of the nodules in mm, 0 for none.

        Raises
        ------
        ValueError
            If X is not an array of readings, or y holds a size below 0.
        """
        rows, sizes_mm = self._validated(X, y=y, y_numeric=True)
        if (sizes_mm < 0).any():
            raise ArgumentError(
                f"y holds {sizes_mm.min():g}; sizes are 0 (no nodule) or more, in mm"
            )
        pairs = zip(self._described(rows), sizes_mm.astype(float).tolist(), strict=True)
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

    def _archive(self, usable: list[tuple[DescribedRecording, float]]) -> TrainingArchive:
        settings = self._settings()
        # Number the names, because the same readings may occur twice.
        named = {f"{each.name} {place}": each for place, (each, _) in enumerate(usable)}
        sizes_mm = dict(zip(named, [size_mm for _, size_mm in usable], strict=True))
        nodules = [name for name, size_mm in sizes_mm.items() if size_mm > 0]
        fitted = nodules if detector_row(self.detector).by_templates else []
        particles = {name: named[name].fit.particle for name in fitted}
        by_size = {
            size_mm: [particles[name] for name in fitted if sizes_mm[name] == size_mm]
            for size_mm in {sizes_mm[name] for name in fitted}
        }
        templates = build_templates(by_size, **template_options(settings))
        return training_archive(sizes_mm, named, templates, particles, settings, [self.detector])

    def predict(self, X: object) -> np.ndarray:
        """Return the sizes in mm, 0 for no nodule, NaN for no verdict, (n,)."""
        return np.array([verdict.predicted_mm for verdict in self.verdicts(X)])

    @available_if(_states_probability)  # type: ignore[untyped-decorator]
    def predict_proba(self, X: object) -> np.ndarray:
        """Return the probabilities of no nodule and of a nodule, (n, 2); NaN if none is stated.

        They hold at the configured prevalence.
        """
        nodule = np.array([verdict.probability for verdict in self.verdicts(X)])
        return np.column_stack([1.0 - nodule, nodule])

    def decision_function(self, X: object) -> np.ndarray:
        """Return score minus threshold, which is above 0 for a nodule, (n,)."""
        return np.array([verdict.score - verdict.threshold for verdict in self.verdicts(X)])

    def score(self, X: object, y: object) -> float:
        """Return the balanced accuracy; a recording without a verdict counts as wrong.

        The report shows the detector with the highest balanced accuracy first.
        """
        sizes_mm = {"size_mm": np.asarray(y, float), "predicted_mm": self.predict(X)}
        return balanced_accuracy(pd.DataFrame(sizes_mm))

    def verdicts(self, X: object) -> list[Verdict]:
        """Return the detector's full verdict on each recording: size, interval, place, ..."""
        return [
            NO_VERDICT if each.no_verdict else self.model_.verdict(each) for each in self._judged(X)
        ]

    def familiar(self, X: object) -> list[Familiarity]:
        """Return whether each recording is of the kind that taught the detector.

        Nobody can tell of a recording without a verdict.
        """
        return [
            Familiarity(None, each.no_verdict)
            if each.no_verdict
            else self.familiar_.judge(each.traits)
            for each in self._judged(X)
        ]


class TemplateEstimator(DetectorEstimator):
    """The paper's detector: ``DetectorEstimator("template", settings)``."""

    def __init__(self, settings: Settings | None = None) -> None:
        super().__init__("template", settings)


class TemplateThresholdEstimator(DetectorEstimator):
    """The paper's margin: ``DetectorEstimator("template_threshold", settings)``."""

    def __init__(self, settings: Settings | None = None) -> None:
        super().__init__("template_threshold", settings)


class DiagonalEstimator(DetectorEstimator):
    """The detector of the diagonal: ``DetectorEstimator("diagonal", settings)``."""

    def __init__(self, settings: Settings | None = None) -> None:
        super().__init__("diagonal", settings)


class TaughtEstimator(DetectorEstimator):
    """The network: ``DetectorEstimator("taught", settings)``."""

    def __init__(self, settings: Settings | None = None) -> None:
        super().__init__("taught", settings)


class MatrixTransformer(TransformerMixin, _OfReadings):
    """A transformer from readings to the padded matrices V, for general estimators.

    Parameters
    ----------
    settings : mapping, optional
        As for `DetectorEstimator`.
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
        options = template_options(self._settings())
        unknown = np.full(options["sensors"] * options["length"], np.nan)
        return np.array(
            [unknown if each.no_verdict else each.matrix.ravel() for each in self._judged(X)]
        )
