"""The tables of rates beside the numbers that the paper prints, also as points of figures."""

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from capsule.detectors.registry import PAPER
from capsule.evaluation.columns import RATES, distance_columns
from capsule.evaluation.intervals import rate
from capsule.evaluation.measures import measure_tables
from capsule.evaluation.rates import with_ends
from capsule.kinds import Cells, Settings

NAME = "paper"


@dataclass(frozen=True)
class Evaluation:
    """The tables under results/evaluation.

    Attributes
    ----------
    predictions : DataFrame
        One row for each recording, detector and scheme.
    tables : dict of str to DataFrame
        Those of `capsule.evaluation.columns.COLUMNS`, for every detector.
    paper : dict of str to DataFrame
        The paper's tables of `capsule.evaluation.columns.RATES`, in the same columns.
    """

    predictions: pd.DataFrame
    tables: Mapping[str, pd.DataFrame]
    paper: Mapping[str, pd.DataFrame]

    def detectors(self) -> list[str]:
        """Return the names of the detectors, or only the paper's own if nothing was judged."""
        return self.predictions["detector"].unique().tolist() or [PAPER]

    def sizes_mm(self) -> list[float]:
        """Return the sizes that have a template, including 0, ascending; each has a column."""
        return sorted(distance_columns(self.predictions.columns).values())

    def of(self, name: str, detector: str) -> pd.DataFrame:
        """Return one detector's rows of a table."""
        table = self.tables[name]
        return table[table["detector"] == detector]


def printed_tables(printed: Settings, confidence: float) -> dict[str, pd.DataFrame]:
    """Return the printed rates in the columns of our tables, detector and scheme ``paper``.

    The paper prints percentages. The counts follow from the number of recordings of each size: TP
    from the recall, FP from the precision. Recordings without a nodule that are no FP of any size
    are true negatives. They give the recall of 0 mm, the specificity, which the paper does not
    print. Our own tables of as many verdicts give the intervals.

    Each recording counts as a cluster, because the paper names no set-ups. Of ``confusion``, only
    the rows for recordings without a nodule are known, and of ``sizing`` not the errors.

    Parameters
    ----------
    printed : mapping
        Content of ``paper.yaml``.
    confidence : float
        Level of the Wilson intervals, such as 0.95.
    """
    count, verdicts = printed["recordings_per_size"], []
    for row in printed["detection"]:
        hits, size_mm = round(row["recall_percent"] / 100 * count), float(row["size_mm"])
        alarms = round(hits / (row["precision_percent"] / 100)) - hits
        verdicts += [(size_mm, size_mm)] * hits + [(size_mm, 0.0)] * (count - hits)
        verdicts += [(0.0, size_mm)] * alarms
    quiet = count - sum(true_mm == 0 for true_mm, _ in verdicts)
    verdicts += [(0.0, 0.0)] * quiet
    predictions = pd.DataFrame(verdicts, columns=["size_mm", "predicted_mm"])
    predictions = predictions.assign(detector=NAME, scheme=NAME)
    sizes_mm = [0.0, *(float(row["size_mm"]) for row in printed["detection"])]
    rules = {"tolerance_mm": printed["sizing_tolerance_mm"], "confidence": confidence}
    made = measure_tables(predictions, sizes_mm, rules, names=["detection", "confusion"])
    sizing = pd.DataFrame(
        _printed_sizing(row, count, confidence) for row in printed["sizing"]
    ).reindex(columns=RATES["sizing"])
    confusion = made["confusion"].query("size_mm == 0")
    return {"detection": made["detection"], "sizing": sizing, "confusion": confusion}


def _printed_sizing(printed: Settings, count: int, confidence: float) -> Cells:
    """Return a row of the table of sizing, of what the paper prints of a size."""
    row: Cells = {"detector": NAME, "scheme": NAME, "size_mm": float(printed["size_mm"])}
    row |= {"recordings": count, "clusters": count, "one_sided": printed["one_sided"]}
    for name in ("exact", "within"):
        row[name] = round(printed[f"{name}_percent"] / 100 * count)
        row |= with_ends(**{f"{name}_rate": rate(row[name], count, confidence)})
    return row


def detection_points(detection: pd.DataFrame) -> pd.DataFrame:
    """Return precision and recall of nodules by size from the table, ours and the paper's."""
    nodules = detection[detection["size_mm"] > 0]
    counted = nodules.assign(
        positives=nodules["tp"] + nodules["fp"], of_size=nodules["tp"] + nodules["fn"]
    )
    return _points(counted, precision=("tp", "positives"), recall=("tp", "of_size"))


def sizing_points(sizing: pd.DataFrame) -> pd.DataFrame:
    """Return the exact and the within-tolerance rate per size from the table of sizing."""
    sizing = sizing[sizing["size_mm"] > 0]
    counts = {f"{name}_rate": (name, "recordings") for name in ("exact", "within")}
    one_sided = [*[False] * len(sizing), *sizing["one_sided"].astype(bool)]
    return _points(sizing, **counts).assign(one_sided=one_sided)


def negative_points(confusion: pd.DataFrame) -> pd.DataFrame:
    """Return how the recordings without a nodule were classified, from the table of confusion.

    ``size_mm`` is the predicted size; NaN for no verdict. A detector and scheme without such
    recordings have no row.
    """
    healthy = confusion[confusion["size_mm"] == 0]
    healthy = healthy.assign(
        of=healthy.groupby(["detector", "scheme"], sort=False)["count"].transform("sum"),
        size_mm=healthy["predicted_mm"],
    )
    points = _points(healthy[healthy["of"] > 0], share=("count", "of"))
    return points.assign(measure="classified")


def _points(table: pd.DataFrame, **measures: tuple[str, str]) -> pd.DataFrame:
    """Return rates of each row, with the ends of their intervals; hits and count are columns."""
    points = [
        table[["size_mm", "detector", "scheme", hits, of, rate, f"{rate}_low", f"{rate}_high"]]
        .set_axis(["size_mm", "detector", "scheme", "hits", "of", "rate", "low", "high"], axis=1)
        .assign(measure=rate)
        for rate, (hits, of) in measures.items()
    ]
    joined = pd.concat(points, ignore_index=True).assign(one_sided=False)
    return joined[["measure", *joined.columns.drop("measure")]]
