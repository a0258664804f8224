"""The detectors side by side: one table a scheme, a column a detector."""

from collections.abc import Callable, Mapping, Sequence

import pandas as pd

from capsule import words
from capsule.detectors.registry import DETECTORS, detector_row
from capsule.evaluation.folds import group_scheme, main_scheme
from capsule.evaluation.tables import ALWAYS
from capsule.page.cells import plain_cell, rate_cell_of

NOT_APPLICABLE = plain_cell(None, words.NOT_APPLICABLE)
Judgements = Mapping[str, pd.DataFrame]


def page_values(judgements: Judgements, settings: Mapping) -> dict:
    """Give the page's values that set the detectors side by side.

    Parameters
    ----------
    judgements : mapping of str to DataFrame
        The tables of `capsule.evaluation.tables`, by name.
    settings : mapping
        The configuration.

    Returns
    -------
    dict
        ``compared``, ``calibration``, ``silent``, ``in_short``, ``wanted_specificity`` and
        ``prevalence``.
    """
    judged = settings["evaluation"]
    main = main_scheme(judged["schemes"])
    return {
        "compared": compared(
            judgements, [main, *(group_scheme(key) for key in judged["groups"])], judged
        ),
        "calibration": calibration_rows(judgements["calibration"], main),
        "silent": silent(judgements, main, settings["detectors"]),
        "in_short": in_short(judgements, main),
        "wanted_specificity": words.percent(judged["specificity"]),
        "prevalence": words.percent(judged["prevalence"]),
    }


def compared(judgements: Judgements, schemes: Sequence[str], settings: Mapping) -> list[dict]:
    """Arrange what the tables say of every detector.

    Parameters
    ----------
    judgements : mapping of str to DataFrame
        The tables of `capsule.evaluation.tables`, by name.
    schemes : sequence of str
        The schemes wanted, in this order; one without a verdict is left out.
    settings : mapping
        Section ``evaluation`` of the configuration.

    Returns
    -------
    list of dict
        One a scheme: ``scheme``, ``title``, ``recordings``, ``detectors`` and ``groups`` of rows.
    """
    found = []
    for scheme in schemes:
        rows = {
            name: table[table["scheme"] == scheme]
            for name, table in judgements.items()
            if "scheme" in table
        }
        detectors = list(rows["summary"]["detector"])
        if detectors:
            count = int(rows["summary"]["recordings"].max())
            found.append(
                {
                    "scheme": scheme,
                    "title": words.scheme(scheme),
                    "recordings": words.plural(count, "recording"),
                    "detectors": [{"name": name, "words": _sentence(name)} for name in detectors],
                    "groups": _groups(rows, detectors, settings),
                }
            )
    return found


def _groups(rows: Judgements, detectors: Sequence[str], settings: Mapping) -> list[dict]:
    sizes_mm = sorted(rows["predictive_values"]["size_mm"].dropna().unique())
    prevalence, first = words.percent(settings["prevalence"]), detectors[0]
    tolerance = f"{settings['tolerance_mm']:g} mm"
    columns = _Columns(rows, detectors)
    smallest = [
        columns.numbers(f"AUC, {words.size(size)} against none", "auc", "auc", size)
        for size in sizes_mm[:1]
    ]
    return [
        {
            "title": "Finding a nodule",
            "rows": [
                columns.rates("Specificity", "summary", "specificity"),
                columns.rates("Sensitivity, any nodule", "summary", "sensitivity"),
                *(
                    columns.rates(
                        f"Sensitivity, {words.size(size)}", "predictive_values", "sensitivity", size
                    )
                    for size in sizes_mm
                ),
                columns.rates("Balanced accuracy", "summary", "balanced_accuracy"),
            ],
        },
        {
            "title": "Ranking by the score, whatever the threshold",
            "rows": [
                columns.numbers("AUC, any nodule against none", "auc", "auc"),
                *smallest,
                columns.cells("AUC, labels dealt out anew", "permutation", _chance),
            ],
        },
        {
            "title": f"What a verdict means where {prevalence} have a nodule",
            "rows": [
                columns.rates("Positive predictive value", "predictive_values", "ppv"),
                columns.rates("Negative predictive value", "predictive_values", "npv"),
                columns.cells("Brier score of the probability", "brier", _brier),
            ],
        },
        {
            "title": "Size and place of a nodule",
            "rows": [
                columns.rates("Exact size, of all nodules", "summary", "exact_rate"),
                columns.rates(f"Within {tolerance}, of all nodules", "summary", "within_rate"),
                columns.cells("Mean absolute error, of those found", "size_error", _size_error),
                columns.cells("Bias, of those found", "size_error", _bias),
                columns.cells("Median error of the place", "localisation", _place_error),
            ],
        },
        {
            "title": f"Difference from {first}, on the same recordings",
            "rows": [
                columns.differences("Nodules found", first, "detection", None),
                columns.differences("Healthy recordings called so", first, "detection", 0.0),
                columns.differences(f"Within {tolerance}", first, "size_within_tolerance", None),
            ],
        },
    ]


class _Columns:
    """Makes rows of cells, one a detector, from the tables of one scheme."""

    def __init__(self, rows: Judgements, detectors: Sequence[str]) -> None:
        self._rows = rows
        self._detectors = detectors

    def rates(self, title: str, table: str, name: str, size_mm: float | None = None) -> dict:
        return self.cells(title, table, lambda row: rate_cell_of(row, name), size_mm)

    def numbers(self, title: str, table: str, name: str, size_mm: float | None = None) -> dict:
        return self.cells(title, table, lambda row: _number_cell(row, name), size_mm)

    def cells(
        self,
        title: str,
        table: str,
        write: Callable[[Mapping], dict],
        size_mm: float | None = None,
    ) -> dict:
        rows = _of_size(self._rows[table], size_mm)
        # The baseline has no score and no size.
        cells = ((row["detector"], write(row)) for row in rows)
        found = {name: cell for name, cell in cells if name != ALWAYS or cell["value"] is not None}
        return {
            "title": title,
            "cells": [found.get(name, NOT_APPLICABLE) for name in self._detectors],
        }

    def differences(self, title: str, first: str, measure: str, size_mm: float | None) -> dict:
        table = self._rows["comparison"]
        table = table[(table["first"] == first) & (table["measure"] == measure)]
        found = {row["second"]: _difference(row) for row in _of_size(table, size_mm)}
        found[first] = plain_cell(None, "reference")
        return {
            "title": title,
            "cells": [found.get(name, NOT_APPLICABLE) for name in self._detectors],
        }


def _of_size(table: pd.DataFrame, size_mm: float | None) -> list[dict]:
    if "size_mm" in table:
        size = pd.to_numeric(table["size_mm"])
        table = table[size.isna() if size_mm is None else size == size_mm]
    return table.to_dict("records")


def _number_cell(row: Mapping, name: str, unit: str = "", end: str = "") -> dict:
    """Write a number with its interval; ``end`` stands after ``_low`` in the columns' names."""
    value, low, high = (row[f"{name}{part}{end}"] for part in ("", "_low", "_high"))
    if not words.is_known(value):
        return plain_cell(None, words.UNKNOWN)
    interval = f"{words.number(low)} to {words.number(high)}{unit}" if words.is_known(low) else ""
    return plain_cell(float(value), words.number(value) + unit, interval)


def _chance(row: Mapping) -> dict:
    bounds = f"{words.number(row['by_chance_low'])} to {words.number(row['by_chance_high'])}"
    return plain_cell(
        float(row["by_chance"]), words.number(row["by_chance"]), bounds, words.p_value(row["p"])
    )


def _brier(row: Mapping) -> dict:
    uninformed = f"knowing nothing: {words.number(row['brier_uninformed'], 3)}"
    return plain_cell(float(row["brier"]), words.number(row["brier"], 3), "", uninformed)


def _size_error(row: Mapping) -> dict:
    cell = _number_cell(row, "absolute_error", " mm", "_mm")
    return cell | {"count": words.count_of(row["detected"], row["recordings"])}


def _bias(row: Mapping) -> dict:
    return _number_cell(row, "bias", " mm", "_mm")


def _place_error(row: Mapping) -> dict:
    cell = _number_cell(row, "median_absolute_error_mm", " mm")
    return cell | {"count": words.plural(int(row["recordings"]), "recording")}


def _difference(row: Mapping) -> dict:
    value = row["difference"]
    if not words.is_known(value):
        return plain_cell(None, words.UNKNOWN)
    bounds = f"{words.points(row['difference_low'])} to {words.points(row['difference_high'])}"
    return plain_cell(float(value), words.points(value), bounds, words.p_value(row["mcnemar_p"]))


def silent(judgements: Judgements, scheme: str, detectors: Sequence[str]) -> str:
    """Say which of the configured detectors have judged no labelled recording, and why."""
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
        f"{words.enumerate_words(names)} {verb} given no verdict on a labelled recording. A "
        "threshold is learned from other recordings without a nodule, and a size from others with "
        f"one, so two of each are needed at least{needs}."
    )


def _sentence(name: str) -> str:
    """Say how a detector decides, or the baseline that stands beside them."""
    if name == ALWAYS:
        return "baseline: calls everything a nodule"
    return detector_row(name).sentence


def calibration_rows(calibration: pd.DataFrame, scheme: str) -> list[dict]:
    """List stated and observed frequencies of nodules, bin by bin, of one scheme.

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


def in_short(judgements: Judgements, scheme: str) -> str:
    """Set every detector's false alarms beside the nodules that it finds, in one sentence."""
    table = judgements["summary"]
    rows = table[(table["scheme"] == scheme) & (table["detector"] != ALWAYS)].to_dict("records")
    said = []
    for row in rows:
        alarms = 1 - row["specificity"] if words.is_known(row["specificity"]) else None
        found = words.percent(row["sensitivity"])
        said.append(f"{row['detector']} {words.percent(alarms)} and {found}")
    if len(said) < 2:
        return ""
    return f"False alarms, and nodules found, by each detector: {'; '.join(said)}."
