"""Read the numbers on a command line; the error names the value and what is allowed."""

import argparse
from collections.abc import Callable
from math import inf

from capsule.naming import is_plain


def natural(text: str) -> int:
    """Read a whole number of at least 1."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least 1")
    return value


def positive(text: str) -> float:
    """Read a number above 0."""
    return _read(text, lambda value: 0 < value < inf, "a number above 0")


def number_within(lowest: float, highest: float, unit: str = "") -> Callable[[str], float]:
    """Return a function that reads a number from `lowest` to `highest`, both included."""
    allowed = f"a number from {lowest:g} to {highest:g} {unit}".rstrip()
    return lambda text: _read(text, lambda value: lowest <= value <= highest, allowed)


def _read(text: str, is_allowed: Callable[[float], bool], allowed: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not is_allowed(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not {allowed}")
    return value


def plain_text(text: str) -> str:
    """Return text that can begin the name of a recording, for argparse."""
    if not is_plain(f"{text}1.csv"):
        raise argparse.ArgumentTypeError(f"{text!r} cannot begin the name of a recording")
    return text
