"""Numbers on a command line are read, or refused with what is allowed."""

from argparse import ArgumentTypeError

import pytest

from capsule.commands.options import natural, number_within, positive, recording_name, size_folder

TO_5_MM = number_within(0, 5, "mm")


def test_what_is_allowed_is_read():
    sizes = {"3": "3mm", "2.50": "2.5mm", ".5": "0.5mm", "0": "0mm", "99.9": "99.9mm"}
    assert {text: size_folder(text) for text in sizes} == sizes
    assert [natural("1"), positive("0.5"), *map(TO_5_MM, ("0", "2.5", "5"))] == [1, 0.5, 0, 2.5, 5]
    names = ["r01", "a" * 19, "r-1_2.x+y", "ab1-_" * 19 + "x"]
    assert [*map(recording_name, names)] == names


def test_other_texts_are_refused_with_what_is_allowed():
    for read, texts, allowed in (
        (natural, ["0", "1.5"], "is not a whole number of at least 1$"),
        (positive, ["0", "inf", "fast"], "is not a number above 0$"),
        (TO_5_MM, ["-0.1", "5.1", "wide"], "is not a number from 0 to 5 mm$"),
        (number_within(0.5, 100), ["nan"], "is not a number from 0.5 to 100$"),
        (size_folder, ["", "-0", "1_0", "3mm", "1e1", "٣", "nan", "100", "1000", "5."],
         "is not a size in mm from 0 to below 100$"),
        (size_folder, ["1.2345"], r"has too many digits: .* ignore the folder 1\.2345mm/;"),
        # The workflow would pass over these names.
        (recording_name, ["", "-r", "a b", "r/1", "r.csv", "é", "ab1-_" * 19 + "xy", "a" * 97],
         "is not allowed as a name: use at most 96"),
        (recording_name, ["a" * 96], "ends in 'a' twenty times or more"),
    ):  # fmt: skip
        for text in texts:
            with pytest.raises(ArgumentTypeError, match=f"^{text!r} {allowed}"):
                read(text)
