"""Numbers on a command line are read, or refused with what is allowed."""

import argparse

import pytest

from capsule.arguments import natural, number_within, positive


def test_numbers_within_the_limits_are_read():
    assert natural("3") == 3
    assert positive("0.5") == 0.5
    assert [number_within(0, 5)(text) for text in ("0", "2.5", "5")] == [0, 2.5, 5]


@pytest.mark.parametrize(
    ("read", "text", "message"),
    [
        (natural, "0", "'0' is not a whole number of at least 1"),
        (natural, "1.5", "'1.5' is not a whole number of at least 1"),
        (positive, "0", "'0' is not a number above 0"),
        (positive, "inf", "'inf' is not a number above 0"),
        (positive, "fast", "'fast' is not a number above 0"),
        (number_within(0, 5, "mm"), "5.1", "'5.1' is not a number from 0 to 5 mm"),
        (number_within(0.5, 100), "nan", "'nan' is not a number from 0.5 to 100"),
        (number_within(0, 5, "mm"), "wide", "'wide' is not a number from 0 to 5 mm"),
    ],
)
def test_other_texts_are_refused_with_what_is_allowed(read, text, message):
    with pytest.raises(argparse.ArgumentTypeError) as refused:
        read(text)
    assert str(refused.value) == message
