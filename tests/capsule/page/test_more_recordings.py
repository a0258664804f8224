"""Tests of the page's advice on more recordings, from tables written by hand."""

import pandas as pd
import pytest

from capsule.evaluation.intervals import rate, recordings_needed
from capsule.evaluation.learning import COLUMNS
from capsule.page.more_recordings import (
    learning_rows,
    needed_rows,
)
from support.evaluated import UNKNOWN, evaluated, rates_of


def curve(first_mm, last_mm, half, gain):
    """Make the rows of one curve: the same up to a half, and the gain with its interval."""
    value, low, high = gain
    row = {"detector": "taught", "size_from_mm": first_mm, "size_to_mm": last_mm, "judged": 20}
    row |= {"rate_low": 0.0, "rate_high": 1.0}
    before = row | {"rate": half, "gain": value, "gain_low": low, "gain_high": high}
    after = row | dict.fromkeys(("gain", "gain_low", "gain_high"), UNKNOWN)
    parts = [before | {"share": share, "taught": 40 * share} for share in (0.25, 0.5, 0.75)]
    return [*parts, after | {"rate": half + value, "share": 1.0, "taught": 39.0}]


def table(*curves):
    rows = [{"taught_healthy": row["taught"] / 4} | row for each in curves for row in each]
    return pd.DataFrame(rows, columns=COLUMNS)


@pytest.mark.parametrize(
    ("gain", "expected"),
    [
        ((0.1, 0.02, 0.18), "found at 1 mm 50 % and 60 %: more recordings are likely to help."),
        (
            (0.0, -0.04, 0.04),
            "found at 1 mm 50 % and 50 %: more recordings are not likely to help.",
        ),
        (
            (-0.1, -0.18, -0.02),
            "found at 1 mm 50 % and 40 %: more recordings are not likely to help.",
        ),
        (
            (0.1, -0.05, 0.25),
            "found at 1 mm 50 % and 60 %: this can be chance; too few recordings to tell.",
        ),
        ((UNKNOWN, UNKNOWN, UNKNOWN), "nothing to compare yet."),
    ],
)
def test_the_interval_of_the_gain_decides_whether_more_are_likely_to_help(gain, expected):
    (sentence,) = learning_rows(table(curve(1.0, 1.0, 0.5, gain)))["sentences"]
    assert sentence == {"detector": "taught", "text": expected}


def test_rates_of_which_the_same_is_said_stand_together():
    gains = (0.25, 0.1, 0.4), (0.0, -0.2, 0.2), (0.25, 0.1, 0.4)
    sizes_mm = (0.0, 0.0), (1.0, 1.0), (2.0, 2.0)
    curves = [curve(*each, 0.5, gain) for each, gain in zip(sizes_mm, gains, strict=True)]
    (sentence,) = learning_rows(table(*curves))["sentences"]
    assert sentence["text"].startswith(
        "specificity 50 % and 75 %, found at 2 mm 50 % and 75 %: more rec"
    )


def test_the_table_shows_specificity_the_smallest_size_and_all_larger_ones():
    gain = 0.0, -0.1, 0.1
    sizes_mm = [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0), (2.0, 3.0)]
    shown = learning_rows(table(*(curve(*each, 0.5, gain) for each in sizes_mm)))
    assert [row["title"] for row in shown["rows"]] == [
        "specificity",
        "found at 1 mm",
        "found from 2 mm on",
    ]
    assert [share["taught"] for share in shown["shares"]] == [
        "10 (2)",
        "20 (5)",
        "30 (8)",
        "39 (10)",
    ]
    assert [cell["text"] for cell in shown["rows"][0]["cells"]] == ["50 %"] * 4
    assert (shown["rows"][0]["gain"]["text"], shown["rows"][0]["gain"]["interval"]) == (
        "0",
        "\u221210 to +10",
    )


def test_of_no_curve_nothing_is_said():
    assert learning_rows(table()) == {"shares": [], "rows": [], "sentences": []}


def test_every_rate_says_how_many_recordings_it_takes_and_how_many_are_missing():
    verdicts = [(f"0mm/{run}", 0.0, 0.0 if run else 2.0) for run in range(20)]
    verdicts += [(f"2mm/{run}", 2.0, 2.0) for run in range(30)]
    healthy, nodules = needed_rows(rates_of(evaluated(verdicts, (0.0, 2.0))))["rows"]
    takes = recordings_needed(0.95, 0.1, 0.95)
    assert (healthy["title"], healthy["recordings"]) == ("specificity", 20)
    assert healthy["missing"] == takes - 20
    assert healthy["cells"][0]["text"] == "95 %"
    assert healthy["cells"][0]["count"].startswith(f"needs {takes}, at most ")
    assert (nodules["title"], nodules["missing"]) == ("found at 2 mm", 0)


@pytest.mark.parametrize(("hits", "widest"), [(18, "low"), (2, "high"), (10, "half")])
def test_of_all_rates_in_an_interval_the_one_nearest_to_a_half_needs_most(hits, widest):
    verdicts = [(f"2mm/{run}", 2.0, 2.0 * (run < hits)) for run in range(20)]
    (row,) = needed_rows(rates_of(evaluated(verdicts, (0.0, 2.0))))["rows"]
    _, low, high = rate(hits, 20, 0.95)
    most = recordings_needed({"low": low, "high": high, "half": 0.5}[widest], 0.1, 0.95)
    assert row["cells"][0]["count"].endswith(f", at most {most}")


def test_a_specificity_that_the_threshold_sets_needs_no_recording():
    verdicts = [(f"0mm/{run}", 0.0, 0.0 if run else 2.0) for run in range(20)]
    rates = rates_of(evaluated(verdicts, (0.0, 2.0), ("template", "diagonal")))
    (healthy,) = needed_rows(rates)["rows"]
    assert [cell["text"] for cell in healthy["cells"]] == ["95 %", "set by the threshold"]
    assert "needs" not in healthy["cells"][1]["count"]


def test_a_size_without_a_recording_has_no_row():
    rows = needed_rows(rates_of(evaluated([("2mm/a", 2.0, 2.0)])))["rows"]
    assert [row["title"] for row in rows] == ["found at 2 mm"]
    assert needed_rows(rates_of(evaluated([]))) == {
        "detectors": ["template"],
        "rows": [],
        "sentence": "",
    }


def test_a_sentence_says_how_many_more_recordings_of_which_size_are_needed():
    one = [("2mm/a", 2.0, 2.0)]
    (row,) = (needed := needed_rows(rates_of(evaluated(one))))["rows"]
    assert needed["sentence"].endswith(f"needs more recordings: {row['missing']} of 2 mm.")
    enough = [(f"2mm/{number}", 2.0, 2.0) for number in range(row["missing"] + 1)]
    assert needed_rows(rates_of(evaluated(enough)))["sentence"].startswith("Each rate of each")
