"""Judge detectors, and any estimator of scikit-learn, with the folds of the workflow."""

from dataclasses import dataclass

import pandas as pd

from capsule.detectors.registry import DETECTORS
from capsule.errors import CapsuleError
from capsule.evaluation.confounded import confounded_keys
from capsule.evaluation.cross_validation import (
    LEAVE_ONE_OUT,
    Detectors,
    cross_validate,
    judge_unlabelled,
)
from capsule.evaluation.whole_evaluation import KEY, by_name, evaluate_archive, rated
from capsule.held_out import teaching
from capsule.interface.loaded_archive import LoadedArchive, frame, require_archive
from capsule.interface.splits import folds_of_scheme
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
        from capsule.interface.any_estimator import EstimatorAsDetector

        called = name or type(estimator).__name__
        if called in DETECTORS:
            raise CapsuleError(f"judge: {called!r} is a configured detector; give another name")
        detectors = EstimatorAsDetector(archive, estimator, called)
        verdicts = cross_validate(detectors, folds_of_scheme(archive, scheme))
        predictions = by_name(pd.DataFrame(verdicts, columns=[*KEY, *detectors.columns]))
        sizes_mm = sorted({0.0, *archive.y.tolist()})
        tables = rated(predictions, sizes_mm, index, rules | {"schemes": [scheme], "passes": []})
    unlabelled = sorted(archive.unlabelled, key=sort_key)
    rows = archive.index([*archive.labelled, *unlabelled])
    apart = sorted(rows.keys() - teaching(rows, rules["held_out"]).keys())
    detections = pd.DataFrame(
        judge_unlabelled(detectors, unlabelled, rows, apart),
        columns=["recording", "detector", *detectors.columns],
    )
    confounded = [
        {"key": found.key, "value": value, "size_mm": size, "recordings": count}
        for found in confounded_keys(index, rules["held_out"])
        for value, of_value in found.counts.items()
        for size, count in sorted(of_value.items())
    ]
    return Judgement(
        _with_nan(predictions),
        {table: _with_nan(content) for table, content in tables.items()},
        _with_nan(detections),
        pd.DataFrame(confounded, columns=["key", "value", "size_mm", "recordings"]),
    )


def _with_nan(table: pd.DataFrame) -> pd.DataFrame:
    return frame(list(table), table.to_dict("records"))
