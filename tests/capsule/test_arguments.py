"""Numbers on a command line are read, or refused with what is allowed."""

from argparse import ArgumentTypeError

import pytest

from capsule.arguments import natural, number_within, positive, recording_name, size_folder


@pytest.mark.parametrize(
    ("read", "text", "value"),
    [
        (natural, "1", 1),
        (positive, "0.5", 0.5),
        *((number_within(0, 5), text, float(text)) for text in ("0", "2.5", "5")),
    ],
)
def test_numbers_within_the_limits_are_read(read, text, value):
    assert read(text) == value


@pytest.mark.parametrize(
    ("read", "texts", "allowed"),
    [
        (natural, ["0", "1.5"], "a whole number of at least 1"),
        (positive, ["0", "inf", "fast"], "a number above 0"),
        (number_within(0, 5, "mm"), ["-0.1", "5.1", "wide"], "a number from 0 to 5 mm"),
        (number_within(0.5, 100), ["nan"], "a number from 0.5 to 100"),
    ],
)
def test_other_texts_are_refused_with_what_is_allowed(read, texts, allowed):
    for text in texts:
        with pytest.raises(ArgumentTypeError) as refused:
            read(text)
        assert str(refused.value) == f"{text!r} is not {allowed}"


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
