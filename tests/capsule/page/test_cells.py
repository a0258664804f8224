"""The cells of the report's tables."""

import pandas as pd

from capsule.page import cells

UNKNOWN = float("nan")


def test_a_rate_that_nobody_counted_is_not_a_number():
    point = pd.DataFrame([{"rate": UNKNOWN, "low": UNKNOWN, "high": UNKNOWN}]).iloc[0]
    assert cells.rate_cell(point)["text"] == "not known"
    assert cells.rate_cell(None, "paper")["text"] == "not given"
