"""Compare the detectors: one table per scheme, one column per detector."""

from collections.abc import Mapping, Sequence

import pandas as pd

from capsule import words
from capsule.detectors.registry import DETECTORS, detector_row
from capsule.evaluation.cross_validation import RESUBSTITUTION
from capsule.evaluation.measures import ALWAYS
from capsule.kinds import Cells, Settings
from capsule.page.cells import plain_cell, rate_cell_of
from capsule.page.compared_rows import GROUPS, Row
from capsule.page.schemes import sets_specificity

NOT_APPLICABLE = plain_cell(None, words.NOT_APPLICABLE)
REFERENCE = plain_cell(None, "reference")
Judgements = Mapping[str, pd.DataFrame]


def page_values(
    judgements: Judgements, schemes: Sequence[str], settings: Settings, lead: str
) -> Cells:
    """Return the page's values that compare the detectors.

    Parameters
    ----------
    judgements : mapping of str to DataFrame
        The tables of `capsule.evaluation.measures`, by name.
    schemes : sequence of str
        The schemes of the page; the first is shown first.
    settings : mapping
        The configuration.
    lead : str
        The leading detector, whose column is the first.

    Returns
    -------
    dict
        ``compared``, ``calibration``, ``silent`` and ``prevalence``.
    """
    judged = settings["evaluation"]
    # By resubstitution a detector is better the more it remembers: it compares nothing.
    honest = [name for name in schemes if name != RESUBSTITUTION] or list(schemes)
    return {
        "compared": compared(judgements, honest, judged, lead),
        "calibration": calibration_rows(judgements["calibration"], schemes[0]),
        "silent": silent(judgements, schemes[0], settings["detectors"]),
        "prevalence": words.percent(judged["prevalence"]),
    }


def compared(
    judgements: Judgements, schemes: Sequence[str], settings: Settings, lead: str
) -> list[Cells]:
    """Return the comparison of the detectors, one table per scheme.

    Parameters
    ----------
    judgements : mapping of str to DataFrame
        The tables of `capsule.evaluation.measures`, by name.
    schemes : sequence of str
        The schemes to show, in this order; a scheme without a verdict is left out.
    settings : mapping
        Section ``evaluation`` of the configuration.
    lead : str
        The leading detector, whose column is the first.

    Returns
    -------
    list of dict
        For each scheme: ``scheme``, ``title``, ``recordings``, ``detectors``, and the rows in
        ``groups`` and in ``folded_groups``.
    """
    compared_schemes = []
    for scheme in schemes:
        tables = {
            name: table[table["scheme"] == scheme]
            for name, table in judgements.items()
            if "scheme" in table
        }
        judged = list(tables["summary"]["detector"])
        detectors = sorted(judged, key=lambda name: name != lead)
        if judged:
            reference = judged[0]
            count = int(tables["summary"]["recordings"].max())
            compared_schemes.append(
                {
                    "scheme": scheme,
                    "title": words.scheme(scheme),
                    "recordings": words.plural(count, "recording"),
                    "detectors": [{"name": name, "words": _sentence(name)} for name in detectors],
                    "groups": _groups(tables, detectors, reference, settings, folded=False),
                    "folded_groups": _groups(tables, detectors, reference, settings, folded=True),
                }
            )
    return compared_schemes


def _groups(
    tables: Judgements,
    detectors: Sequence[str],
    reference: str,
    settings: Settings,
    *,
    folded: bool,
) -> list[Cells]:
    """Return the filled rows of `compared_rows.GROUPS`; differences are from `reference`."""
    sizes_mm = sorted(tables["predictive_values"]["size_mm"].dropna().unique())
    sizes_of: dict[str, list[float | None]] = {
        "all": [None],
        "healthy": [0.0],
        "each": sizes_mm,
        "smallest": sizes_mm[:1],
    }
    filled_in = {
        "reference": reference,
        "tolerance": f"{settings['tolerance_mm']:g} mm",
        "prevalence": words.percent(settings["prevalence"]),
    }
    return [
        {
            "title": group.title.format(**filled_in),
            "rows": [
                {
                    "title": row.title.format(**filled_in, size=words.size(size_mm)),
                    "cells": _cells(
                        tables[row.table], row, size_mm, detectors, reference, settings
                    ),
                }
                for row in group.rows
                for size_mm in sizes_of[row.sizes]
            ],
        }
        for group in GROUPS
        if group.folded == folded
    ]


def _cells(
    table: pd.DataFrame,
    row: Row,
    size_mm: float | None,
    detectors: Sequence[str],
    reference: str,
    settings: Settings,
) -> list[Cells]:
    """Return a row's cells, one per detector."""
    by_detector = {}
    if row.measure:
        table = table[(table["first"] == reference) & (table["measure"] == row.measure)]
        table = table.rename(columns={"second": "detector"})
        by_detector[reference] = REFERENCE
    for values in _of_size(table, size_mm):
        cell = row.cell(values)
        if row.of_specificity and sets_specificity(values["detector"], values["scheme"]):
            # The threshold sets it: its interval and its differences say nothing.
            wanted = words.percent(settings["specificity"])
            cell = NOT_APPLICABLE if row.measure else plain_cell(None, f"set to {wanted}")
        # The baseline has no score and no size, so its cells without a value do not apply.
        if values["detector"] != ALWAYS or cell["value"] is not None:
            by_detector[values["detector"]] = cell
    return [by_detector.get(name, NOT_APPLICABLE) for name in detectors]


def _of_size(table: pd.DataFrame, size_mm: float | None) -> list[Cells]:
    if "size_mm" in table:
        size = pd.to_numeric(table["size_mm"])
        table = table[size.isna() if size_mm is None else size == size_mm]
    rows: list[Cells] = table.to_dict("records")
    return rows


def silent(judgements: Judgements, scheme: str, detectors: Sequence[str]) -> str:
    """Return a sentence on the detectors that judged no labelled recording, and why."""
    table = judgements["summary"]
    judged = set(table.loc[table["scheme"] == scheme, "detector"])
    names = [name for name in detectors if name not in judged]
    if not names:
        return ""
    verb = "has" if len(names) == 1 else "have"
    needs = "".join(
        f"; {row.name} also needs {row.needs}" for row in DETECTORS.values() if row.needs
    )
    return (
        f"{words.enumerate_words(names)} {verb} given no verdict on a labelled recording. The "
        "place under test does not teach. So a threshold needs at least two healthy "
        f"places, and a size needs at least two with a nodule{needs}."
    )


def _sentence(name: str) -> str:
    """Return how a detector, or the baseline, decides."""
    if name == ALWAYS:
        return "baseline: calls everything a nodule"
    return detector_row(name).sentence


def calibration_rows(calibration: pd.DataFrame, scheme: str) -> list[Cells]:
    """Return stated and observed frequencies of nodules, one row per bin, of one scheme.

    Returns
    -------
    list of dict
        ``detector``, ``stated`` (the range), ``recordings``, ``mean`` and the ``observed`` cell.
    """
    rows = calibration[calibration["scheme"] == scheme].to_dict("records")
    return [
        {
            "detector": row["detector"],
            "stated": words.interval(row["stated_low"], row["stated_high"]),
            "recordings": int(row["recordings"]),
            "mean": words.percent(row["stated"]) if row["recordings"] else words.UNKNOWN,
            "observed": rate_cell_of(row, "observed"),
        }
        for row in rows
    ]
