"""Define the rows of the table that compares the detectors, and write the cells of each row."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

from capsule import words
from capsule.kinds import Cells
from capsule.kinds import Row as TableRow
from capsule.page.cells import plain_cell, rate_cell_of


@dataclass(frozen=True)
class Row:
    """A row of the comparison: one measure, one cell per detector.

    Attributes
    ----------
    title : str
        The heading; ``{size}``, ``{tolerance}`` and ``{reference}`` are filled in.
    table : str
        The table with its values, one of `capsule.evaluation.measures`.
    cell : callable
        Makes a cell from a row of that table.
    sizes : {"all", "healthy", "each", "smallest"}
        The recordings that count: all with a nodule, those without one, or those of one size
        (one row for each size, or one row for the smallest).
    measure : str
        In the table of differences, the measure that is compared; empty for other tables.
    of_specificity : bool
        Whether the row rests on the specificity alone, which a learned threshold may set.
    """

    title: str
    table: str
    cell: Callable[[TableRow], Cells]
    sizes: Literal["all", "healthy", "each", "smallest"] = "all"
    measure: str = ""
    of_specificity: bool = False


@dataclass(frozen=True)
class Group:
    """Rows under one heading.

    Attributes
    ----------
    title : str
        The heading; ``{prevalence}`` and ``{reference}`` are filled in.
    rows : tuple of Row
        The rows.
    folded : bool
        Whether the rows are folded away, because most readers do not need them.
    """

    title: str
    rows: tuple[Row, ...]
    folded: bool = True


def rate_of(name: str) -> Callable[[TableRow], Cells]:
    """Return a function that makes a cell from the rate in a column."""
    return partial(rate_cell_of, name=name)


def number_of(name: str, unit: str = "", end: str = "") -> Callable[[TableRow], Cells]:
    """Return a function that makes a cell from the number in a column, with its unit.

    Parameters
    ----------
    name : str
        Start of the names of the three columns (value, ``_low`` and ``_high``).
    unit : str, optional
        Text after the number; it begins with a space.
    end : str, optional
        End of these names, such as ``_mm``.
    """
    return partial(_number_cell, name=name, unit=unit, end=end)


def _number_cell(row: TableRow, name: str, unit: str, end: str) -> Cells:
    value, low, high = (row[f"{name}{part}{end}"] for part in ("", "_low", "_high"))
    if not words.is_known(value):
        return plain_cell(None, words.UNKNOWN)
    interval = f"{words.number(low)} to {words.number(high)}{unit}" if words.is_known(low) else ""
    return plain_cell(float(value), words.number(value) + unit, interval)


def brier(row: TableRow) -> Cells:
    """Return the Brier score, and the score of always stating the prevalence."""
    uninformed = f"always stating the prevalence: {words.number(row['brier_uninformed'], 3)}"
    return plain_cell(float(row["brier"]), words.number(row["brier"], 3), "", uninformed)


def size_error(row: TableRow) -> Cells:
    """Return the mean absolute error of the size, and the number of nodules that it covers."""
    cell = _number_cell(row, "absolute_error", " mm", "_mm")
    return cell | {"count": words.count_of(row["detected"], row["recordings"])}


def location_error(row: TableRow) -> Cells:
    """Return the median error of the place, and the number of recordings that it covers."""
    cell = _number_cell(row, "median_absolute_error_mm", " mm", "")
    return cell | {"count": words.plural(int(row["recordings"]), "recording")}


def difference(row: TableRow) -> Cells:
    """Return the difference of two rates, with the p value of McNemar's test."""
    value = row["difference"]
    if not words.is_known(value):
        return plain_cell(None, words.UNKNOWN)
    bounds = f"{words.points(row['difference_low'])} to {words.points(row['difference_high'])}"
    return plain_cell(float(value), words.points(value), bounds, words.p_value(row["mcnemar_p"]))


GROUPS = (
    Group(
        "Finding a nodule",
        (
            Row("Specificity", "summary", rate_of("specificity"), of_specificity=True),
            Row("Sensitivity, any nodule", "summary", rate_of("sensitivity")),
            Row("Sensitivity, {size}", "predictive_values", rate_of("sensitivity"), "each"),
            Row("Balanced accuracy", "summary", rate_of("balanced_accuracy")),
        ),
        folded=False,
    ),
    Group(
        "Ranking by the score, for all thresholds",
        (
            Row("AUC, any nodule against none", "auc", number_of("auc")),
            Row("AUC, {size} against none", "auc", number_of("auc"), "smallest"),
        ),
    ),
    Group(
        "Meaning of a verdict if {prevalence} of the places have a nodule",
        (
            Row("Positive predictive value", "predictive_values", rate_of("ppv")),
            Row("Negative predictive value", "predictive_values", rate_of("npv")),
            Row("Brier score of the probability", "brier", brier),
        ),
    ),
    Group(
        "Size and place of a nodule",
        (
            Row("Exact size, of all nodules", "summary", rate_of("exact_rate")),
            Row("Within {tolerance}, of all nodules", "summary", rate_of("within_rate")),
            Row("Mean absolute error, of those found", "size_error", size_error),
            Row("Bias, of those found", "size_error", number_of("bias", " mm", "_mm")),
            Row("Median error of the place", "localisation", location_error),
        ),
        folded=False,
    ),
    Group(
        "Difference from {reference}, on the same recordings",
        (
            Row("Sensitivity, difference", "comparison", difference, measure="detection"),
            Row(
                "Specificity, difference",
                "comparison",
                difference,
                "healthy",
                "detection",
                of_specificity=True,
            ),
            Row(
                "Within {tolerance}, difference",
                "comparison",
                difference,
                measure="size_within_tolerance",
            ),
        ),
    ),
)
