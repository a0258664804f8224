"""Columns of numbers, truth values and text, with their units and names in words."""

import re
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
import yaml

from capsule.evaluation.files import TEXT
from capsule.project import SCHEMAS

NO_UNIT = "1"


@cache
def described() -> dict[str, dict[str, str]]:
    """Return the content of workflow/schemas/columns.yaml: words for tables and columns."""
    content: dict[str, Any] = yaml.safe_load((SCHEMAS / "columns.yaml").read_text("utf-8"))
    return content


def as_exported(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table of results in which no text is unknown and each column has a type."""
    for name, values in table.items():
        if values.empty and name not in TEXT:
            table[name] = values.astype(float)
        elif not pd.api.types.is_numeric_dtype(values):
            table[name] = values.fillna("").astype(str)
    return table


def columns_of(table: pd.DataFrame) -> Iterator[tuple[str, np.ndarray, str, str]]:
    """Yield name, values, unit and long name of each column of a table.

    The values are float64 (NaN: unknown), int64, bool, or objects that are text. The unit of text
    and of truth values is empty; that of sensors is an attribute of their table.
    """
    for name, values in table.items():
        unit, long_name = describe(str(name))
        if str(name).startswith("sensor_"):
            unit = table.attrs["unit"]
        array = values.to_numpy()
        yield str(name), array, "" if array.dtype in (bool, object) else unit, long_name


def describe(name: str) -> tuple[str, str]:
    """Return the unit (``1`` if it has none) and the long name of a column of numbers.

    Both follow from the column's name, such as ``estimate_low_mm`` or ``peak_spacing_2``.
    """
    told = described()
    base: list[str] = []
    unit, end, of = NO_UNIT, "", ""
    for part in name.split("_"):
        if base and part in told["units"]:
            unit = told["units"][part]
        elif base and part in told["ends"]:
            end = told["ends"][part]
        elif part.isdecimal():
            of = f", sensor {part}"
        elif base and re.fullmatch(r"[0-9.]+mm", part):
            of = f" beside the template of {part}"
        else:
            base.append(part)
    key = "_".join(base)
    words = told["columns"].get(name) or told["columns"].get(key) or key.replace("_", " ")
    return told["units"].get(key, unit), f"{end} {words}{of}".strip()
