"""The rows of the compared detectors: each from a table that exists, and how its cells read."""

import pytest

from capsule import words
from capsule.evaluation.columns import COLUMNS
from capsule.page import compared_rows

UNKNOWN = float("nan")
ROWS = [row for group in compared_rows.GROUPS for row in group.rows]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.title)
def test_a_row_is_of_a_table_that_has_what_it_asks_for(row):
    columns = COLUMNS[row.table]
    assert row.sizes == "all" or "size_mm" in columns
    assert bool(row.measure) == ("measure" in columns)
    assert ("{size}" in row.title) == (row.sizes in ("each", "smallest"))


def test_a_number_has_its_unit_and_its_interval():
    bias = compared_rows.number_of("bias", " mm", "_mm")
    cell = bias({"bias_mm": 0.251, "bias_low_mm": -0.1, "bias_high_mm": 0.6})
    assert (cell["value"], cell["text"]) == (0.251, "0.25 mm")
    assert cell["interval"] == "\u22120.10 to 0.60 mm"
    cell = bias({"bias_mm": 0.251, "bias_low_mm": UNKNOWN, "bias_high_mm": UNKNOWN})
    assert (cell["text"], cell["interval"]) == ("0.25 mm", "")


def test_what_is_not_known_has_no_value():
    row = {"bias_mm": UNKNOWN, "bias_low_mm": UNKNOWN, "bias_high_mm": UNKNOWN}
    cell = compared_rows.number_of("bias", " mm", "_mm")(row)
    assert (cell["value"], cell["text"]) == (None, words.UNKNOWN)
    cell = compared_rows.difference({"difference": UNKNOWN})
    assert (cell["value"], cell["text"]) == (None, words.UNKNOWN)
