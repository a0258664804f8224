"""Provide the detectors as estimators of scikit-learn.

X holds the readings of one recording per row, as in `LoadedArchive.X`. y holds the sizes of the
nodules in mm, 0 for none. A prediction is a size, or NaN without a verdict.

For scikit-learn, these estimators are neither classifiers nor regressors: 2.5 and NaN cannot be
classes, and regressors have no probabilities.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache, lru_cache

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.base import NO_VERDICT, TrainingArchive, Verdict
from capsule.detectors.described_recording import DescribedRecording, described
from capsule.detectors.familiar import Familiarity, FamiliarKind
from capsule.detectors.registry import detector_class, detector_row
from capsule.engine.configuration import read_settings
from capsule.engine.project import not_installed
from capsule.evaluation.cross_validation import Detectors, verdict_cells
from capsule.evaluation.rates import is_right
from capsule.interface.archive import LoadedArchive
from capsule.interface.arguments import ArgumentError, refuse, with_missing
from capsule.kinds import Cells, Settings
from capsule.method.particle import Particle
from capsule.method.templates import build_templates, template_options

try:
    from sklearn.base import BaseEstimator, TransformerMixin, clone, is_classifier, is_regressor
    from sklearn.utils import Tags
    from sklearn.utils.metaestimators import available_if
    from sklearn.utils.validation import (
        check_consistent_length,
        check_is_fitted,
        column_or_1d,
        has_fit_parameter,
        validate_data,
    )
except ImportError:
    raise not_installed("the estimators need scikit-learn", "learn") from None

_shipped_settings = cache(read_settings)


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
        settings = self._settings()
        rows, columns = (*getattr(X, "shape", ()), 0, 0)[:2]
        # Nobody can judge recordings of one sample, and a recording has several windows of them.
        few = 2 * settings["preprocessing"]["window"]
        if columns == settings["recording"]["sensors"] and rows > few:
            raise ArgumentError(
                f"X: {rows} rows of {columns} readings are the samples of one recording; a row of "
                "X holds a whole recording, sample after sample with NaN behind the last: "
                "archive.rows(names) makes it"
            )
        options |= {"dtype": np.float64, "ensure_all_finite": "allow-nan"}
        checked: FloatArray = validate_data(self, with_missing(X), **options)
        return checked

    def _described(self, rows: FloatArray) -> list[DescribedRecording]:
        shape = template_options(self._settings())
        readings = [_readings(row, shape["sensors"]) for row in rows]
        for number, values in enumerate(readings):
            if values.shape[1] > shape["length"]:
                raise ArgumentError(
                    f"row {number} of X holds {values.shape[1]} samples of {len(values)} sensors; "
                    f"at most {shape['length']} are allowed (preprocessing.length of the settings)"
                )
        return described(readings, self._settings())

    def _judged(self, X: object) -> list[DescribedRecording]:
        check_is_fitted(self)
        return self._described(self._validated(X, reset=False))


def _readings(row: FloatArray, sensors: int) -> FloatArray:
    """Return the readings (S, K) in a row, which may end within a sample."""
    padded = np.pad(row, (0, -row.size % sensors), constant_values=np.nan)
    values = padded.reshape(-1, sensors).T
    known = np.flatnonzero(~np.isnan(values).all(axis=0))
    return np.ascontiguousarray(values[:, : known[-1] + 1 if known.size else 0])


def _states_probability(estimator: "DetectorEstimator") -> bool:
    return not detector_row(estimator.detector).by_templates


class DetectorEstimator(_OfReadings):
    """A detector of the report as an estimator.

    Parameters
    ----------
    detector : {"taught", "diagonal", "template"}
        The detector, as in the configuration. The first two also state a probability.
    settings : mapping, optional
        The configuration, such as ``archive.settings``; by default the one that ships.

    Attributes
    ----------
    model_ : capsule.detectors.base.Detector
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

    def fit(self, X: object, y: object, groups: object = None) -> "DetectorEstimator":
        """Learn from recordings of known size.

        Parameters
        ----------
        X : (n, N) array
            Readings, one recording per row; NaN where a reading is missing.
        y : (n,) array
            Sizes of the nodules in mm, 0 for none.
        groups : (n,) array, optional
            The place of each recording, such as ``archive.groups``: passes over one place share its
            label. If not given, each recording is a place of its own.

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
        places = range(len(rows)) if groups is None else column_or_1d(groups).tolist()
        check_consistent_length(rows, places)
        seen = zip(self._described(rows), sizes_mm.astype(float).tolist(), places, strict=True)
        usable = [each for each in seen if not each[0].no_verdict]
        # Sort, because the sum of the same numbers depends on their order.
        usable.sort(key=lambda each: (each[0].name, each[1]))
        # Number the names, because the same readings may occur twice.
        named = {f"{each.name} {turn}": each for turn, (each, *_) in enumerate(usable)}
        known_mm = {name: size for name, (_, size, _) in zip(named, usable, strict=True)}
        place_of = {name: str(place) for name, (*_, place) in zip(named, usable, strict=True)}
        particles: dict[float, list[Particle]] = {}
        for name, each in named.items():
            if known_mm[name] > 0 and detector_row(self.detector).by_templates:
                particles.setdefault(known_mm[name], []).append(each.fit.particle)
        settings = self._settings()
        templates = build_templates(particles, **template_options(settings))
        archive = TrainingArchive(known_mm, named, templates, {}, settings, places=place_of)
        detector = detector_class(self.detector)
        # The stored values are all that a verdict needs, and they can be pickled.
        self.model_ = detector.restored(detector.taught(archive).stored(), templates)
        self.familiar_ = FamiliarKind.taught(archive)
        return self

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
        """Return the mean of sensitivity and specificity; no verdict counts as a wrong one.

        It is NaN without a recording of a nodule, or without a healthy one.
        """
        sizes_mm = np.asarray(y, float)
        right, nodule = is_right(self.predict(X), sizes_mm), sizes_mm > 0
        if nodule.all() or not nodule.any():
            return float("nan")
        return float((right[nodule].mean() + right[~nodule].mean()) / 2)

    def verdicts(self, X: object) -> list[Verdict]:
        """Return the detector's full verdict on each recording: size, interval, place, ..."""
        return [
            NO_VERDICT if each.no_verdict else self.model_.verdict(each) for each in self._judged(X)
        ]

    def familiar(self, X: object) -> list[Familiarity]:
        """Return whether each recording is of the kind that taught the detector.

        Nobody can tell of a recording without a verdict.
        """
        judged = self._judged(X)
        told = iter(
            self.familiar_.judge_all([each.traits for each in judged if not each.no_verdict])
        )
        return [Familiarity(None) if each.no_verdict else next(told) for each in judged]


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

    def transform(self, X: object) -> np.ndarray:
        """Return the matrices V as rows, sensor after sensor: (n, S L); NaN without a wave.

        ``result.reshape(n, S, L)`` returns the matrices themselves.
        """
        options = template_options(self._settings())
        unknown = np.full(options["sensors"] * options["length"], np.nan)
        return np.array(
            [unknown if each.no_verdict else each.matrix.ravel() for each in self._judged(X)]
        )


class EstimatorAsDetector(Detectors):
    """An estimator in the place of the configured detectors.

    A classifier learns the indices of the sizes, 0 for the smallest, because classes must be
    integers. Any other estimator learns the sizes in mm.
    """

    def __init__(self, archive: LoadedArchive, estimator: object, name: str) -> None:
        self.names, self._loaded, self._estimator = [name], archive, estimator
        self.columns = [*verdict_cells(NO_VERDICT, 1.0)]
        # As in `Detectors`.
        self._fitted = lru_cache(maxsize=2)(self._fit)
        self._sizes_mm, self._numbers = np.unique(archive.y, return_inverse=True)

    def rows(self, names: Sequence[str], left_out: Iterable[str]) -> Iterator[Cells]:
        """Fit the estimator without some recordings, and yield its verdicts on others."""
        index = self._loaded.index(names)
        usable = [name for name in names if not index[name]["no_verdict"]]
        said = self._said(usable, frozenset(left_out))
        rate_hz = self._loaded.settings["recording"]["rate_hz"]
        for name in names:
            verdict = said.get(name, NO_VERDICT)
            cells = verdict_cells(verdict, rate_hz, index[name]["no_verdict"])
            yield {"recording": name, "detector": self.names[0], **cells}

    def _said(self, names: Sequence[str], left_out: frozenset[str]) -> dict[str, Verdict]:
        """Return the verdicts on recordings; none if nothing is left to teach the estimator."""
        if not names or (fitted := self._fitted(left_out)) is None:
            return {}
        return dict(zip(names, self._verdicts(*fitted, self._loaded.rows(names)), strict=True))

    def _fit(self, left_out: frozenset[str]) -> tuple[BaseEstimator, float] | None:
        """Return the fitted estimator and the share of nodules that taught it, if any teaches."""
        teach = self._loaded.teaching_rows(left_out)
        if not teach.size:
            return None
        sizes_mm = self._loaded.y
        wanted = self._numbers if is_classifier(self._estimator) else sizes_mm
        options = {}
        if has_fit_parameter(self._estimator, "groups"):
            options["groups"] = self._loaded.groups[teach]
        fitted = clone(self._estimator).fit(self._loaded.X[teach], wanted[teach], **options)
        return fitted, float((sizes_mm[teach] > 0).mean())

    def _verdicts(self, fitted: BaseEstimator, share: float, rows: FloatArray) -> list[Verdict]:
        if hasattr(fitted, "verdicts"):
            judged: list[Verdict] = fitted.verdicts(rows)
            return judged
        said = np.asarray(fitted.predict(rows))
        classifies = is_classifier(fitted)
        estimates = self._sizes_mm[said.astype(np.int64)] if classifies else said.astype(np.float64)
        scores, threshold, chances = self._scores(fitted, rows, estimates, share)
        nearest = np.abs(self._sizes_mm - estimates[:, np.newaxis]).argmin(axis=1)
        cells = [self._sizes_mm[nearest], scores, chances, estimates]
        return [
            NO_VERDICT
            if np.isnan(said_mm)
            else Verdict(size, score, threshold, chance, said_mm if size > 0 else np.nan)
            for size, score, chance, said_mm in zip(*(each.tolist() for each in cells), strict=True)
        ]

    def _scores(
        self, fitted: BaseEstimator, rows: FloatArray, estimates: FloatArray, share: float
    ) -> tuple[FloatArray, float, FloatArray]:
        """Return scores, their threshold and the probabilities of a nodule, NaN if not known.

        `share` is that of nodules among the recordings that taught.
        """
        unknown, sizes_mm = np.full(len(rows), np.nan), self._sizes_mm
        if not is_classifier(fitted):
            # The prediction is the score. Half the smallest nodule is as close to 0 as to it.
            known = is_regressor(fitted) and sizes_mm[0] == 0 and sizes_mm.size > 1
            return estimates, float(sizes_mm[1]) / 2 if known else np.nan, unknown
        classes = sizes_mm[np.asarray(fitted.classes_, dtype=np.int64)]
        if classes.size < 2 or classes[0] > 0:
            return unknown, np.nan, unknown
        if hasattr(fitted, "predict_proba"):
            scores = 1.0 - fitted.predict_proba(rows)[:, 0]
            # From the training's share of nodules to the prevalence.
            prevalence = self._loaded.settings["evaluation"]["prevalence"]
            ratio = prevalence / (1 - prevalence) * ((1 - share) / share)
            chances = scores * ratio / (scores * ratio + 1.0 - scores)
            # With more than two classes, the likeliest one may be below one half.
            return scores, 0.5 if classes.size == 2 else np.nan, chances
        if hasattr(fitted, "decision_function"):
            decision = np.asarray(fitted.decision_function(rows))
            if decision.ndim == 2:
                decision = decision[:, 1:].max(axis=1) - decision[:, 0]
            return decision, 0.0, unknown
        return unknown, np.nan, unknown
