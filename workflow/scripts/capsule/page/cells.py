"""Make the cells of the report's tables; a cell has a text and the value behind it."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import pandas as pd

from capsule import words
from capsule.evaluation import paper
from capsule.kinds import Cells, Row, Settings


class Rate(Protocol):
    """A row of the table of rates, as pandas gives it."""

    rate: float
    low: float
    high: float
    hits: int
    of: int


def rate_table(
    rates: pd.DataFrame, measures: Mapping[str, str], sizes_mm: Sequence[float]
) -> Cells:
    """Return a table of rates: one row per size, one group of columns per measure.

    A group has one column per scheme.

    Parameters
    ----------
    rates : DataFrame
        From `capsule.evaluation.paper`.
    measures : mapping of str to str
        Heading of each measure.
    sizes_mm : sequence of float
        The rows; the rate of a size without a point is not known.

    Returns
    -------
    dict
        ``groups`` (headings with their schemes) and ``rows`` (``size_mm`` and ``cells``). A cell
        has ``value``, ``text``, ``interval`` and ``count``.
    """
    schemes = list(dict.fromkeys(rates["scheme"]))
    groups = [
        {"title": title, "schemes": [words.scheme(name) for name in schemes]}
        for title in measures.values()
    ]
    by_key = {
        (point.measure, point.scheme, point.size_mm): point
        for point in rates.itertuples(index=False)
    }
    one_sided = set(rates.loc[rates["one_sided"], "size_mm"])
    rows = [
        {
            "size_mm": size_mm,
            "size": words.size(size_mm),
            "one_sided": size_mm in one_sided,
            "cells": [
                rate_cell(by_key.get((measure, name, size_mm)), name)
                for measure in measures
                for name in schemes
            ],
        }
        for size_mm in sizes_mm
    ]
    return {"groups": groups, "rows": rows}


def rate_cell(point: Rate | None, scheme: str = "") -> Cells:
    """Return the cell of one rate, with its interval and its counts."""
    if point is None or not words.is_known(point.rate):
        text = words.NOT_GIVEN if scheme == "paper" else words.UNKNOWN
        return {"value": None, "text": text, "interval": "", "count": "", "scheme": scheme}
    return {
        "value": float(point.rate),
        "text": words.percent(point.rate),
        "interval": words.interval(point.low, point.high),
        "count": words.count_of(point.hits, point.of),
        "scheme": scheme,
    }


def plain_cell(value: float | None, text: str, interval: str = "", count: str = "") -> Cells:
    """Return a cell that belongs to no scheme."""
    return {"value": value, "text": text, "interval": interval, "count": count, "scheme": ""}


def rate_cell_of(row: Row, name: str) -> Cells:
    """Return the cell of a rate and its interval from a row of a table."""
    value, low, high = row[name], row[f"{name}_low"], row[f"{name}_high"]
    if not words.is_known(value):
        return plain_cell(None, words.UNKNOWN)
    bounds = words.interval(low, high) if words.is_known(low) else ""
    return plain_cell(float(value), words.percent(value), bounds)


def confusion_rows(confusion: pd.DataFrame, scheme: str, sizes_mm: Sequence[float]) -> list[Cells]:
    """Return the counts of one scheme: one row per true size, one cell per predicted size.

    A further cell counts the recordings without a verdict, if there are any. A cell has its
    ``count``, its ``share`` of the row in tenths (for its shade), and whether it is ``right``.
    """
    chosen = confusion[confusion["scheme"] == scheme]
    of_none = chosen[chosen["predicted_mm"].isna()].set_index("size_mm")["count"]
    counts = {(r.size_mm, r.predicted_mm): int(r.count) for r in chosen.itertuples(index=False)}
    rows = []
    for actual in sizes_mm:
        row = [counts.get((actual, predicted), 0) for predicted in sizes_mm]
        row += [int(of_none.get(actual, 0))] if of_none.any() else []
        total = sum(row)
        cells = [
            {
                "count": count,
                "share": round(10 * count / total) if total else 0,
                "right": actual == predicted,
            }
            for predicted, count in zip([*sizes_mm, None], row, strict=False)
        ]
        rows.append({"size": words.size(actual), "cells": cells, "total": total})
    return rows


def template_rows(entries: Sequence[Row]) -> list[Cells]:
    """Return the averaged parameters of every template: one row per size, with all sensors."""
    rows = []
    for entry in entries:
        parameters = entry["parameters"]
        if entry["size_mm"] == 0 or parameters is None:
            continue
        spacing = [None, *parameters["peak_spacing"]]
        columns = (
            parameters["amplitude"],
            parameters["vertical_spread"],
            spacing,
            parameters["horizontal_spread"],
        )
        sensors = [
            {
                "sensor": sensor,
                "amplitude": words.number(values[0], 3),
                "vertical_spread": words.number(values[1], 3),
                "peak_spacing": "first" if values[2] is None else words.number(values[2], 1),
                "horizontal_spread": words.number(values[3], 1),
            }
            for sensor, values in enumerate(zip(*columns, strict=True), start=1)
        ]
        rows.append(
            {
                "size": words.size(entry["size_mm"]),
                "recordings": entry["recordings"],
                "sensors": sensors,
            }
        )
    return rows


def detection_rows(detections: pd.DataFrame, largest_mm: float) -> Cells:
    """Return the verdicts on unlabelled recordings, with the distance to every template.

    Parameters
    ----------
    detections : DataFrame
        results/detections.csv.
    largest_mm : float
        The largest size that the archive holds.

    Returns
    -------
    dict
        ``sizes`` of the templates, and ``rows``, one per recording, with ``unlike`` (why it is not
        of the kind that teaches), ``distances`` and ``verdicts`` of all detectors.
    """
    labels = [name for name in detections.columns if name.startswith("rmse_")]
    rows = []
    for name, of_recording in detections.groupby("recording", sort=False):
        first = of_recording.iloc[0]
        distances = [first[label] for label in labels]
        known = [value for value in distances if words.is_known(value)]
        nearest = min(known) if known else None
        rows.append(
            {
                "recording": name,
                "unlike": words.unlike(first),
                "verdicts": [
                    _verdict_words(row, largest_mm) for row in of_recording.to_dict("records")
                ],
                "distances": [
                    {
                        "value": float(value),
                        "text": words.number(value, 4),
                        "nearest": value == nearest,
                    }
                    for value in distances
                ],
            }
        )
    sizes = [words.size(float(label[5:].removesuffix("mm"))) for label in labels]
    return {"sizes": sizes, "rows": rows}


def _verdict_words(row: Row, largest_mm: float) -> Cells:
    """Return a detector's verdict in words; a missing value reads as not given."""
    return {
        "detector": row["detector"],
        "verdict": words.verdict(row),
        "estimate": words.estimated_size(row, largest_mm),
        "probability": words.probability(words.stated_probability(row)),
        "place": words.place(row["location_s"], row["location_mm"]),
    }


def rate_tables(
    detection: pd.DataFrame,
    sizing: pd.DataFrame,
    confusion: pd.DataFrame,
    sizes_mm: Sequence[float],
    settings: Settings,
) -> Cells:
    """Return the tables of rates by size and of the negatives, ours and the paper's.

    Parameters
    ----------
    detection, sizing, confusion : DataFrame
        The tables of one detector with all schemes, and the paper's rows below.
    sizes_mm : sequence of float
        The sizes that have a template; the first is 0, no nodule.
    settings : mapping
        Section ``evaluation`` of the configuration.

    Returns
    -------
    dict
        ``rates`` (of detection and sizing) and ``negatives``, from `rate_table`.
    """
    tolerance = settings["tolerance_mm"]
    measures = {"exact_rate": "Exact size", "within_rate": f"Within {tolerance:g} mm"}
    sized = rate_table(paper.sizing_points(sizing), measures, sizes_mm[1:])
    errors = {
        (row.scheme, row.size_mm): row.mean_absolute_error_mm
        for row in sizing.itertuples(index=False)
        if row.scheme != "paper"
    }
    schemes = list(dict.fromkeys(scheme for scheme, _ in errors))
    sized["groups"].append(
        {"title": "Mean absolute error", "schemes": [words.scheme(name) for name in schemes]}
    )
    for row in sized["rows"]:
        for name in schemes:
            row["cells"].append(_error_cell(errors.get((name, row["size_mm"])), name))
    measures = {"precision": "Precision", "recall": "Recall"}
    negatives = paper.negative_points(confusion)
    detected = rate_table(paper.detection_points(detection), measures, sizes_mm[1:])
    return {
        "rates": {
            "groups": detected["groups"] + sized["groups"],
            "rows": [
                row | {"cells": of_detection["cells"] + row["cells"]}
                for of_detection, row in zip(detected["rows"], sized["rows"], strict=True)
            ],
        },
        "negatives": rate_table(
            negatives, {"classified": "Share of the recordings without a nodule"}, sizes_mm
        ),
    }


def _error_cell(value: float | None, scheme: str) -> Cells:
    known = words.is_known(value)
    text = f"{words.number(value)} mm" if known else words.UNKNOWN
    value = float(value) if words.is_known(value) else None
    return {"value": value, "text": text, "interval": "", "count": "", "scheme": scheme}
