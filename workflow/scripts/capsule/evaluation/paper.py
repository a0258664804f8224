"""The rates printed in the paper, as tables like ours, with the counts that follow from them."""

from capsule.evaluation.intervals import ONE_SIDED, rate
from capsule.evaluation.rates import interval_columns
from capsule.kinds import Cells, Row, Settings

NAME = "paper"


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
