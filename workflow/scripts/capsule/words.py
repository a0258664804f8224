"""Text for numbers, sizes, verdicts and unknown values, as the report and the programs show them.

`number` rounds every number, a value and the ends of its interval alike. Rounding keeps their
order, so a shown interval always contains its value.
"""

import math
from collections.abc import Mapping, Sequence
from typing import TypeGuard, TypeVar

from capsule.kinds import Row

UNKNOWN = "not known"
NOT_GIVEN = "not given"
NOT_APPLICABLE = "n/a"
MINUS = "\u2212"
Cell = TypeVar("Cell")
_SCHEMES = {
    "held_out": "held-out sessions",
    "leave_one_out": "leave-one-out",
    "leave_one_session_out": "leave-one-session-out",
    "leave_one_setup_out": "leave-one-set-up-out",
    "resubstitution": "resubstitution",
    "all": "all labelled",
    "paper": "paper, as printed",
}


def is_known(value: Cell | None) -> TypeGuard[Cell]:
    """Return whether a cell of a table holds a value."""
    # Only NaN differs from itself.
    return value is not None and value == value


def number(value: float | None, digits: int = 2) -> str:
    """Return a number as text with this many decimals, zero without a sign: ``\u22120.25``."""
    if not is_known(value):
        return UNKNOWN
    text = f"{value:.{digits}f}"
    return f"{MINUS}{text[1:]}" if text.strip("-0.") and text[0] == "-" else text.lstrip("-")


def significant(value: float, digits: int = 3) -> str:
    """Return a number as text with this many significant digits: ``0.127``, ``45.4``."""
    if value == 0 or not math.isfinite(value):
        return number(value, 0)
    return number(value, max(digits - 1 - math.floor(math.log10(abs(value))), 0))


def percent(fraction: float | None) -> str:
    """Return a fraction as text in percent: ``57.7 %``, ``85 %``."""
    return f"{_percent_digits(fraction)} %" if is_known(fraction) else UNKNOWN


def interval(low: float, high: float) -> str:
    """Return an interval of fractions as text in percent: ``63.9 to 94.8 %``."""
    if not is_known(low):
        return UNKNOWN
    return f"{_percent_digits(low)} to {_percent_digits(high)} %"


def probability(fraction: float | None) -> str:
    """Return a probability as text in percent, never 0 or 100: ``12.5 %``, ``> 99.9 %``."""
    if not is_known(fraction):
        return NOT_GIVEN
    if _percent_digits(fraction) in ("0", "100"):
        return "< 0.1 %" if fraction < 0.5 else "> 99.9 %"
    return percent(fraction)


def count_of(hits: int, of: int) -> str:
    """Return a count as text: ``17 of 20``."""
    return f"{int(hits)} of {int(of)}"


def size(size_mm: float | None) -> str:
    """Return a size as text: ``3 mm``, ``no nodule``."""
    if not is_known(size_mm):
        return UNKNOWN
    return "no nodule" if size_mm == 0 else f"{size_mm:g} mm"


def verdict(row: Row) -> str:
    """Return a verdict of results/detections.csv as text, or the reason for no verdict."""
    if is_known(row["predicted_mm"]):
        return size(row["predicted_mm"])
    reason = row.get("no_verdict")
    return f"no verdict: {reason}" if is_known(reason) and reason else "no verdict"


def stated_probability(row: Row) -> float | None:
    """Return a verdict's probability, which holds only for recordings like those that teach."""
    return None if row.get("familiar") == "no" else row.get("probability")


def estimated_size(verdict: Mapping[str, float], largest_mm: float | None = None) -> str:
    """Return a verdict's size as text, with any interval: ``3.2 mm (2.1 to 4.0)``.

    Parameters
    ----------
    verdict : mapping
        ``estimate_mm``, ``estimate_low_mm`` and ``estimate_high_mm``. The high end is infinite if
        the interval ends at the largest size that the archive holds.
    largest_mm : float, optional
        That size: ``4.6 mm (3.8 to 5 mm or more)``; without it ``4.6 mm (3.8 mm or more)``.
    """
    names = ("estimate_mm", "estimate_low_mm", "estimate_high_mm")
    estimate_mm, low_mm, high_mm = (verdict.get(name) for name in names)
    if not is_known(estimate_mm):
        return NOT_GIVEN
    interval = ""
    if is_known(low_mm) and is_known(high_mm):
        end = f"to {number(high_mm, 1)}"
        if math.isinf(high_mm):
            open_from_low = largest_mm is None or low_mm >= largest_mm
            end = "mm or more" if open_from_low else f"to {size(largest_mm)} or more"
        interval = f" ({number(low_mm, 1)} {end})"
    return f"{number(estimate_mm, 1)} mm{interval}"


def place(seconds: float | None, way_mm: float | None) -> str:
    """Return as text where along a run a nodule lies: ``12.3 s, 6.1 mm``."""
    if not is_known(seconds):
        return NOT_GIVEN
    if seconds < 0:
        return "before the start"
    return f"{number(seconds, 1)} s" + (f", {number(way_mm, 1)} mm" if is_known(way_mm) else "")


def setting(value: object) -> str:
    """Return a value of the configuration as text."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        numeric = len(value) == 2 and all(isinstance(part, int | float) for part in value)
        return (" to " if numeric else ", ").join(setting(part) for part in value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    # A whole number may have more digits than a float holds.
    text = str(abs(value)) if isinstance(value, int) else f"{abs(value):g}"
    return f"{MINUS}{text}" if value < 0 else text


def scheme(name: str) -> str:
    """Return the name of a scheme as text."""
    return _SCHEMES.get(name, name)


def points(difference: float) -> str:
    """Return a difference of two rates as text in percentage points: ``+12.5``, ``\u221240``."""
    text = _percent_digits(difference)
    return text if text == "0" or text.startswith(MINUS) else f"+{text}"


def p_value(p: float | None) -> str:
    """Return a probability under the null hypothesis as text: ``p = 0.031``, ``p < 0.001``."""
    if not is_known(p):
        return ""
    return "p < 0.001" if p < 0.001 else f"p = {number(p, 3)}"


def enumerate_words(parts: Sequence[str]) -> str:
    """Return a list as text: ``a, b and c``."""
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} and {parts[-1]}"


def plural(count: int, singular: str, several: str | None = None) -> str:
    """Return a count and its noun as text: ``1 recording``, ``20 recordings``."""
    return f"{count:,} {singular if count == 1 else several or singular + 's'}".replace(",", " ")


def duration(seconds: float) -> str:
    """Return a duration as text: ``4.2 s``, ``3 min 20 s``, ``2 h 5 min``."""
    if seconds < 0.1:
        return "under 0.1 s"
    if seconds < 60:
        return f"{number(seconds, 1)} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"


def _percent_digits(fraction: float) -> str:
    """Return a percentage rounded to a tenth, without a final ``.0``."""
    return number(100 * fraction, 1).removesuffix(".0")


# Heights of a line of bars, also for terminals that show ASCII only.
BARS, PLAIN_BARS = "▁▂▃▄▅▆▇█", "_.-=+*#@"


def trace(values: Sequence[float | None], bars: str, least_span: float = 0.0) -> str:
    """Return values as a line of bars between the smallest and the largest.

    Parameters
    ----------
    values : sequence of float or None
        The values; None is a missing one, which becomes a space.
    bars : str
        `BARS` or `PLAIN_BARS`.
    least_span : float
        Smallest range that fills the full height.
    """
    known = [value for value in values if value is not None]
    low, high = min(known, default=0), max(known, default=0)
    span, top = max(high - low, least_span) or 1, len(bars) - 1
    return "".join(
        " " if value is None else bars[int((value - low) * top // span)] for value in values
    )
