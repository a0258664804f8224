"""Judge the recordings of an archive with any estimator of scikit-learn, as with a detector."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from capsule.detectors.verdicts import NO_VERDICT, Verdict, why_unknown
from capsule.errors import CapsuleError
from capsule.evaluation.cross_validation import unlabelled_folds, verdict_cells
from capsule.held_out import teaching
from capsule.interface.loaded_archive import LoadedArchive
from capsule.interface.splits import folds
from capsule.kinds import Cells
from capsule.naming import sort_key

try:
    from sklearn.base import clone, is_classifier, is_regressor
except ImportError:
    raise CapsuleError(
        'estimators need scikit-learn: pip install "origami-capsule[learn]"'
    ) from None

_UNKNOWN = float("nan")


def estimator_rows(
    archive: LoadedArchive, estimator: object, name: str, scheme: str
) -> Iterator[Cells]:
    """Fit an estimator in every fold, and yield its verdicts on the recordings left out.

    Parameters
    ----------
    archive : LoadedArchive
        The archive, whose labelled recordings are judged.
    estimator : estimator of scikit-learn
        A classifier learns the indices of the sizes, 0 for the smallest, because classes must be
        integers. Any other estimator learns the sizes in mm.
    name : str
        Name of the estimator in the rows.
    scheme : str
        As in `folds`.

    Yields
    ------
    dict
        One row per recording, as from `capsule.evaluation.cross_validation.cross_validate`,
        without distances.
    """
    size_mm = dict(zip(archive.labelled, archive.y.tolist(), strict=True))
    for taught, judged in folds(archive, scheme).split():
        names = [archive.labelled[row] for row in judged]
        for cells in _judged(archive, estimator, taught, names):
            recording = cells.pop("recording")
            key = {"recording": recording, "size_mm": size_mm[recording]}
            yield key | {"detector": name, "scheme": scheme} | cells


def unlabelled_rows(archive: LoadedArchive, estimator: object, name: str) -> Iterator[Cells]:
    """Fit an estimator on all labelled recordings, and yield its verdicts on the unlabelled ones.

    Parameters
    ----------
    archive, estimator, name
        As in `estimator_rows`.

    Yields
    ------
    dict
        One row per recording, as from `capsule.evaluation.cross_validation.judge_unlabelled`,
        without distances.
    """
    index = archive.index(archive.labelled)
    taught = teaching(index, archive.settings["evaluation"]["held_out"])
    usable = [each in taught and not index[each]["no_verdict"] for each in archive.labelled]
    unlabelled = sorted(archive.unlabelled, key=sort_key)
    rows = archive.index([*archive.labelled, *unlabelled])
    for left_out, names in unlabelled_folds(unlabelled, rows):
        teaches = np.array(usable, dtype=bool) & ~np.isin(archive.labelled, list(left_out))
        for cells in _judged(archive, estimator, np.flatnonzero(teaches), names):
            yield {"recording": cells.pop("recording"), "detector": name} | cells


def _judged(
    archive: LoadedArchive, estimator: object, taught: np.ndarray, names: Sequence[str]
) -> Iterator[Cells]:
    """Fit on some rows of ``archive.X``, and yield the cells of the verdicts on recordings."""
    size_mm, rate_hz = archive.y, archive.settings["recording"]["rate_hz"]
    index = archive.index(names)
    usable = [name for name in names if not index[name]["no_verdict"]]
    verdicts = dict.fromkeys(names, NO_VERDICT)
    if usable and taught.size:
        sizes_mm, numbers = np.unique(size_mm, return_inverse=True)
        wanted = numbers if is_classifier(estimator) else size_mm
        fitted = clone(estimator).fit(archive.X[taught], wanted[taught])
        share = float((size_mm[taught] > 0).mean())
        prevalence = archive.settings["evaluation"]["prevalence"]
        seen = _Fitted(fitted, sizes_mm, share, prevalence)
        verdicts |= dict(zip(usable, seen.verdicts(archive.rows(usable)), strict=True))
    for name, verdict in verdicts.items():
        reason = index[name]["no_verdict"] or why_unknown(verdict)
        yield {"recording": name} | verdict_cells(verdict, rate_hz) | {"no_verdict": reason}


@dataclass(frozen=True)
class _Fitted:
    """A fitted estimator.

    Attributes
    ----------
    estimator : estimator of scikit-learn
    sizes_mm : (B,) array
        The sizes of the archive, ascending.
    taught_share : float
        Share of nodules among the recordings that taught the estimator.
    prevalence : float
        Prevalence at which the probabilities hold.
    """

    estimator: Any
    sizes_mm: np.ndarray
    taught_share: float
    prevalence: float

    def verdicts(self, rows: np.ndarray) -> list[Verdict]:
        """Return the verdicts on recordings, one row each."""
        if hasattr(self.estimator, "verdicts"):
            judged: list[Verdict] = self.estimator.verdicts(rows)
            return judged
        if is_classifier(self.estimator):
            return self._of_classifier(rows)
        return self._of_sizes(rows)

    def _of_sizes(self, rows: np.ndarray) -> list[Verdict]:
        """Return verdicts with the archive's nearest sizes; the prediction itself is the score."""
        scores = np.asarray(self.estimator.predict(rows), dtype=np.float64)
        threshold = _UNKNOWN
        nodules = self.sizes_mm[self.sizes_mm > 0]
        if is_regressor(self.estimator) and nodules.size and self.sizes_mm[0] == 0:
            # Half the smallest size is as close to 0 as to that size.
            threshold = float(nodules[0]) / 2
        verdicts = []
        for score in scores.tolist():
            if np.isnan(score):
                verdicts.append(NO_VERDICT)
                continue
            size_mm = float(self.sizes_mm[np.argmin(np.abs(self.sizes_mm - score))])
            estimate = score if size_mm > 0 else _UNKNOWN
            verdicts.append(Verdict(size_mm, score, threshold, estimate_mm=estimate))
        return verdicts

    def _of_classifier(self, rows: np.ndarray) -> list[Verdict]:
        """Return verdicts with the predicted class, and the score against no nodule."""
        sizes_mm = self.sizes_mm[np.asarray(self.estimator.predict(rows), dtype=np.int64)]
        scores, threshold, chances = self._against_none(rows)
        return [
            Verdict(size, score, threshold, chance, estimate_mm=size if size > 0 else _UNKNOWN)
            for size, score, chance in zip(sizes_mm.tolist(), scores, chances, strict=True)
        ]

    def _against_none(self, rows: np.ndarray) -> tuple[list[float], float, list[float]]:
        """Return scores, their threshold, and the probabilities of a nodule."""
        unknown = [_UNKNOWN] * len(rows)
        classes = self.sizes_mm[np.asarray(self.estimator.classes_, dtype=np.int64)]
        if classes.size < 2 or classes[0] > 0:
            return unknown, _UNKNOWN, unknown
        if hasattr(self.estimator, "predict_proba"):
            scores = 1.0 - self.estimator.predict_proba(rows)[:, 0]
            # With more than two classes, the likeliest one may be below one half.
            threshold = 0.5 if classes.size == 2 else _UNKNOWN
            return scores.tolist(), threshold, self._at_prevalence(scores).tolist()
        if hasattr(self.estimator, "decision_function"):
            decision = np.asarray(self.estimator.decision_function(rows))
            if decision.ndim == 2:
                decision = decision[:, 1:].max(axis=1) - decision[:, 0]
            return decision.tolist(), 0.0, unknown
        return unknown, _UNKNOWN, unknown

    def _at_prevalence(self, chances: np.ndarray) -> np.ndarray:
        """Return probabilities converted from the training's share of nodules to the prevalence."""
        ratio = self.prevalence / (1 - self.prevalence)
        ratio *= (1 - self.taught_share) / self.taught_share
        moved: np.ndarray = chances * ratio / (chances * ratio + 1.0 - chances)
        return moved
