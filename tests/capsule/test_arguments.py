"""Numbers on a command line are read, or refused with what is allowed."""

import argparse
from argparse import ArgumentTypeError

import pytest

from capsule.arguments import natural, number_within, positive, recording_name, size_folder


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


@pytest.mark.parametrize(
    ("text", "folder"),
    [("3", "3mm"), ("2.50", "2.5mm"), (".5", "0.5mm"), ("0", "0mm"), ("99.9", "99.9mm")],
)
def test_a_size_names_its_folder(text, folder):
    assert size_folder(text) == folder


@pytest.mark.parametrize("text", ["", "-0", "1_0", "3mm", "1e1", "٣", "nan", "100", "1000", "5."])
def test_what_is_no_size_is_refused(text):
    with pytest.raises(ArgumentTypeError, match="is not a size in mm from 0 to below 100"):
        size_folder(text)


def test_a_size_whose_folder_the_workflow_would_ignore_is_refused():
    with pytest.raises(ArgumentTypeError, match=r"ignore the folder 1\.2345mm/"):
        size_folder("1.2345")


def test_a_name_is_taken_if_the_workflow_reads_it():
    for name in ("r01", "a" * 19, "r-1_2.x+y", "ab1-_" * 19 + "x"):
        assert recording_name(name) == name
    for name in ("", "-r", "a b", "r/1", "r.csv", "é", "ab1-_" * 19 + "xy"):
        with pytest.raises(ArgumentTypeError, match="is not allowed as a name: use at most 96"):
            recording_name(name)
    with pytest.raises(ArgumentTypeError, match="ends in 'a' twenty times or more"):
        recording_name("a" * 96)
    with pytest.raises(ArgumentTypeError, match="is not allowed as a name"):
        recording_name("a" * 97)
