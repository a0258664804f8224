"""The tables of rates beside the numbers that the paper prints, also as points of figures."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import pandas as pd

from capsule.detectors.registry import PAPER
from capsule.evaluation.intervals import ONE_SIDED, rate
from capsule.evaluation.rates import COLUMNS, interval_columns
from capsule.kinds import Cells, Row, Settings

NAME = "paper"
TABLES = tuple(COLUMNS)
POINT_COLUMNS = [
    *("measure", "size_mm", "detector", "scheme"),
    *("hits", "of", "rate", "low", "high", "one_sided"),
]


@dataclass(frozen=True)
class Evaluation:
    """The tables under results/evaluation.

    Attributes
    ----------
    predictions : DataFrame
        One row for each recording, detector and scheme.
    tables : dict of str to DataFrame
        ``detection``, ``specificity``, ``sizing`` and ``confusion`` for every detector.
    paper : dict of str to DataFrame
        The paper's tables in the same columns.
    """

    predictions: pd.DataFrame
    tables: Mapping[str, pd.DataFrame]
    paper: Mapping[str, pd.DataFrame]

    def detectors(self) -> list[str]:
        """Return the names of the detectors, or only the paper's own if nothing was judged."""
        return self.predictions["detector"].unique().tolist() or [PAPER]

    def sizes_mm(self) -> list[float]:
        """Return the sizes that have a template, including 0, ascending."""
        return template_sizes_mm(self.predictions.columns)

    def of(self, name: str, detector: str, *, with_paper: bool = False) -> pd.DataFrame:
        """Return one detector's rows of a table, followed by the paper's rows if wanted."""
        table = self.tables[name]
        rows = table[table["detector"] == detector]
        return pd.concat([rows, self.paper[name]], ignore_index=True) if with_paper else rows


def template_sizes_mm(columns: Iterable[str]) -> list[float]:
    """Return the sizes that have a template, including 0, ascending.

    Parameters
    ----------
    columns : iterable of str
        Those of results/evaluation/predictions.csv, which has a column for each template.
    """
    return sorted(
        float(name.removeprefix("rmse_").removesuffix("mm"))
        for name in columns
        if name.startswith("rmse_") and name.endswith("mm")
    )


def printed_tables(printed: Settings, confidence: float) -> dict[str, list[Cells]]:
    """Return the printed rates in the columns of our tables, detector and scheme ``paper``.

    The paper prints percentages. The counts follow from the number of recordings of each size: TP
    from the recall, FP from the precision. Recordings without a nodule that are no FP of any size
    are true negatives. They give the specificity, which the paper does not print.

    Parameters
    ----------
    printed : mapping
        Content of ``paper.yaml``.
    confidence : float
        Level of the Wilson intervals, such as 0.95.

    Returns
    -------
    dict of str to list of dict
        ``detection``, ``specificity``, ``sizing`` and ``confusion``. Rates are fractions. Each
        recording counts as a cluster, because the paper names no set-ups. Of
        ``confusion``, only the rows for recordings without a nodule are known.
    """
    count = printed["recordings_per_size"]
    key: Cells = {"detector": NAME, "scheme": NAME}
    detection = [key | _detection_row(row, count, confidence) for row in printed["detection"]]
    sizing = [key | _sizing_row(row, count, confidence) for row in printed["sizing"]]
    negatives = count - sum(row["fp"] for row in detection)
    specificity = key | {"healthy": count, "true_negatives": negatives}
    specificity |= _bounded("specificity", negatives, count, confidence)
    taken_for = {0.0: negatives} | {row["size_mm"]: row["fp"] for row in detection}
    confusion = [
        key
        | {"size_mm": 0.0, "predicted_mm": size_mm, "count": hits}
        | interval_columns("share", rate(hits, count, confidence))
        for size_mm, hits in taken_for.items()
    ]
    return {
        "detection": detection,
        "specificity": [specificity],
        "sizing": sizing,
        "confusion": confusion,
    }


def _detection_row(row: Row, count: int, confidence: float) -> Cells:
    true_positives = round(row["recall_percent"] / 100 * count)
    positives = round(true_positives / (row["precision_percent"] / 100))
    counts = {
        "size_mm": float(row["size_mm"]),
        "tp": true_positives,
        "fp": positives - true_positives,
        "fn": count - true_positives,
    }
    precision = _bounded("precision", true_positives, positives, confidence)
    return counts | precision | _bounded("recall", true_positives, count, confidence)


def _sizing_row(row: Row, count: int, confidence: float) -> Cells:
    exact, within = (round(row[f"{name}_percent"] / 100 * count) for name in ("exact", "within"))
    return {
        "size_mm": float(row["size_mm"]),
        "recordings": count,
        "exact": exact,
        **interval_columns("exact_rate", rate(exact, count, confidence)),
        "within": within,
        **interval_columns("within_rate", rate(within, count, confidence)),
        "one_sided": row["one_sided"],
        "mean_absolute_error_mm": float("nan"),
        "clusters": count,
    }


def _bounded(name: str, hits: int, count: int, confidence: float) -> Cells:
    """Return the columns of a rate with its interval and its one-sided bound, and ``clusters``."""
    bound = {f"{name}_at_least": rate(hits, count, 2 * ONE_SIDED - 1)[1]}
    return interval_columns(name, rate(hits, count, confidence)) | bound | {"clusters": count}


def detection_points(detection: pd.DataFrame) -> pd.DataFrame:
    """Return precision and recall per size from the table of detection, ours and the paper's."""
    detection = detection.assign(
        positives=detection["tp"] + detection["fp"], of_size=detection["tp"] + detection["fn"]
    )
    frames = [
        _points(detection, "precision", "tp", "positives"),
        _points(detection, "recall", "tp", "of_size"),
    ]
    return pd.concat(frames, ignore_index=True)


def sizing_points(sizing: pd.DataFrame) -> pd.DataFrame:
    """Return the exact and the within-tolerance rate per size from the table of sizing."""
    within = _points(sizing, "within_rate", "within", "recordings")
    within["one_sided"] = sizing["one_sided"].astype(bool).to_numpy()
    return pd.concat(
        [_points(sizing, "exact_rate", "exact", "recordings"), within], ignore_index=True
    )


def negative_points(confusion: pd.DataFrame) -> pd.DataFrame:
    """Return how the recordings without a nodule were classified.

    Parameters
    ----------
    confusion : DataFrame
        Counts and shares for each detector, scheme, true size and predicted size.

    Returns
    -------
    DataFrame
        ``size_mm`` is the predicted size; NaN for no verdict. A detector and scheme without such
        recordings have no row.
    """
    healthy = confusion[confusion["size_mm"] == 0]
    healthy = healthy.assign(
        of=healthy.groupby(["detector", "scheme"], sort=False)["count"].transform("sum"),
        size_mm=healthy["predicted_mm"],
    )
    points = _points(healthy[healthy["of"] > 0], "share", "count", "of")
    return points.assign(measure="classified").reset_index(drop=True)


def _points(table: pd.DataFrame, measure: str, hits: str, of: str) -> pd.DataFrame:
    points = table[["size_mm", "detector", "scheme"]].assign(
        measure=measure,
        hits=table[hits],
        of=table[of],
        rate=table[measure],
        low=table[f"{measure}_low"],
        high=table[f"{measure}_high"],
        one_sided=False,
    )
    return points[POINT_COLUMNS]
