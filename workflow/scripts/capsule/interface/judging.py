"""Judge detectors, and any estimator of scikit-learn, with the folds of the workflow."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from capsule.detectors.registry import DETECTORS
from capsule.errors import CapsuleError
from capsule.evaluation.folds import LEAVE_ONE_OUT
from capsule.evaluation.predictions import Detectors, of_unlabelled
from capsule.evaluation.rows import by_detector
from capsule.evaluation.whole_evaluation import (
    Table,
    evaluate_archive,
    prediction_columns,
    rate_detectors,
    rate_tables,
)
from capsule.interface.frames import frame
from capsule.interface.loaded_archive import LoadedArchive
from capsule.kinds import Row, Settings
from capsule.naming import sort_key


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
        ``detection``, ``specificity``, ``sizing``, ``confusion``, ``summary``, ``auc``, ...: the
        tables of ``results/evaluation/``.
    detections : DataFrame
        Verdicts on the unlabelled recordings, as ``results/detections.csv``.
    """

    predictions: pd.DataFrame
    tables: dict[str, pd.DataFrame]
    detections: pd.DataFrame

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
    if estimator is None:
        return _judge_configured(archive)
    from capsule.interface.any_estimator import estimator_rows, unlabelled_rows

    called = name or type(estimator).__name__
    if called in DETECTORS:
        raise CapsuleError(f"judge: {called!r} is a configured detector; give another name")
    rules = archive.settings["evaluation"] | {"schemes": [scheme], "passes": []}
    rows = by_detector(estimator_rows(archive, estimator, called, scheme), sort_key)
    verdicts = list(unlabelled_rows(archive, estimator, called))
    sizes_mm = sorted({0.0, *archive.y.tolist()})
    tables = rate_tables(rows, sizes_mm, rules)
    tables |= _rated(archive, [rows], rules)
    seen = ["recording", "detector"]
    return _judgement(
        Table(list(rows[0]) if rows else prediction_columns([]), rows),
        tables,
        Table(list(verdicts[0]) if verdicts else seen, verdicts),
    )


def _judge_configured(archive: LoadedArchive) -> Judgement:
    if not archive.particles():
        raise CapsuleError(
            "judge: no recording of a nodule can be used, so no template can be made; look for the "
            "reasons in archive.recordings"
        )
    training = archive.training_archive()
    tables = evaluate_archive(training, archive.index(archive.labelled))
    predictions = tables.pop("predictions")
    rows = [predictions.rows, tables["group_predictions"].rows]
    tables |= _rated(archive, rows, archive.settings["evaluation"])
    detectors = Detectors(training)
    unlabelled = sorted(archive.unlabelled, key=sort_key)
    alike = {name: others for name in unlabelled if (others := archive.labelled_copies(name))}
    verdicts = of_unlabelled(detectors, unlabelled, alike)
    return _judgement(
        predictions, tables, Table(["recording", "detector", *detectors.columns], verdicts)
    )


def _rated(
    archive: LoadedArchive, predictions: list[Sequence[Row]], rules: Settings
) -> dict[str, Table]:
    """Return the tables that rate the detectors, made from their predictions."""
    index = archive.index([*archive.labelled, *archive.unlabelled])
    return rate_detectors(predictions, index, rules)


def _judgement(predictions: Table, tables: Mapping[str, Table], detections: Table) -> Judgement:
    made = {name: frame(*table) for name, table in tables.items()}
    return Judgement(frame(*predictions), made, frame(*detections))
