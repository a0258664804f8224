"""Make the cells of an Excel sheet."""

import math
from typing import TYPE_CHECKING

from capsule.naming import displayed, without_formula

if TYPE_CHECKING:
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.worksheet._write_only import WriteOnlyWorksheet

# Excel's limit for a text, in characters.
_LONGEST_TEXT = 32_767


def content(sheet: "WriteOnlyWorksheet", value: object) -> object:
    """Return a cell: a number in full precision, or a text that is not taken for a formula."""
    if isinstance(value, str):
        plain = value if value.isprintable() else displayed(value)
        return _cell(sheet, without_formula(plain)[:_LONGEST_TEXT], "s") if value else None
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else _cell(sheet, str(value), "s")
    # openpyxl writes only 16 digits, which is too few for this number.
    if isinstance(value, float) and float(f"{value:.16g}") != value:
        return _cell(sheet, repr(value), "n")
    return value


def _cell(sheet: "WriteOnlyWorksheet", text: str, kind: str) -> "WriteOnlyCell":
    from openpyxl.cell import WriteOnlyCell

    cell = WriteOnlyCell(sheet, text)
    cell.data_type = kind
    return cell
