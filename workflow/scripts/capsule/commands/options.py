"""Read numbers, sizes and names from a command line; an error names what is allowed."""

import argparse
import re
from collections.abc import Callable
from math import inf

from capsule.recordings.names import (
    UNLABELLED,
    Entry,
    classify,
    folder_size_mm,
    is_plain,
    repeated_end,
    size_label,
)

LONGEST_NAME = 96  # without .csv


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


def size_folder(text: str) -> str:
    """Read a size, and return the name of its folder, such as 3mm or 2.5mm."""
    # Only ASCII digits: float() would also accept -0, 1_0 and digits of other scripts.
    if not re.fullmatch(r"[0-9]{1,9}(\.[0-9]{1,9})?|\.[0-9]{1,9}", text) or float(text) >= 100:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size in mm from 0 to below 100")
    label = size_label(float(text))
    if folder_size_mm(label) != float(text):
        raise argparse.ArgumentTypeError(
            f"{text!r} has too many digits: the workflow would ignore the folder {label}/; "
            "give at most four digits, at most three of them after the decimal point"
        )
    return label


def recording_name(text: str) -> str:
    """Read the name of a recording; raise an error if the workflow would pass over this name."""
    repeated = len(text) <= LONGEST_NAME and repeated_end(text)
    if repeated:
        raise argparse.ArgumentTypeError(
            f"{text!r} ends in {repeated!r} twenty times or more; Snakemake takes such a name "
            "for a mistake and stops, so choose another"
        )
    if not classify([Entry(f"{UNLABELLED}/{text}.csv")]).recordings or text.endswith(".csv"):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not allowed as a name: use at most {LONGEST_NAME} letters, digits, "
            "'_', '-', '.' and '+', begin with a letter or digit, and leave out .csv"
        )
    return text
