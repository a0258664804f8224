"""Make the tables of places with several passes: their verdicts, and the gain of more passes."""

import pandas as pd

from capsule import words
from capsule.kinds import Cells, Row
from capsule.page.cells import plain_cell, rate_cell_of


def place_rows(sites: pd.DataFrame, largest_mm: float) -> Cells:
    """Return the verdicts on places: one row per place, one column per detector.

    Parameters
    ----------
    sites : DataFrame
        results/sites.csv.
    largest_mm : float
        The largest size that the archive holds.

    Returns
    -------
    dict
        ``detectors`` and ``rows`` with ``site``, ``size``, ``recordings`` and ``verdicts``.
    """
    detectors = list(dict.fromkeys(sites["detector"]))
    rows = []
    for (site, size_mm), group in sites.groupby(["site", "size_mm"], sort=False, dropna=False):
        verdicts = {row["detector"]: _verdict(row, largest_mm) for row in group.to_dict("records")}
        rows.append(
            {
                "site": str(site),
                "size": words.size(size_mm) if words.is_known(size_mm) else "unlabelled",
                "recordings": int(group["recordings"].iloc[0]),
                "verdicts": [verdicts.get(name, "no verdict") for name in detectors],
            }
        )
    return {"detectors": detectors, "rows": rows}


def _verdict(row: Row, largest_mm: float) -> str:
    if not words.is_known(row["detected"]):
        return words.verdict({**row, "predicted_mm": None})
    if str(row["detected"]) != "True":
        return "no nodule"
    sized = words.is_known(row["estimate_mm"])
    what = f"nodule of {words.estimated_size(row, largest_mm)}" if sized else "nodule"
    where = row["location_mm"]
    return f"{what}, at {words.number(where, 1)} mm" if words.is_known(where) else what


def retest_rows(retest: pd.DataFrame) -> Cells:
    """Return how often a nodule is reported, by the number of passes that are judged together.

    Returns
    -------
    dict
        ``sizes`` (headings) and ``rows`` with ``detector``, ``passes`` and one cell per size.
    """
    if retest.empty:
        return {"sizes": [], "rows": []}
    sizes_mm = sorted(retest["size_mm"].unique())
    rows = []
    for (detector, passes), group in retest.groupby(["detector", "passes"], sort=False):
        of_size = {row["size_mm"]: _retest_cell(row) for row in group.to_dict("records")}
        empty = plain_cell(None, words.UNKNOWN)
        cells = [of_size.get(size_mm, empty) for size_mm in sizes_mm]
        rows.append({"detector": detector, "passes": int(passes), "cells": cells})
    return {"sizes": [words.size(size_mm) for size_mm in sizes_mm], "rows": rows}


def _retest_cell(row: Row) -> Cells:
    return rate_cell_of(row, "detected") | {"count": words.plural(int(row["sites"]), "place")}
