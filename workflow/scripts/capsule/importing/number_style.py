"""Read numbers with different decimal signs and separators of thousands."""

import re
from collections.abc import Collection
from dataclasses import dataclass

# Larger numbers are neither times nor readings.
LARGEST_NUMBER = 1e20
MISSING = frozenset(("", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--"))
_EXPONENT = r"(?:[eE][+-]?[0-9]+)?"


@dataclass(frozen=True)
class NumberStyle:
    """The signs that a file uses in numbers.

    Attributes
    ----------
    decimal : {"point", "comma"}
        The decimal sign.
    thousands : {"none", "comma", "point"}
        The separator of thousands.
    """

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
COMMA = NumberStyle("comma")
POINT_WITH_THOUSANDS = NumberStyle("point", "comma")
COMMA_WITH_THOUSANDS = NumberStyle("comma", "point")
STYLES = (POINT, COMMA, POINT_WITH_THOUSANDS, COMMA_WITH_THOUSANDS)
# A number with thousands never begins with 0: the comma of 0,123 is a decimal sign.
_PATTERNS = {
    POINT: re.compile(rf"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+){_EXPONENT}"),
    COMMA: re.compile(rf"[+-]?(?:[0-9]+(?:,[0-9]+)?|,[0-9]+){_EXPONENT}"),
    POINT_WITH_THOUSANDS: re.compile(
        r"[+-]?(?:[1-9][0-9]{0,2}(?:,[0-9]{3})+|[0-9]+)(?:\.[0-9]*)?" + _EXPONENT
    ),
    COMMA_WITH_THOUSANDS: re.compile(
        r"[+-]?(?:[1-9][0-9]{0,2}(?:\.[0-9]{3})+|[0-9]+)(?:,[0-9]+)?" + _EXPONENT
    ),
}
