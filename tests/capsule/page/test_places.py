"""Places that were passed several times: one verdict each, and what more passes bring."""

import pandas as pd

from capsule.page import places

UNKNOWN = float("nan")


def test_the_page_has_a_row_a_place_and_a_column_a_detector():
    rows = [
        ["a", 0.0, 2, "template", True, 2.0, *[UNKNOWN] * 3],
        ["a", 0.0, 2, "diagonal", False, *[UNKNOWN] * 4],
        ["p", UNKNOWN, 3, "template", *[UNKNOWN] * 5],
        ["p", UNKNOWN, 3, "diagonal", True, 3.14, 5.0, 2.2, float("inf")],
        ["q", UNKNOWN, 2, "template", True, *[UNKNOWN] * 4],
        ["q", UNKNOWN, 2, "diagonal", True, UNKNOWN, 5.0, *[UNKNOWN] * 2],
    ]
    columns = ["site", "size_mm", "recordings", "detector", "detected", "estimate_mm"]
    columns += ["location_mm", "estimate_low_mm", "estimate_high_mm"]
    made = places.place_rows(pd.DataFrame(rows, columns=columns), 5.0)
    assert made["detectors"] == ["template", "diagonal"]
    assert [(row["site"], row["size"], row["recordings"]) for row in made["rows"]] == [
        ("a", "no nodule", 2),
        ("p", "unlabelled", 3),
        ("q", "unlabelled", 2),
    ]
    assert made["rows"][0]["verdicts"] == ["nodule of 2.0 mm", "no nodule"]
    assert made["rows"][1]["verdicts"] == [
        "no verdict",
        "nodule of 3.1 mm (2.2 to 5 mm or more), at 5.0 mm",
    ]
    assert made["rows"][2]["verdicts"] == ["nodule", "nodule, at 5.0 mm"]
    assert places.place_rows(pd.DataFrame(columns=columns), 5.0)["rows"] == []


def test_more_passes_are_rows_and_sizes_are_columns():
    key = {"detector": "diagonal", "detected_low": 0.1, "detected_high": 0.9, "sites": 4}
    rows = [key | {"passes": n, "size_mm": size, "detected": 0.25 * n} for n in (1, 2) for size in (0.0, 2.0)]  # fmt: skip  # noqa: E501
    made = places.retest_rows(pd.DataFrame(rows[:-1]))
    assert made["sizes"] == ["no nodule", "2 mm"]
    assert [row["passes"] for row in made["rows"]] == [1, 2]
    assert [cell["text"] for cell in made["rows"][1]["cells"]] == ["50 %", "not known"]
    assert places.retest_rows(pd.DataFrame(columns=["detector"]))["rows"] == []
