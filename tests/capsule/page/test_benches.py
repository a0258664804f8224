"""Tests of the page's table of detectors on other benches."""

from capsule.page.benches import page_values

RATES = ("specificity", "recall at 1 mm", "recall from 2 mm")
ROWS = [
    {"detector": detector, "part": part, "of the benches the": which, "bench": bench}
    | dict(zip(RATES, rates, strict=True))
    for detector, part, which, bench, rates in [
        ("diagonal", "chose", "worst", "uneven", ("0.95", "0.8", "0.9")),
        ("diagonal", "chose", "best", "usual", ("0.95", "0.9", "0.99")),
        ("diagonal", "judged only", "worst", "steep", ("0.95", "0.1", "0.4")),
        ("diagonal", "judged only", "best", "calm", ("0.95", "0.9", "1.0")),
        ("diagonal", "judged only", "least specific", "steep", ("0.812", "0.1", "0.4")),
        ("other", "judged only", "worst", "steep", ("0.9", "0.0", "0.2")),
        ("other", "judged only", "best", "calm", ("0.9", "0.5", "0.7")),
    ]
]


def test_the_range_stands_in_one_sentence_and_in_a_table():
    page = page_values(ROWS, ["diagonal", "other"], "simulated")
    assert page["on_other_benches"].endswith(
        "nodules from 2 mm on: diagonal 40 % to 100 %, with a specificity from 81.2 % on; other "
        "20 % to 70 %."
    )
    assert page["bench_rows"][0] == {
        "detector": "diagonal",
        "which": "worst",
        "bench": "steep",
        "rates": ["95 %", "10 %", "40 %"],
    }


def test_only_detectors_that_judge_the_archive_are_named():
    assert "diagonal" not in page_values(ROWS, ["other"], "simulated")["on_other_benches"]
    assert page_values(ROWS, ["template"], "simulated") == {
        "bench_rows": [],
        "on_other_benches": "",
    }


def test_only_benches_that_judged_and_had_no_other_part_are_shown():
    page = page_values(ROWS, ["diagonal"], "simulated")
    assert [row["bench"] for row in page["bench_rows"]] == ["steep", "calm", "steep"]
    assert "simulated benches, which taught and chose nothing" in page["on_other_benches"]
    without = [{name: text for name, text in row.items() if name != "part"} for row in ROWS]
    assert page_values(without, ["diagonal"], "simulated")["bench_rows"] == []


def test_of_real_recordings_a_range_of_simulated_benches_is_never_told_as_theirs():
    for origin in ("recorded", "mixed", "unknown"):
        text = page_values(ROWS, ["diagonal"], origin)["on_other_benches"]
        assert text.startswith("Not of this archive: on other simulated benches")
        assert text.endswith("and say nothing about the bench of this archive.")
