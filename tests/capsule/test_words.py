"""The text of numbers and of unknown values."""

from decimal import Decimal

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from capsule import words

UNKNOWN, OPEN = float("nan"), float("inf")


def estimated(low, high, largest=None, mm=3.2):
    row = {"estimate_mm": mm, "estimate_low_mm": low, "estimate_high_mm": high}
    return words.estimated_size(row, largest)


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        (words.percent(0.5774), "57.7 %"),
        (words.percent(UNKNOWN), "not known"),
        (words.interval(0.6396, 0.9476), "64 to 94.8 %"),
        (words.interval(UNKNOWN, UNKNOWN), "not known"),
        (words.size(0.0), "no nodule"),
        (words.setting([100, 250]), "100 to 250"),
        (words.setting((1, "b")), "1, b"),
        (words.setting(True), "True"),
        (words.setting(18446744073709551615), "18446744073709551615"),
        (words.significant(0.12749), "0.127"),
        (words.significant(-0.001234), "\u22120.00123"),
        (words.significant(0.0), "0"),
        (words.probability(0.0004), "< 0.1 %"),
        (words.probability(0.0006), "0.1 %"),
        (words.probability(0.9996), "> 99.9 %"),
        (words.probability(UNKNOWN), "not given"),
        (words.points(0.125), "+12.5"),
        (words.points(-0.4), "\u221240"),
        (words.points(0.0001), "0"),
        (words.p_value(0.0009), "p < 0.001"),
        (words.p_value(0.001), "p = 0.001"),
        (words.p_value(None), ""),
        (words.enumerate_words([]), ""),
        (words.enumerate_words(["1", "2", "3"]), "1, 2 and 3"),
        (words.plural(1, "recording"), "1 recording"),
        (words.plural(1200, "recording"), "1 200 recordings"),
        (words.plural(2, "place teaches", "places teach"), "2 places teach"),
        (words.duration(0.0999), "under 0.1 s"),
        (words.duration(60), "1 min 0 s"),
        (words.duration(3600), "1 h 0 min"),
        (estimated(2.1, 4.0), "3.2 mm (2.1 to 4.0)"),
        (estimated(2.1, OPEN), "3.2 mm (2.1 mm or more)"),
        (estimated(2.1, OPEN, 5.0), "3.2 mm (2.1 to 5 mm or more)"),
        (estimated(5.0, OPEN, 5.0), "3.2 mm (5.0 mm or more)"),
        (estimated(UNKNOWN, 4.0), "3.2 mm"),
        (estimated(2.1, UNKNOWN), "3.2 mm"),
        (estimated(2.1, 4.0, mm=UNKNOWN), "not given"),
        (words.verdict({"predicted_mm": UNKNOWN, "no_verdict": "no wave"}), "no verdict: no wave"),
        (words.verdict({"predicted_mm": UNKNOWN, "no_verdict": UNKNOWN}), "no verdict"),
        (words.trace([0, 5, None, 9, 10], "_-^"), "_- -^"),
        (words.trace([3, 3.4, 4.6], "_-^", 4.0), "___"),
        (words.trace([], "_-^"), ""),
        (words.place(-0.1, 3.0), "before the start"),
        (words.place(0.0, UNKNOWN), "0.0 s"),
        (words.place(12.3, 6.1), "12.3 s, 6.1 mm"),
        (words.place(None, 6.1), "not given"),
    ],
)
def test_numbers_read_as_words(written, expected):
    assert written == expected


@given(st.floats(-1e9, 1e9), st.integers(0, 6))
@example(67108864.859375, 5)
def test_a_number_is_rounded_once_with_a_real_minus_sign_and_none_before_a_zero(value, digits):
    text = words.number(value, digits)
    read = Decimal(text.replace("\u2212", "-"))
    assert "-" not in text and (text[0] == "\u2212") == (read < 0)
    # In decimals: a float cannot hold all digits of a large number.
    assert abs(read - Decimal(value)) <= Decimal("0.5").scaleb(-digits)
    assert len(text.partition(".")[2]) == digits


@given(st.lists(st.floats(0, 1), min_size=3, max_size=3).map(sorted))
def test_no_interval_is_shown_that_leaves_out_its_rate(ends):
    low, rate, high = ends
    shown_low, shown_high = words.interval(low, high).removesuffix(" %").split(" to ")
    shown = float(words.percent(rate).removesuffix(" %"))
    assert float(shown_low) <= shown <= float(shown_high)
