"""The report: its answers, its words, and that nothing on the page can run or be misread."""

import pandas as pd
import pytest

from capsule import words
from capsule.page import answers, cells, overview, provenance
from capsule.page.render import render_page

UNKNOWN = float("nan")


def detection(*rates):
    rows = [
        {"size_mm": size, "precision": precision, "recall": recall}
        for size, precision, recall in rates
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("rates", "expected"),
    [
        ([(1, 0.6, 0.9), (2, 0.85, 17 / 20), (3, 1.0, 1.0)], 2.0),
        ([(1, 1.0, 1.0), (2, 0.5, 1.0), (3, 1.0, 1.0)], 3.0),
        ([(1, 1.0, 1.0), (2, 1.0, 0.84)], None),
        ([(1, 1.0, 1.0), (2.5, UNKNOWN, 1.0)], None),
        ([(1, 1.0, UNKNOWN), (2.5, 1.0, 1.0)], 2.5),
    ],
)
def test_reliable_is_a_size_from_which_on_all_are_found(rates, expected):
    assert answers.smallest_reliable_size(detection(*rates), 0.85) == expected


def test_the_mean_error_counts_a_missed_nodule_as_0_mm():
    predictions = pd.DataFrame(
        {"size_mm": [0.0, 2.0, 2.0, 3.0], "predicted_mm": [5.0, 2.0, 0.0, 4.0]}
    )
    error = answers.mean_size_error(predictions, 0.95)
    assert error.value == 1.0
    assert error.of == 3
    # Student's t with 2 degrees of freedom is 4.3027 at 95 %.
    assert error.high == pytest.approx(1.0 + 4.3027 * 1.0 / 3**0.5, abs=1e-3)
    assert error.low == 0.0


def test_without_nodules_there_is_no_size_error():
    predictions = pd.DataFrame({"size_mm": [0.0], "predicted_mm": [0.0]})
    error = answers.mean_size_error(predictions, 0.95)
    assert error.of == 0
    assert words.number(error.value) == "not known"


def test_within_tolerance_pools_counts():
    sizing = pd.DataFrame({"size_mm": [1, 2, 3], "within": [1, 8, 9], "recordings": [10, 10, 10]})
    assert answers.within_tolerance(sizing, 0.95).value == 0.6
    assert answers.within_tolerance(sizing, 0.95, [2, 3]).value == 0.85
    assert answers.within_tolerance(sizing, 0.95, [7]).of == 0


@pytest.mark.parametrize(
    ("sources", "kind"),
    [
        (["simulated phantom"] * 3, "simulated"),
        (["bench 2", "bench 3"], "recorded"),
        (["bench 2", "Simulated"], "mixed"),
        (["bench 2", ""], "mixed"),
        (["", ""], "unknown"),
        ([], "none"),
    ],
)
def test_the_origin_comes_from_what_the_recordings_say(sources, kind):
    assert provenance.origin_of(sources).kind == kind


def test_a_log_tells_how_long_its_script_took():
    assert provenance.seconds_in_log("3mm/r01: ...\nfinished in 0.232 s\n") == 0.232
    assert provenance.seconds_in_log("error: the disk is full\n") is None


def test_the_configuration_is_compared_with_the_paper():
    schema = {
        "properties": {
            "fit": {
                "properties": {
                    "particles": {"symbol": "N", "unit": "1", "description": "Number."},
                    "amplitude_range": {"symbol": "A", "unit": "SD"},
                    "seed": {},
                }
            }
        }
    }
    printed = {
        "fit.particles": {"value": 2000, "where": "eq. particleSet"},
        "fit.amplitude_range": {"value": [0, 1.5], "open_at_low_end": True, "where": "eq. G"},
    }
    config = {"fit": {"seed": 1, "amplitude_range": [0.001, 1.5], "particles": 500}}
    rows = provenance.configuration_table(config, schema, printed)
    assert [row["key"] for row in rows] == ["fit.particles", "fit.amplitude_range", "fit.seed"]
    assert [row["differs"] for row in rows] == [True, False, False]
    assert rows[0]["value"] == "500" and rows[0]["paper"] == "2000"
    assert rows[1]["value"] == "0.001 to 1.5"
    assert provenance.differences(rows) == (
        "Different from the paper: fit.particles is 500 instead of 2000."
    )
    assert provenance.differences(rows[1:]).startswith("Every number that the paper gives")


def test_the_combined_checksum_is_of_sorted_lines():
    first = provenance.combined_checksum({"b": "22", "a": "11"})
    assert first == provenance.combined_checksum({"a": "11", "b": "22"})
    assert first != provenance.combined_checksum({"a": "22", "b": "11"})


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


def test_a_rate_that_nobody_counted_is_not_a_number():
    point = pd.DataFrame([{"rate": UNKNOWN, "low": UNKNOWN, "high": UNKNOWN}]).iloc[0]
    assert cells.rate_cell(point)["text"] == "not known"
    assert cells.rate_cell(None, "paper")["text"] == "not given"


def test_the_overview_lists_what_was_not_used():
    index = pd.DataFrame(
        {
            "recording": ["0mm/a", "2.5mm/b", "2.5mm/bad", "unlabelled/c"],
            "size_mm": [0.0, 2.5, 2.5, UNKNOWN],
            "status": ["accepted", "accepted", "rejected", "accepted"],
            "reason": [UNKNOWN, UNKNOWN, "the file is empty", UNKNOWN],
            "source": ["bench 2", "bench 2", UNKNOWN, "bench 2"],
        }
    )
    passed_over = pd.DataFrame({"path": ["notes.txt"], "reason": ["not a .csv file"]})
    found = overview.overview(index, passed_over)
    assert found["origin"]["kind"] == "recorded"
    assert (found["accepted"], found["unlabelled"]) == (3, 1)
    assert found["by_size"] == [{"size": "no nodule", "count": 1}, {"size": "2.5 mm", "count": 1}]
    assert found["rejected"] == [{"recording": "2.5mm/bad", "reason": "the file is empty"}]


def test_whatever_a_text_holds_it_stays_text():
    evil = '"><script>alert(1)</script>'
    page = render_page("<p title='{{ page }}'>{{ page }}</p>", "", "", {"page": evil})
    assert "<script>" not in page and "&lt;script&gt;" in page


def test_the_policy_allows_this_script_and_no_other():
    template = '<meta content="{{ policy }}"><script>{{ script }}</script>'
    page = render_page(template, "p {}", "a < b && c", {})
    assert "<script>a < b && c</script>" in page
    assert "default-src 'none'" in page and "unsafe" not in page
    assert page.count("'sha256-") == 2


def test_an_end_tag_in_the_script_is_refused():
    with pytest.raises(ValueError, match="end tag"):
        render_page("", "", "x = '</script>'", {})
