"""Make the cells of the report's tables; a cell has a text and the value behind it."""

from collections.abc import Mapping, Sequence

import pandas as pd

from capsule import words
from capsule.kinds import Cells, Row


def rate_table(
    rates: pd.DataFrame, measures: Mapping[str, str], sizes_mm: Sequence[float]
) -> Cells:
    """Return a table of rates: one row per size, one group of columns per measure.

    A group has one column per scheme. The rate of a size without a point is not known.
    """
    schemes = list(dict.fromkeys(rates["scheme"]))
    titles = [words.scheme(name) for name in schemes]
    points = {
        (point["measure"], point["scheme"], point["size_mm"]): point
        for point in rates.to_dict("records")
    }
    one_sided = set(rates.loc[rates["one_sided"], "size_mm"])
    rows = [
        {
            "size_mm": size_mm,
            "size": words.size(size_mm),
            "one_sided": size_mm in one_sided,
            "cells": [
                rate_cell(points.get((measure, name, size_mm)), name)
                for measure in measures
                for name in schemes
            ],
        }
        for size_mm in sizes_mm
    ]
    return {
        "groups": [{"title": title, "schemes": titles} for title in measures.values()],
        "rows": rows,
    }


def rate_cell(point: Row | None, scheme: str) -> Cells:
    """Return the cell of one rate, with its interval and its counts."""
    if point is None or not words.is_known(point["rate"]):
        text = words.NOT_GIVEN if scheme == "paper" else words.UNKNOWN
        return plain_cell(None, text, scheme=scheme)
    rate, bounds = float(point["rate"]), words.interval(point["low"], point["high"])
    count = words.count_of(point["hits"], point["of"])
    return plain_cell(rate, words.percent(rate), bounds, count, scheme)


def plain_cell(
    value: float | None, text: str, interval: str = "", count: str = "", scheme: str = ""
) -> Cells:
    """Return a cell; without a scheme, it belongs to none."""
    return {"value": value, "text": text, "interval": interval, "count": count, "scheme": scheme}


def rate_cell_of(row: Row, name: str, count: str = "") -> Cells:
    """Return the cell of a rate and its interval from a row of a table."""
    value, low, high = row[name], row[f"{name}_low"], row[f"{name}_high"]
    if not words.is_known(value):
        return plain_cell(None, words.UNKNOWN, count=count)
    bounds = words.interval(low, high) if words.is_known(low) else ""
    return plain_cell(float(value), words.percent(value), bounds, count)


def retest_rows(retest: pd.DataFrame) -> Cells:
    """Return how often a nodule is reported, by the number of passes that are judged together."""
    if retest.empty:
        return {"sizes": [], "rows": []}
    sizes_mm, empty = sorted(retest["size_mm"].unique()), plain_cell(None, words.UNKNOWN)
    rows = []
    for (detector, passes), group in retest.groupby(["detector", "passes"], sort=False):
        of_size = {
            row["size_mm"]: rate_cell_of(row, "detected", words.plural(int(row["sites"]), "place"))
            for row in group.to_dict("records")
        }
        cells = [of_size.get(size_mm, empty) for size_mm in sizes_mm]
        rows.append({"detector": detector, "passes": int(passes), "cells": cells})
    return {"sizes": [words.size(size_mm) for size_mm in sizes_mm], "rows": rows}
