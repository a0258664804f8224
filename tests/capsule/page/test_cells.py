"""The cells of the report's tables."""

import pandas as pd

from capsule.page import cells

UNKNOWN = float("nan")


def test_a_rate_that_nobody_counted_is_not_a_number():
    point = pd.DataFrame([{"rate": UNKNOWN, "low": UNKNOWN, "high": UNKNOWN}]).iloc[0]
    assert cells.rate_cell(point)["text"] == "not known"
    assert cells.rate_cell(None, "paper")["text"] == "not given"


def test_every_detectors_size_stands_with_the_interval_that_it_has():
    found = {"recording": "unlabelled/a", "predicted_mm": 3.0, "probability": 0.9, "rmse_0mm": 0.5}
    found |= {"location_s": UNKNOWN, "location_mm": UNKNOWN}
    sizes = {
        "template": ("estimate_mm", 3.0),
        "diagonal": ("estimate_mm", 3.16, "estimate_low_mm", 2.1, "estimate_high_mm", 4.0),
        "taught": ("estimate_mm", 2.9, "estimate_low_mm", 2.5, "estimate_high_mm", 3.3),
    }
    verdicts = [
        {**found, "detector": detector, **dict(zip(each[::2], each[1::2], strict=True))}
        for detector, each in sizes.items()
    ]
    (row,) = cells.detection_rows(pd.DataFrame(verdicts))["rows"]
    assert [verdict["estimate"] for verdict in row["verdicts"]] == [
        "3.0 mm",
        "3.2 mm (2.1 to 4.0)",
        "2.9 mm (2.5 to 3.3)",
    ]
