"""Numbers read as words, and what is not known is said so."""

import pytest

from capsule import words

UNKNOWN = float("nan")


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        (words.percent(15 / 26), "57.7 %"),
        (words.percent(0.85), "85 %"),
        (words.percent(UNKNOWN), "not known"),
        (words.interval(0.6396, 0.9476), "64 to 95 %"),
        (words.interval(UNKNOWN, UNKNOWN), "not known"),
        (words.size(2.5), "2.5 mm"),
        (words.size(0.0), "no nodule"),
        (words.size(UNKNOWN), "not known"),
        (words.setting([100, 250]), "100 to 250"),
        (words.setting(["leave_one_out", "resubstitution"]), "leave_one_out, resubstitution"),
        (words.enumerate_words(["1", "2", "3"]), "1, 2 and 3"),
        (words.plural(1, "recording"), "1 recording"),
        (words.plural(1200, "recording"), "1 200 recordings"),
        (words.duration(0.04), "under 0.1 s"),
        (words.duration(4.21), "4.2 s"),
        (words.duration(81.4), "1 min 21 s"),
        (words.duration(7500), "2 h 5 min"),
    ],
)
def test_numbers_read_as_words(written, expected):
    assert written == expected


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        (words.points(0.125), "+12.5"),
        (words.points(-0.4), "\u221240"),
        (words.points(0.0001), "0"),
        (words.p_value(0.0004), "p < 0.001"),
        (words.p_value(0.0313), "p = 0.031"),
        (words.estimated_size({"estimate_mm": 2.0}), "2.0 mm"),
        (
            words.estimated_size(
                {"estimate_mm": 3.16, "estimate_low_mm": 2.1, "estimate_high_mm": 4.0}
            ),
            "3.2 mm (2.1 to 4.0)",
        ),
        (words.estimated_size({"estimate_mm": UNKNOWN}), words.NOT_GIVEN),
        (words.place(-5.7, None), "before the start"),
        (words.place(9.26, 4.5), "9.3 s, 4.5 mm"),
        (words.place(float("nan"), None), words.NOT_GIVEN),
    ],
)
def test_differences_and_places_read_as_words(written, expected):
    assert written == expected
