"""Read the cells of text files and of workbooks as numbers."""

import re
from collections.abc import Collection, Sequence
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from capsule.importing.table import LARGEST_NUMBER, Table

MISSING = frozenset(("", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--"))


class NumberStyle(NamedTuple):
    """The signs in numbers: ``point`` or ``comma``; thousands ``none``, ``comma`` or ``point``."""

    decimal: str
    thousands: str = "none"

    def number(self, cell: str, missing: Collection[str | float] = ()) -> float | None:
        """Return a cell's number; NaN for a missing sample, None if it is not a number.

        Parameters
        ----------
        cell : str
            The cell's text.
        missing : collection of str or float
            Additional marks of a missing sample, in lower case.
        """
        text = cell.strip()
        if _PATTERNS[self].fullmatch(text):
            if self.thousands != "none":
                text = text.replace("," if self.thousands == "comma" else ".", "")
            value = float(text.replace(",", "."))
            if value in missing or text.lower() in missing:
                return float("nan")
            return value if abs(value) <= LARGEST_NUMBER else None
        return float("nan") if text.lower() in MISSING or text.lower() in missing else None


POINT = NumberStyle("point")
# A number with thousands never begins with 0: the comma of 0,123 is a decimal sign.
_PATTERNS = {
    style: re.compile(rf"[+-]?(?:{digits})(?:[eE][+-]?[0-9]+)?")
    for style, digits in {
        POINT: r"[0-9]+\.?[0-9]*|\.[0-9]+",
        NumberStyle("comma"): r"[0-9]+(?:,[0-9]+)?|,[0-9]+",
        NumberStyle("point", "comma"): r"(?:[1-9][0-9]{0,2}(?:,[0-9]{3})+|[0-9]+)(?:\.[0-9]*)?",
        NumberStyle("comma", "point"): r"(?:[1-9][0-9]{0,2}(?:\.[0-9]{3})+|[0-9]+)(?:,[0-9]+)?",
    }.items()
}


STYLES = tuple(_PATTERNS)


def missing_words(keys: SimpleNamespace) -> frozenset[str | float]:
    """Return the additional marks of a missing sample, as lower-case words and as numbers.

    The number matches all its spellings: -999 is also written -999.0.
    """
    words = {str(word).strip().lower() for word in keys.missing or ()}
    numbers = {POINT.number(word) for word in words}
    return frozenset(words | {each for each in numbers if each is not None and each == each})


def cells_table(
    names: Sequence[str],
    units: Sequence[str],
    rows: Sequence[Sequence[str]],
    lines: Sequence[int],
    style: NumberStyle,
    missing: Collection[str | float],
    **told: object,
) -> Table:
    """Return a table of cells of text.

    Parameters
    ----------
    names, units : sequence of C str
        Name and unit of each column.
    rows : sequence of K sequences of C str
        The cells.
    lines : sequence of K int
        Number of each row in the file.
    style : NumberStyle
        The style of the numbers.
    missing : collection of str or float
        Additional marks of a missing sample, in lower case.
    **told
        Further attributes of the table.
    """
    texts = np.array([*zip(*rows, strict=True)], dtype=object).reshape(len(names), len(rows))
    read = [[style.number(cell, missing) for cell in column] for column in texts]
    if missing:
        marks = MISSING.union(missing)
        texts = np.array([["" if c.lower() in marks else c for c in column] for column in texts])
    return Table(
        tuple(names),
        tuple(units),
        np.array(read, dtype=float).reshape(texts.shape),  # None becomes NaN
        texts.astype(object),
        np.array([[number is None for number in column] for column in read]).reshape(texts.shape),
        lines=np.array(lines, dtype=int),
        **told,  # type: ignore[arg-type]
    )
