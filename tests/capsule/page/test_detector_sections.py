"""Tests of the texts on each detector, which claim nothing unknown."""

import pandas as pd
import pytest

from capsule import words
from capsule.page import cells, detector_sections
from support.evaluated import UNKNOWN, evaluated
from support.project import ROOT
from support.sections import page_of

ROWS = [["0mm/a", 0.0, "accepted", UNKNOWN, "bench", "aa", 70.0]]


@pytest.mark.parametrize("scheme", ["held_out", "leave_one_out", "resubstitution"])
def test_the_page_names_the_scheme_that_it_stands_on(scheme):
    values = page_of(evaluated([("0mm/a", 0.0, 0.0)], (0.0,), scheme=scheme), *ROWS)
    assert values["figure_series"] == f"template ({words.scheme(scheme)}) and the paper"


def test_no_section_names_a_scheme_by_itself():
    for path in sorted((ROOT / "workflow/report").rglob("*.j2")):
        if path.name == "glossary.html.j2":  # which says what both of them are
            continue
        text = path.read_text(encoding="utf-8").casefold()
        assert "leave-one-out" not in text and "resubstitution" not in text, path.name


def test_recordings_without_a_verdict_have_a_cell_of_their_own():
    counts = [(0.0, 0.0, 8), (0.0, 2.0, 1), (0.0, UNKNOWN, 1), (2.0, 0.0, 0), (2.0, 2.0, 5)]
    table = pd.DataFrame(counts, columns=["size_mm", "predicted_mm", "count"])
    table["scheme"] = "leave_one_out"
    healthy, nodule = detector_sections.confusion_rows(table, "leave_one_out", [0.0, 2.0])
    assert [cell["count"] for cell in healthy["cells"]] == [8, 1, 1]
    assert [cell["right"] for cell in healthy["cells"]] == [True, False, False]
    assert (healthy["total"], nodule["total"]) == (10, 5)
    assert [cell["count"] for cell in nodule["cells"]] == [0, 5, 0]
    judged = table[table["predicted_mm"].notna()]
    first, _ = detector_sections.confusion_rows(judged, "leave_one_out", [0.0, 2.0])
    assert len(first["cells"]) == 2


def test_a_rate_has_its_interval_and_counts_and_one_that_nobody_counted_is_not_a_number():
    points = pd.DataFrame({"scheme": ["leave_one_out", "paper"], "rate": [0.5, UNKNOWN]})
    points = points.assign(measure="recall", size_mm=2.0, low=0.2, high=0.8, hits=1, of=2)
    table = cells.rate_table(points.assign(one_sided=False), {"recall": "Recall"}, [2.0, 3.0])
    counted, missing = (row["cells"] for row in table["rows"])
    keys = ("text", "interval", "count")
    assert [counted[0][key] for key in keys] == ["50 %", "20 to 80 %", "1 of 2"]
    assert [cell["text"] for cell in counted[1:] + missing] == [
        "not given",
        "not known",
        "not given",
    ]


def test_more_passes_are_rows_and_sizes_are_columns():
    key = {"detector": "diagonal", "detected_low": 0.1, "detected_high": 0.9, "sites": 4}
    judged = [(1, 0.0), (1, 2.0), (2, 0.0)]
    rows = [key | {"passes": n, "size_mm": size, "detected": n / 4} for n, size in judged]
    made = cells.retest_rows(pd.DataFrame(rows))
    assert made["sizes"] == ["no nodule", "2 mm"]
    assert [row["passes"] for row in made["rows"]] == [1, 2]
    assert [cell["text"] for cell in made["rows"][1]["cells"]] == ["50 %", "not known"]
    assert cells.retest_rows(pd.DataFrame(columns=["detector"]))["rows"] == []
