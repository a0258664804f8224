"""Judge detectors, and any estimator of scikit-learn, with the folds of the workflow."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from capsule.detectors.registry import DETECTORS
from capsule.errors import CapsuleError
from capsule.evaluation.confounded import confounded_keys
from capsule.evaluation.cross_validation import (
    LEAST_GROUPS,
    LEAVE_ONE_OUT,
    RESUBSTITUTION,
    Detectors,
    Fold,
    cross_validate,
    folds_of,
    group_scheme,
    judge_unlabelled,
)
from capsule.evaluation.measures import KEY, by_name, evaluate_archive, measure_tables
from capsule.interface.archive import LoadedArchive, require_archive, with_nan
from capsule.recordings.held_out import teaching
from capsule.recordings.names import sort_key

_Part = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Judgement:
    """The verdicts of detectors on an archive, and their rates.

    Attributes
    ----------
    predictions : DataFrame
        One row per detector, recording and scheme: true and predicted size in mm (NaN without a
        verdict), score, threshold, probability, place, ...; as
        ``results/evaluation/predictions.csv``.
    tables : dict of str to DataFrame
        ``detection``, ``sizing``, ``confusion``, ``summary``, ``calibration``, ``comparison``,
        ``retest``, ``roc``, ``learning``: the tables of ``results/evaluation/``.
    detections : DataFrame
        Verdicts on the unlabelled recordings, as ``results/detections.csv``.
    confounded : DataFrame
        Empty, unless nodules or their sizes follow from a key of the header of the recordings that
        teach. A detector may then have learned this instead. The table has the number of
        ``recordings`` by ``key``, ``value`` and ``size_mm``.
    """

    predictions: pd.DataFrame
    tables: dict[str, pd.DataFrame]
    detections: pd.DataFrame
    confounded: pd.DataFrame

    def __repr__(self) -> str:
        detectors = ", ".join(self.predictions["detector"].unique())
        return (
            f"<{type(self).__name__} of {detectors}: {len(self.predictions)} predictions, "
            f"{len(self.detections)} detections; tables: {', '.join(self.tables)}>"
        )


def judge(
    archive: LoadedArchive,
    estimator: object = None,
    *,
    name: str | None = None,
    scheme: str = LEAVE_ONE_OUT,
) -> Judgement:
    """Judge each labelled recording by what the others teach, and return verdicts and rates.

    Parameters
    ----------
    archive : LoadedArchive
        The recordings.
    estimator : estimator of scikit-learn, optional
        Estimator to fit on rows of ``archive.X`` and ``archive.y`` in every fold. If not given, the
        configured detectors are judged with all configured schemes. The numbers are then those of
        the workflow, bit by bit.
    name : str, optional
        Name of the estimator in the tables; its class if not given.
    scheme : str
        The scheme for an estimator, as in `folds`.

    Returns
    -------
    Judgement

    Raises
    ------
    CapsuleError
        If no recording can teach.
    """
    require_archive(archive)
    rules, index = archive.settings["evaluation"], archive.index(archive.labelled)
    detectors: Detectors
    if estimator is None:
        if not archive.particles():
            raise CapsuleError(
                "judge: no recording of a nodule can be used, so no template can be made; look for "
                "the reasons in archive.recordings"
            )
        training = archive.training_archive()
        detectors = Detectors(training)
        tables = evaluate_archive(training, index)
        predictions = tables.pop("predictions")
    else:
        from capsule.interface.estimators import EstimatorAsDetector  # scikit-learn if it is used

        called = name or type(estimator).__name__
        if called in DETECTORS:
            raise CapsuleError(f"judge: {called!r} is a configured detector; give another name")
        detectors = EstimatorAsDetector(archive, estimator, called)
        verdicts = cross_validate(detectors, _folds_of_scheme(archive, scheme))
        predictions = by_name(pd.DataFrame(verdicts, columns=[*KEY, *detectors.columns]))
        sizes_mm = sorted({0.0, *archive.y.tolist()})
        tables = measure_tables(predictions, sizes_mm, rules | {"passes": []}, index)
    unlabelled = sorted(archive.unlabelled, key=sort_key)
    rows = archive.index(archive.readings)
    apart = [*rows.keys() - teaching(rows, rules["held_out"]).keys()]
    detections = pd.DataFrame(
        judge_unlabelled(detectors, unlabelled, rows, apart),
        columns=["recording", "detector", *detectors.columns],
    )
    confounded = [
        (found.key, value, size, count)
        for found in confounded_keys(index, rules["held_out"])
        for value, of_value in found.counts.items()
        for size, count in sorted(of_value.items())
    ]
    return Judgement(
        with_nan(predictions),
        {table: with_nan(content) for table, content in tables.items()},
        with_nan(detections),
        pd.DataFrame(confounded, columns=["key", "value", "size_mm", "recordings"]),
    )


class Folds(list[_Part]):
    """The folds of an archive: rows of ``archive.X`` that teach, and rows that are judged.

    A recording that no detector can judge does not teach. Each recording is judged once, except
    that those of held-out sessions are judged under ``held_out`` alone.
    """

    def split(self, X: object = None, y: object = None, groups: object = None) -> Iterator[_Part]:
        """Yield the folds, as scikit-learn asks for them."""
        return iter(self)

    def get_n_splits(self, X: object = None, y: object = None, groups: object = None) -> int:
        """Return the number of folds."""
        return len(self)


def folds(archive: LoadedArchive, scheme: str = LEAVE_ONE_OUT) -> Folds:
    """Return the workflow's folds of an archive, for the argument ``cv=`` of scikit-learn.

    Parameters
    ----------
    archive : LoadedArchive
        The archive, whose labelled recordings are split.
    scheme : str
        ``leave_one_out``: all others teach when the recordings of a place are judged: those of a
        site, and near copies; with more places than `evaluation.most_folds`, several are left out
        together. ``leave_one_session_out``, ``leave_one_setup_out``: the other sessions or set-ups
        teach. ``held_out``: the recordings of `evaluation.held_out` are judged by all others.
        ``resubstitution``: all recordings teach and are judged.

    Returns
    -------
    Folds
        A list that is also a splitter; its indices are rows of ``archive.X``.

    Raises
    ------
    CapsuleError
        If there is no such scheme, or the archive does not allow it.
    """
    require_archive(archive)
    row = {name: number for number, name in enumerate(archive.labelled)}
    parts = (
        (archive.teaching_rows(fold.left_out), np.array(sorted(row[name] for name in fold.judged)))
        for fold in _folds_of_scheme(archive, scheme)
    )
    return Folds(sorted(parts, key=lambda part: part[1][0]))


def _folds_of_scheme(archive: LoadedArchive, scheme: str) -> list[Fold]:
    rules = archive.settings["evaluation"] | {"schemes": [LEAVE_ONE_OUT, RESUBSTITUTION]}
    known = folds_of(archive.index(archive.labelled), rules)
    of_scheme = [fold for fold in known if fold.scheme == scheme]
    if not of_scheme:
        why = f"it has: {', '.join(dict.fromkeys(fold.scheme for fold in known))}"
        if scheme in map(group_scheme, rules["groups"]):
            why = (
                f"its headers name fewer than {LEAST_GROUPS} of a kind, or one leaves too few to "
                "teach"
            )
        raise CapsuleError(f"folds: this archive has no scheme {scheme!r}; {why}")
    return of_scheme
