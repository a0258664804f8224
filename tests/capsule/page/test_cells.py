"""The cells of the report's tables."""

import pandas as pd

from capsule.page import cells

UNKNOWN, OPEN = float("nan"), float("inf")


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
        "taught": ("estimate_mm", 2.9, "estimate_low_mm", 2.5, "estimate_high_mm", OPEN),
    }
    verdicts = [
        {**found, "detector": detector, **dict(zip(each[::2], each[1::2], strict=True))}
        for detector, each in sizes.items()
    ]
    (row,) = cells.detection_rows(pd.DataFrame(verdicts), 5.0)["rows"]
    assert [verdict["estimate"] for verdict in row["verdicts"]] == [
        "3.0 mm",
        "3.2 mm (2.1 to 4.0)",
        "2.9 mm (2.5 to 5 mm or more)",
    ]


def test_recordings_without_a_verdict_have_a_cell_of_their_own():
    counts = [(0.0, 0.0, 8), (0.0, 2.0, 1), (0.0, UNKNOWN, 1), (2.0, 0.0, 0), (2.0, 2.0, 5)]
    table = pd.DataFrame(counts, columns=["size_mm", "predicted_mm", "count"])
    table["scheme"] = "leave_one_out"
    healthy, nodule = cells.confusion_rows(table, "leave_one_out", [0.0, 2.0])
    assert [cell["count"] for cell in healthy["cells"]] == [8, 1, 1]
    assert [cell["right"] for cell in healthy["cells"]] == [True, False, False]
    assert (healthy["total"], nodule["total"]) == (10, 5)
    assert [cell["count"] for cell in nodule["cells"]] == [0, 5, 0]
    judged = table[table["predicted_mm"].notna()]
    first, _ = cells.confusion_rows(judged, "leave_one_out", [0.0, 2.0])
    assert len(first["cells"]) == 2
