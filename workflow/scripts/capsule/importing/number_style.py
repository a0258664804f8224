"""How numbers are written: the decimal sign, and what separates thousands."""

import re
from collections.abc import Collection
from dataclasses import dataclass

# No clock and no sensor gives more than this.
LARGEST_NUMBER = 1e20
MISSING = frozenset(("", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--"))
_EXPONENT = r"(?:[eE][+-]?[0-9]+)?"


@dataclass(frozen=True)
class NumberStyle:
    """A way to write numbers.

    Attributes
    ----------
    decimal : {"point", "comma"}
        The decimal sign.
    thousands : {"none", "comma", "point"}
        What separates thousands.
    """

    decimal: str
    thousands: str = "none"

    def number(self, cell: str, missing: Collection[str | float] = ()) -> float | None:
        """Read a cell: NaN where it stands for a missing sample, None where it is no number.

        Parameters
        ----------
        cell : str
            As it stands in the file.
        missing : collection of str or float
            What also stands for a missing sample, in lower case.
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
# A group of thousands never begins with 0: 0,123 holds a decimal comma.
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
