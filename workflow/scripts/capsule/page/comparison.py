"""Compare the detectors: one table per scheme, one column per detector; and on other benches."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import pandas as pd

from capsule import words
from capsule.detectors.registry import DETECTORS
from capsule.evaluation.archive_rates import sets_specificity
from capsule.evaluation.cross_validation import RESUBSTITUTION
from capsule.evaluation.measures import ALWAYS
from capsule.evaluation.rates import of_any
from capsule.kinds import Cells, Row, Settings
from capsule.page.cells import cell_of, plain_cell

NOT_APPLICABLE = plain_cell(None, words.NOT_APPLICABLE)
BASELINE = "baseline: calls everything a nodule"
REFERENCE = plain_cell(None, "reference")
# The part of a bench that neither taught a detector nor chose anything about it.
JUDGED_ONLY = "judged only"
Judgements = Mapping[str, pd.DataFrame]


@dataclass(frozen=True)
class Measure:
    """A row of the comparison: one measure, one cell per detector.

    The title's ``{size}``, ``{tolerance}`` and ``{reference}`` are filled in. A cell is a column of
    a rate, or what makes a cell from a row of the table. Sizes are those of the recordings that
    count. In the table of differences, `measure` is what is compared. `of_specificity` tells that
    the row rests on the specificity alone, which a learned threshold may set.
    """

    title: str
    table: str
    cell: str | Callable[[Row], Cells]
    sizes: Literal["all", "healthy", "each", "smallest"] = "all"
    measure: str = ""
    of_specificity: bool = False


def _brier(row: Row) -> Cells:
    """Return the Brier score, and the score of always stating the prevalence."""
    three = partial(words.number, digits=3)
    uninformed = f"always stating the prevalence: {three(row['brier_uninformed'])}"
    return cell_of(row, "brier", three, "", uninformed)


def _size_error(row: Row) -> Cells:
    """Return the mean absolute error of the size, and the number of nodules that it covers."""
    covered = words.count_of(row["detected"], row["recordings"])
    return cell_of(row, "absolute_error_mm", words.number, " mm", covered)


def _location_error(row: Row) -> Cells:
    """Return the median error of the place, and the number of recordings that it covers."""
    covered = words.plural(int(row["located"]), "recording")
    known = cell_of(row, "location_error_mm", words.number, " mm", covered)
    return known if row["located"] else NOT_APPLICABLE


def difference(row: Row) -> Cells:
    """Return the difference of two rates, with the p value of McNemar's test."""
    return cell_of(row, "difference", words.points, "", words.p_value(row["mcnemar_p"]))


_auc = partial(cell_of, name="auc", form=words.number, unit="")
_bias = partial(cell_of, name="bias_mm", form=words.number, unit=" mm")
_differs = partial(Measure, table="comparison", cell=difference)

# The rows under each heading, in which {prevalence} and {reference} are filled in. Those below the
# first heading are folded away, because most readers do not need them.
GROUPS = {
    "Finding a nodule": (
        Measure("Specificity", "summary", "specificity", of_specificity=True),
        Measure("Sensitivity, any nodule", "summary", "sensitivity"),
        Measure("Sensitivity, {size}", "summary", "sensitivity", "each"),
        Measure("Balanced accuracy", "summary", "balanced_accuracy"),
    ),
    "Size and place of a nodule": (
        Measure("Exact size, of all nodules", "sizing", "exact_rate"),
        Measure("Within {tolerance}, of all nodules", "sizing", "within_rate"),
        Measure("Mean absolute error, of those found", "sizing", _size_error),
        Measure("Bias, of those found", "sizing", _bias),
        Measure("Median error of the place", "sizing", _location_error),
    ),
    "Ranking by the score, for all thresholds": (
        Measure("AUC, any nodule against none", "summary", _auc),
        Measure("AUC, {size} against none", "summary", _auc, "smallest"),
    ),
    "Meaning of a verdict if {prevalence} of the places have a nodule": (
        Measure("Positive predictive value", "summary", "ppv"),
        Measure("Negative predictive value", "summary", "npv"),
        Measure("Brier score of the probability", "calibration", _brier),
    ),
    "Difference from {reference}, on the same recordings": (
        _differs("Sensitivity, difference", measure="detection"),
        _differs(
            "Specificity, difference", sizes="healthy", measure="detection", of_specificity=True
        ),
        _differs("Within {tolerance}, difference", measure="size_within_tolerance"),
    ),
}


def page_values(
    judgements: Judgements, schemes: Sequence[str], settings: Settings, lead: str
) -> Cells:
    """Return the page's values that compare the detectors; the first scheme is shown first."""
    judged = settings["evaluation"]
    verdicts = judgements["summary"].query("scheme == @schemes[0]")
    # By resubstitution a detector is better the more it remembers: it compares nothing.
    honest = [name for name in schemes if name != RESUBSTITUTION] or schemes
    compared = [_by_scheme(judgements, name, judged, lead) for name in honest]
    return {
        "compared": [tables for tables in compared if tables],
        "silent": [
            name for name in settings["detectors"] if name not in verdicts["detector"].array
        ],
        "needs": [(row.name, row.needs) for row in DETECTORS.values() if row.needs],
        "prevalence": words.percent(judged["prevalence"]),
    }


def _by_scheme(judgements: Judgements, scheme: str, settings: Settings, lead: str) -> Cells | None:
    """Return what compares the detectors by one scheme; None if it judged nothing."""
    tables = {
        name: table[table["scheme"] == scheme]
        for name, table in judgements.items()
        if "scheme" in table
    }
    judged = list(of_any(tables["summary"])["detector"])
    if not judged:
        return None
    # Differences are from the first in the configuration.
    reference = judged[0]
    detectors = sorted(judged, key=lambda name: name != lead)
    differences = tables["comparison"]
    differences = differences[differences["first"] == reference]
    tables["comparison"] = differences.rename(columns={"second": "detector"})
    # As no size stands for any nodule, a bin without ends stands for all probabilities.
    of_bins = tables["calibration"]["stated_low"].notna()
    bins, tables["calibration"] = (tables["calibration"][which] for which in (of_bins, ~of_bins))
    sentences = {row.name: row.sentence for row in DETECTORS.values()} | {ALWAYS: BASELINE}
    return {
        "scheme": scheme,
        "title": words.scheme(scheme),
        "recordings": words.plural(int(tables["summary"]["recordings"].max()), "recording"),
        "detectors": [{"name": name, "words": sentences[name]} for name in detectors],
        "groups": _groups(tables, reference, detectors, settings),
        "calibration": [
            row | {"observed": cell_of(row, "observed")} for row in bins.to_dict("records")
        ],
    }


def _groups(
    tables: Judgements, reference: str, detectors: Sequence[str], settings: Settings
) -> list[Cells]:
    """Return the filled rows of all groups, with a column for each detector."""
    sizes_mm = sorted(tables["summary"]["size_mm"].dropna().unique())
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
            "title": title.format(**filled_in),
            "rows": [
                {
                    "title": row.title.format(**filled_in, size=words.size(size_mm)),
                    "cells": _cells(tables, row, size_mm, detectors, reference, settings),
                }
                for row in rows
                for size_mm in sizes_of[row.sizes]
            ],
        }
        for title, rows in GROUPS.items()
    ]


def _cells(
    tables: Judgements,
    row: Measure,
    size_mm: float | None,
    detectors: Sequence[str],
    reference: str,
    settings: Settings,
) -> list[Cells]:
    """Return a row's cells, one a detector."""
    cells, table = {}, tables[row.table]
    if row.measure:
        table = table[table["measure"] == row.measure]
        cells[reference] = REFERENCE
    if "size_mm" in table:
        sizes_mm = pd.to_numeric(table["size_mm"])
        table = table[sizes_mm.isna() if size_mm is None else sizes_mm == size_mm]
    for values in table.to_dict("records"):
        cell = cell_of(values, row.cell) if isinstance(row.cell, str) else row.cell(values)
        if row.of_specificity and sets_specificity(values["detector"], values["scheme"]):
            # The threshold sets it: its interval and its differences say nothing.
            wanted = words.percent(settings["specificity"])
            cell = NOT_APPLICABLE if row.measure else plain_cell(None, f"set to {wanted}")
        # The baseline has no score and no size, so its cells without a value do not apply.
        if values["detector"] != ALWAYS or cell["value"] is not None:
            cells[values["detector"]] = cell
    return [cells.get(name, NOT_APPLICABLE) for name in detectors]


def bench_rows(rows: Sequence[Row], detectors: Sequence[str]) -> list[Row]:
    """Return the rows of benches that only judged, of the detectors that judge this archive."""
    only = [row for row in rows if row.get("part") == JUDGED_ONLY]
    return [row for row in only if row["detector"] in detectors]
