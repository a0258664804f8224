"""Let any estimator of scikit-learn take the place of a detector in the evaluation."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.verdicts import NO_VERDICT, Verdict, why_unknown
from capsule.errors import CapsuleError
from capsule.evaluation.cross_validation import Detectors, verdict_cells
from capsule.interface.loaded_archive import LoadedArchive
from capsule.interface.splits import teaching_rows
from capsule.kinds import Cells
from capsule.project import how_to_install

try:
    from sklearn.base import BaseEstimator, clone, is_classifier, is_regressor
except ImportError:
    raise CapsuleError(
        f"estimators need scikit-learn, which is not installed; run {how_to_install('learn')}"
    ) from None

_UNKNOWN = float("nan")


class EstimatorAsDetector(Detectors):
    """An estimator in the place of the configured detectors.

    A classifier learns the indices of the sizes, 0 for the smallest, because classes must be
    integers. Any other estimator learns the sizes in mm.
    """

    def __init__(self, archive: LoadedArchive, estimator: object, name: str) -> None:
        self.names, self._loaded, self._estimator = [name], archive, estimator
        self.columns = [*verdict_cells(NO_VERDICT, 1.0), "no_verdict"]
        self._sizes_mm, self._numbers = np.unique(archive.y, return_inverse=True)

    def rows(self, names: Sequence[str], left_out: Iterable[str]) -> Iterator[Cells]:
        """Fit the estimator without some recordings, and yield its verdicts on others."""
        taught = teaching_rows(self._loaded, set(left_out))
        index = self._loaded.index(names)
        usable = [name for name in names if not index[name]["no_verdict"]]
        verdicts = dict.fromkeys(names, NO_VERDICT)
        if usable and taught.size:
            judged = self._verdicts(taught, self._loaded.rows(usable))
            verdicts |= dict(zip(usable, judged, strict=True))
        rate_hz = self._loaded.settings["recording"]["rate_hz"]
        for name, verdict in verdicts.items():
            reason = index[name]["no_verdict"] or why_unknown(verdict)
            cells = verdict_cells(verdict, rate_hz) | {"no_verdict": reason}
            yield {"recording": name, "detector": self.names[0], **cells}

    def _verdicts(self, taught: np.ndarray, rows: np.ndarray) -> list[Verdict]:
        classifies = is_classifier(self._estimator)
        wanted = self._numbers if classifies else self._loaded.y
        fitted: Any = clone(self._estimator).fit(self._loaded.X[taught], wanted[taught])
        if hasattr(fitted, "verdicts"):
            judged: list[Verdict] = fitted.verdicts(rows)
            return judged
        predicted = np.asarray(fitted.predict(rows))
        if classifies:
            estimates = self._sizes_mm[predicted.astype(np.int64)]
            share = float((self._loaded.y[taught] > 0).mean())
            scores, threshold, chances = self._against_none(fitted, rows, share)
        else:
            # The prediction itself is the score.
            estimates = scores = predicted.astype(np.float64)
            threshold, chances = self._half_smallest(fitted), np.full(len(rows), _UNKNOWN)
        cells = zip(estimates.tolist(), scores.tolist(), chances.tolist(), strict=True)
        return [self._verdict(size, score, threshold, chance) for size, score, chance in cells]

    def _verdict(self, estimate: float, score: float, threshold: float, chance: float) -> Verdict:
        """Return the verdict of the size that is nearest to an estimate; NaN is none."""
        if np.isnan(estimate):
            return NO_VERDICT
        size_mm = float(self._sizes_mm[np.abs(self._sizes_mm - estimate).argmin()])
        estimate_mm = estimate if size_mm > 0 else _UNKNOWN
        return Verdict(size_mm, score, threshold, chance, estimate_mm=estimate_mm)

    def _half_smallest(self, fitted: object) -> float:
        """Return a regressor's threshold: half the smallest nodule, as close to 0 as to it."""
        nodules = self._sizes_mm[self._sizes_mm > 0]
        known = is_regressor(fitted) and nodules.size and self._sizes_mm[0] == 0
        return float(nodules[0]) / 2 if known else _UNKNOWN

    def _against_none(
        self, fitted: BaseEstimator, rows: np.ndarray, share: float
    ) -> tuple[FloatArray, float, FloatArray]:
        """Return a classifier's scores, their threshold, and the probabilities of a nodule."""
        unknown = np.full(len(rows), _UNKNOWN)
        classes = self._sizes_mm[np.asarray(fitted.classes_, dtype=np.int64)]
        if classes.size < 2 or classes[0] > 0:
            return unknown, _UNKNOWN, unknown
        if hasattr(fitted, "predict_proba"):
            scores = 1.0 - fitted.predict_proba(rows)[:, 0]
            # From the training's share of nodules to the prevalence.
            prevalence = self._loaded.settings["evaluation"]["prevalence"]
            ratio = prevalence / (1 - prevalence) * ((1 - share) / share)
            chances = scores * ratio / (scores * ratio + 1.0 - scores)
            # With more than two classes, the likeliest one may be below one half.
            return scores, 0.5 if classes.size == 2 else _UNKNOWN, chances
        if hasattr(fitted, "decision_function"):
            decision = np.asarray(fitted.decision_function(rows))
            if decision.ndim == 2:
                decision = decision[:, 1:].max(axis=1) - decision[:, 0]
            return decision, 0.0, unknown
        return unknown, _UNKNOWN, unknown
