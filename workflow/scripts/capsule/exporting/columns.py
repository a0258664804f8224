"""Columns of numbers and of text in full precision, with their units and names in words."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from capsule.evaluation.files import TEXT

NO_UNIT = "1"
_TRUTH = {"True": True, "False": False}
# Further columns of text; in these, a text can look like a number in every row.
_TEXT = TEXT | {"key", "value", "first", "second", "measure", "no_verdict", "reading_unit"}
# Parts of a column's name that give its unit, or the end of an interval.
_UNITS = {"mm": "mm", "s": "s", "hz": "Hz"}
_ENDS = {"low": "lower end of the interval of", "high": "upper end of the interval of"}
_WORDS = {
    "recording": "name of the recording: folder and file",
    "size": "true size of the nodule; 0: none",
    "samples": "lines of the file that are samples",
    "duration": "time from the first to the last sample",
    "sha256": "SHA-256 of the file",
    "readings_sha256": "SHA-256 of the accepted readings",
    "no_verdict": "reason why no detector judges the recording",
    "familiar": "whether the recording is of the kind that taught the detectors",
    "unfamiliar_because": "reason why it is not, or why that is not known",
    "near_copies": "recordings that are nearly the same",
    "nodule_at": "place of the nodule according to the header",
    "rate_hz": "sampling rate according to the header",
    "reading_unit": "unit of the exported readings",
    "key": "key of a header line",
    "value": "value of a header line",
    "predicted": "predicted size of the nodule; 0: none",
    "estimate": "estimated size of the nodule",
    "location_s": "time at which the nodule is located",
    "location_mm": "place at which the nodule is located",
    "tp": "true positives",
    "fp": "false positives",
    "fn": "false negatives",
    "ppv": "positive predictive value",
    "npv": "negative predictive value",
    "auc": "area under the ROC curve",
    "mcnemar_p": "p-value of McNemar's test; with clusters, of a sign test over them",
    "clusters": "places or set-ups on which the intervals of the row rest",
    "precision_at_least": "one-sided 95 % lower bound of the precision",
    "recall_at_least": "one-sided 95 % lower bound of the recall",
    "specificity_at_least": "one-sided 95 % lower bound of the specificity",
    "brier": "Brier score",
    "within": "recordings whose size is right within the tolerance",
    "exact": "recordings whose size is exactly right",
    "one_sided": "whether the tolerance lies inside the range of sizes on one side only",
    "rmse": "root mean square error of the fitted particle",
    "rmse_initial": "root mean square error of the best random particle",
    "seed": "random seed of the configuration",
    "first_peak": "column of the first peak, counted from 1",
    "lag": "best lag of the sliding comparison, counted from 1",
    "accepted_moves": "steps that improved the particle",
    "recordings": "number of recordings",
    "healthy": "recordings without a nodule",
    "path": "path of the file from the project's folder",
    "detected": "number of recordings detected as a nodule of any size",
    "exact_rate": "share of the sizes that are exactly right",
    "within_rate": "share of the sizes that are right within the tolerance",
}
# Units and names of the parameters of particles and templates. The number of the sensor follows.
PARAMETERS = {
    "amplitude": (NO_UNIT, "A, height of the Gaussian surface in standard deviations, sensor"),
    "vertical_spread": (NO_UNIT, "sigma_ver, spread across the sensors in rows, sensor"),
    "peak_spacing": ("samples", "Delta mu_hor, distance from this peak to the next, sensor"),
    "horizontal_spread": ("samples", "sigma_hor, spread along time, sensor"),
}


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes
    ----------
    unit : str
        Unit of the numbers; ``1`` for numbers without a unit, empty for text.
    long_name : str
        Description in words.
    values : (n,) array
        Values as float64 (NaN: unknown), int64, bool, or objects that are text.
    """

    unit: str
    long_name: str
    values: np.ndarray


@dataclass(frozen=True)
class Table:
    """A table: a description of its rows, and columns of equal length by their names."""

    long_name: str
    columns: Mapping[str, Column]


def table_of(long_name: str, cells: Mapping[str, Sequence[str]]) -> Table:
    """Return a table made from texts, such as those of a CSV file.

    Parameters
    ----------
    long_name : str
        Description of the rows.
    cells : mapping of str to sequence of str
        The cells of each column; an empty cell is an unknown value.
    """
    return Table(long_name, {name: column_of(name, texts) for name, texts in cells.items()})


def column_of(name: str, cells: Sequence[str]) -> Column:
    """Return a column of numbers if every cell is a number, and otherwise a column of text."""
    unit, long_name = describe(name)
    values = None if name in _TEXT else _numbers(cells)
    if values is None:
        values = np.array(cells, dtype=object)
    return Column("" if values.dtype in (bool, object) else unit, long_name, values)


def _numbers(cells: Sequence[str]) -> np.ndarray | None:
    if cells and set(cells) <= _TRUTH.keys():
        return np.array([_TRUTH[cell] for cell in cells])
    try:
        return np.array([int(cell) for cell in cells], dtype=np.int64 if cells else np.float64)
    except (ValueError, OverflowError):
        pass
    try:
        # float() restores every number that repr() wrote exactly; pandas may not.
        return np.array([float(cell) if cell else np.nan for cell in cells])
    except ValueError:
        return None


def describe(name: str) -> tuple[str, str]:
    """Return the unit and the long name of a column of numbers.

    Parameters
    ----------
    name : str
        Name of the column, such as ``estimate_low_mm`` or ``recall_high``.

    Returns
    -------
    tuple of str
        Unit and long name; the unit is ``1`` for a number without a unit.
    """
    base, _, number = name.rpartition("_")
    if base in PARAMETERS and number.isdecimal():
        unit, words = PARAMETERS[base]
        return unit, f"{words} {number}"
    parts = name.split("_")
    unit = next((_UNITS[part] for part in parts[1:] if part in _UNITS), NO_UNIT)
    end = next((_ENDS[part] for part in parts[1:] if part in _ENDS), "")
    base = "_".join([parts[0], *(part for part in parts[1:] if part not in {*_UNITS, *_ENDS})])
    if of_template := re.fullmatch(r"rmse_([0-9.]+mm)", base):
        words = f"root mean square error beside the template of {of_template[1]}"
    else:
        words = _WORDS.get(name) or _WORDS.get(base) or base.replace("_", " ")
    return unit, f"{end} {words}".strip()
