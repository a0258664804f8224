"""The cells of the report's tables."""

import re

import pandas as pd

from capsule.page import cells
from support.sections import section

UNKNOWN, OPEN = float("nan"), float("inf")


def test_a_rate_that_nobody_counted_is_not_a_number():
    point = {"rate": UNKNOWN, "low": UNKNOWN, "high": UNKNOWN}
    assert cells.rate_cell(point, "leave_one_out")["text"] == "not known"
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
    table = pd.DataFrame(verdicts)
    said = section(
        "unlabelled", detections=table, largest_mm=5.0, size_confidence="90 %", prevalence="10 %"
    )
    for estimate in ("3.0 mm", "3.2 mm (2.1 to 4.0)", "2.9 mm (2.5 to 5 mm or more)"):
        assert f"<td>{estimate}</td>" in said


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
    sites = pd.DataFrame(rows, columns=columns)
    values = {"retest": {"rows": []}, "largest_mm": 5.0, "size_confidence": "90 %"}
    said = section("places", sites=sites, **values)
    assert re.findall("<th scope=.col. data-of=.(.*?).>", said) == ["template", "diagonal"]
    told = [re.findall("<t[hd].*?>(.*?)</t[hd]>", row) for row in said.split("<tr>")[2:]]
    assert told == [
        ["<code>a</code>", "no nodule", "2", "nodule of 2.0 mm", "no nodule"],
        [
            *("<code>p</code>", "unlabelled", "3", "no verdict"),
            "nodule of 3.1 mm (2.2 to 5 mm or more), at 5.0 mm",
        ],
        ["<code>q</code>", "unlabelled", "2", "nodule", "nodule, at 5.0 mm"],
    ]
    assert section("places", sites=sites[:0]).strip() == ""


def test_more_passes_are_rows_and_sizes_are_columns():
    key = {"detector": "diagonal", "detected_low": 0.1, "detected_high": 0.9, "sites": 4}
    rows = [key | {"passes": n, "size_mm": size, "detected": 0.25 * n} for n in (1, 2) for size in (0.0, 2.0)]  # fmt: skip  # noqa: E501
    made = cells.retest_rows(pd.DataFrame(rows[:-1]))
    assert made["sizes"] == ["no nodule", "2 mm"]
    assert [row["passes"] for row in made["rows"]] == [1, 2]
    assert [cell["text"] for cell in made["rows"][1]["cells"]] == ["50 %", "not known"]
    assert cells.retest_rows(pd.DataFrame(columns=["detector"]))["rows"] == []
