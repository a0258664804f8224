"""Tests of the page's table of detectors on other benches."""

from capsule.page.benches import page_values

RATES = ("specificity", "recall at 1 mm", "recall from 2 mm")
ROWS = [
    {"detector": detector, "of the benches the": which, "bench": bench}
    | dict(zip(RATES, rates, strict=True))
    for detector, which, bench, rates in [
        ("diagonal", "worst", "steep", ("0.95", "0.1", "0.4")),
        ("diagonal", "best", "calm", ("0.95", "0.9", "1.0")),
        ("other", "worst", "steep", ("0.9", "0.0", "0.2")),
        ("other", "best", "calm", ("0.9", "0.5", "0.7")),
    ]
]


def test_the_range_stands_in_one_sentence_and_in_a_table():
    page = page_values(ROWS, ["diagonal", "other"])
    assert page["on_other_benches"].endswith(
        "nodules from 2 mm on: diagonal 40 % to 100 %; other 20 % to 70 %."
    )
    assert page["bench_rows"][0] == {
        "detector": "diagonal",
        "which": "worst",
        "bench": "steep",
        "rates": ["95 %", "10 %", "40 %"],
    }


def test_only_detectors_that_judge_the_archive_are_named():
    assert "diagonal" not in page_values(ROWS, ["other"])["on_other_benches"]
    assert page_values(ROWS, ["template"]) == {"bench_rows": [], "on_other_benches": ""}
