"""Judge detectors, and any estimator of scikit-learn, with the folds of the workflow."""

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from capsule.detectors.registry import DETECTORS
from capsule.errors import CapsuleError
from capsule.evaluation.confounded import confounded_keys
from capsule.evaluation.cross_validation import LEAVE_ONE_OUT, Detectors, judge_unlabelled
from capsule.evaluation.whole_evaluation import KEY, by_name, evaluate_archive, rated
from capsule.held_out import teaching
from capsule.interface.frames import frame
from capsule.interface.loaded_archive import LoadedArchive
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
    if estimator is None:
        return _judge_configured(archive)
    from capsule.interface.any_estimator import estimator_rows, unlabelled_rows

    called = name or type(estimator).__name__
    if called in DETECTORS:
        raise CapsuleError(f"judge: {called!r} is a configured detector; give another name")
    rules = archive.settings["evaluation"] | {"schemes": [scheme], "passes": []}
    rows = list(estimator_rows(archive, estimator, called, scheme))
    predictions = by_name(pd.DataFrame(rows, columns=None if rows else KEY))
    sizes_mm = sorted({0.0, *archive.y.tolist()})
    tables = rated(predictions, sizes_mm, archive.index(archive.labelled), rules)
    verdicts = list(unlabelled_rows(archive, estimator, called))
    seen = ["recording", "detector"]
    detections = pd.DataFrame(verdicts, columns=None if verdicts else seen)
    return _judgement(archive, predictions, tables, detections)


def _judge_configured(archive: LoadedArchive) -> Judgement:
    if not archive.particles():
        raise CapsuleError(
            "judge: no recording of a nodule can be used, so no template can be made; look for the "
            "reasons in archive.recordings"
        )
    training = archive.training_archive()
    tables = evaluate_archive(training, archive.index(archive.labelled))
    predictions = tables.pop("predictions")
    detectors = Detectors(training)
    unlabelled = sorted(archive.unlabelled, key=sort_key)
    rows = archive.index([*archive.labelled, *unlabelled])
    apart = sorted(rows.keys() - teaching(rows, archive.settings["evaluation"]["held_out"]).keys())
    verdicts = judge_unlabelled(detectors, unlabelled, rows, apart)
    columns = ["recording", "detector", *detectors.columns]
    return _judgement(archive, predictions, tables, pd.DataFrame(verdicts, columns=columns))


def _judgement(
    archive: LoadedArchive,
    predictions: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame],
    detections: pd.DataFrame,
) -> Judgement:
    predictions, detections, *made = (
        frame(list(table), table.to_dict("records"))
        for table in (predictions, detections, *tables.values())
    )
    held_out = archive.settings["evaluation"]["held_out"]
    counted = [
        {"key": found.key, "value": value, "size_mm": size, "recordings": count}
        for found in confounded_keys(archive.index(archive.labelled), held_out)
        for value, of_value in found.counts.items()
        for size, count in sorted(of_value.items())
    ]
    confounded = pd.DataFrame(counted, columns=["key", "value", "size_mm", "recordings"])
    return Judgement(predictions, dict(zip(tables, made, strict=True)), detections, confounded)
