"""Make the cells of the report's tables; a cell has a text and the value behind it."""

from collections.abc import Callable, Mapping, Sequence

import pandas as pd

from capsule import words
from capsule.kinds import Cells, Row


def plain_cell(
    value: float | None, text: str, interval: str = "", count: str = "", scheme: str = ""
) -> Cells:
    """Return a cell; without a scheme, it belongs to none."""
    return {"value": value, "text": text, "interval": interval, "count": count, "scheme": scheme}


def percent(rate: float) -> str:
    """Return a rate in percent, without the sign."""
    return words.percent(rate).removesuffix(" %")


def cell_of(
    row: Row,
    name: str,
    form: Callable[[float], str] = percent,
    unit: str = " %",
    count: str = "",
    scheme: str = "",
) -> Cells:
    """Return the cell of a column of a table, with its interval if the table has one.

    `form` writes a number. The unit, which begins with a space, stands once in an interval.
    """
    value, low = row[name], row.get(f"{name}_low")
    if not words.is_known(value):
        return plain_cell(None, words.UNKNOWN, "", count, scheme)
    interval = ""
    if words.is_known(low):
        interval = f"{form(low)} to {form(row[f'{name}_high'])}{unit}"
    return plain_cell(float(value), f"{form(value)}{unit}", interval, count, scheme)


def rate_table(
    rates: pd.DataFrame, measures: Mapping[str, str], sizes_mm: Sequence[float]
) -> Cells:
    """Return a table of rates: one row per size, one column per measure and scheme.

    The rate of a size without a point is not known.
    """
    schemes = list(dict.fromkeys(rates["scheme"]))
    one_sided = set(rates.loc[rates["one_sided"], "size_mm"])
    unknown = {
        name: plain_cell(None, words.NOT_GIVEN if name == "paper" else words.UNKNOWN, scheme=name)
        for name in schemes
    }
    known = rates.dropna(subset="rate").rename(columns={"low": "rate_low", "high": "rate_high"})
    cells = {
        (row["measure"], row["scheme"], row["size_mm"]): cell_of(
            row, "rate", count=words.count_of(row["hits"], row["of"]), scheme=row["scheme"]
        )
        for row in known.to_dict("records")
    }
    rows = [
        {
            "size_mm": size_mm,
            "size": words.size(size_mm),
            "one_sided": size_mm in one_sided,
            "cells": [
                cells.get((measure, name, size_mm), unknown[name])
                for measure in measures
                for name in schemes
            ],
        }
        for size_mm in sizes_mm
    ]
    heads = [f"{title}, {words.scheme(name)}" for title in measures.values() for name in schemes]
    return {"heads": heads, "rows": rows}


def retest_rows(retest: pd.DataFrame) -> Cells:
    """Return how often a nodule is reported, by the number of passes that are judged together."""
    sizes_mm, empty = sorted(retest["size_mm"].unique()), plain_cell(None, words.UNKNOWN)
    rows = []
    for (detector, passes), group in retest.groupby(["detector", "passes"], sort=False):
        of_size = {
            row["size_mm"]: cell_of(row, "detected", count=words.plural(int(row["sites"]), "place"))
            for row in group.to_dict("records")
        }
        cells = [of_size.get(size_mm, empty) for size_mm in sizes_mm]
        rows.append({"detector": detector, "passes": int(passes), "cells": cells})
    return {"sizes": [words.size(size_mm) for size_mm in sizes_mm], "rows": rows}
