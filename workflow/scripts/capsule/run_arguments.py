"""Read the options that name a recording and its size, for all commands that write into raw/."""

import argparse
import re

from capsule.naming import UNLABELLED, Entry, classify, folder_size_mm, repeated_end, size_label

LONGEST_NAME = 96  # without .csv


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
