"""The cells of the report's tables."""

import pandas as pd

from capsule.page import cells

UNKNOWN = float("nan")


def test_a_rate_that_nobody_counted_is_not_a_number():
    point = {"rate": UNKNOWN, "low": UNKNOWN, "high": UNKNOWN}
    assert cells.rate_cell(point, "leave_one_out")["text"] == "not known"
    assert cells.rate_cell(None, "paper")["text"] == "not given"


def test_more_passes_are_rows_and_sizes_are_columns():
    key = {"detector": "diagonal", "detected_low": 0.1, "detected_high": 0.9, "sites": 4}
    rows = [key | {"passes": n, "size_mm": size, "detected": 0.25 * n} for n in (1, 2) for size in (0.0, 2.0)]  # fmt: skip  # noqa: E501
    made = cells.retest_rows(pd.DataFrame(rows[:-1]))
    assert made["sizes"] == ["no nodule", "2 mm"]
    assert [row["passes"] for row in made["rows"]] == [1, 2]
    assert [cell["text"] for cell in made["rows"][1]["cells"]] == ["50 %", "not known"]
    assert cells.retest_rows(pd.DataFrame(columns=["detector"]))["rows"] == []
