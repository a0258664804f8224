"""The tables of rates: every cell from its table, and nothing said that is not known."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from capsule import words
from capsule.evaluation.answers import Estimate
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.measures import measure_tables
from capsule.page import comparison, detector_sections
from capsule.page.cells import rate_table, retest_rows
from capsule.seeding import generator
from support.evaluated import RULES, UNKNOWN, evaluated
from support.sections import page_of, section
from support.verdicts import index_of, verdicts

SETTINGS = {"detectors": ["template", "diagonal"], "evaluation": RULES}
SCHEMES = ["held_out", "leave_one_out", "resubstitution"]
BRIER = "Brier score of the probability"


def judged(detector, scheme="leave_one_out", false_alarms=5, probability=False):
    """Judge 10 healthy recordings and 10 each of 1 and 3 mm; only the healthy ones are mistaken."""
    size_mm = np.repeat([0.0, 1.0, 3.0], 10)
    alarms = np.arange(30) < false_alarms
    predicted_mm = size_mm + alarms
    score = size_mm + generator(1, "comparison", detector).normal(0, 0.5, 30)
    found = np.where(predicted_mm > 0, 1.0, np.nan)
    said = {"estimate_mm": found * (predicted_mm + 0.2), "location_mm": 4.0 * found}
    said |= {"probability": 1 / (1 + np.exp(-score)) if probability else np.nan}
    said |= {"score": score, "threshold": 0.5}
    return verdicts(zip(size_mm, predicted_mm, strict=True), detector, scheme, **said)


def compared(*judged_by, where=("",) * 30):
    """Compare the detectors by all schemes, from all tables, as the rule evaluate makes them."""
    tables = {name: pd.DataFrame(columns=each) for name, each in COLUMNS.items()}
    if judged_by:
        index = index_of(judged_by[0], nodule_at_mm=where)
        tables = measure_tables(pd.concat(judged_by), [0.0], SETTINGS["evaluation"], index)
    return comparison.page_values(tables, SCHEMES, SETTINGS, "diagonal")


@pytest.fixture(scope="module")
def tables():
    """Return what is compared by each scheme, by its title."""
    page = compared(
        judged("template"),
        judged("diagonal", false_alarms=1, probability=True),
        judged("template", "held_out"),
        judged("diagonal", "held_out", 1),
        judged("template", "resubstitution"),
        where=[*[""] * 20, *[3.0] * 10],
    )
    return {table["title"]: table for table in page["compared"]}


LEFT_OUT, HELD_OUT = "leave-one-out", "held-out sessions"


def test_each_scheme_but_resubstitution_has_a_table_of_all_detectors_the_leading_one_first(tables):
    assert list(tables) == [HELD_OUT, LEFT_OUT]
    for table in tables.values():
        names = [detector["name"] for detector in table["detectors"]]
        assert names == ["diagonal", "template", "always_nodule"]
        titles = [row["title"] for group in table["groups"] for row in group["rows"]]
        ranked = [title for title in titles if "AUC" in title]
        assert ranked == ["AUC, any nodule against none", "AUC, 1 mm against none"]
    calibration = [(row["detector"], row["recordings"]) for row in tables[LEFT_OUT]["calibration"]]
    assert {name for name, _ in calibration} == {"diagonal"}
    assert sum(count for _, count in calibration) == 30


@pytest.mark.parametrize(
    ("scheme", "title", "detector", "text", "count"),
    [
        # Leaving one out does not measure what the threshold sets.
        (LEFT_OUT, "Specificity", "diagonal", "set to 95 %", ""),
        (LEFT_OUT, "Specificity", "template", "50 %", ""),
        (LEFT_OUT, "Specificity, difference", "diagonal", words.NOT_APPLICABLE, ""),
        (LEFT_OUT, "Sensitivity, difference", "diagonal", "0", "p = 1.000"),
        (LEFT_OUT, "Sensitivity, 1 mm", "diagonal", "100 %", ""),
        (LEFT_OUT, "Balanced accuracy", "always_nodule", "50 %", ""),
        (LEFT_OUT, "Mean absolute error, of those found", "diagonal", "0.20 mm", "20 of 20"),
        (LEFT_OUT, "Median error of the place", "diagonal", "1.00 mm", "10 recordings"),
        (LEFT_OUT, BRIER, "diagonal", "0.216", "always stating the prevalence: 0.090"),
        # What a detector does not say is marked.
        (LEFT_OUT, BRIER, "template", words.NOT_APPLICABLE, ""),
        (HELD_OUT, "Specificity", "diagonal", "90 %", ""),
        (HELD_OUT, "Specificity, difference", "template", "reference", ""),
        # 4 recordings more, none fewer: McNemar's p is twice the tail of 0 of 4.
        (HELD_OUT, "Specificity, difference", "diagonal", "+40", "p = 0.125"),
        (HELD_OUT, "Specificity, difference", "always_nodule", words.NOT_APPLICABLE, ""),
    ],
)
def test_a_cell_is_of_its_table_or_says_why_not(tables, scheme, title, detector, text, count):
    table = tables[scheme]
    rows = {row["title"]: row["cells"] for group in table["groups"] for row in group["rows"]}
    place = [each["name"] for each in table["detectors"]].index(detector)
    assert (rows[title][place]["text"], rows[title][place]["count"]) == (text, count)


def test_a_detector_without_a_verdict_is_named_and_without_any_nothing_is_compared():
    assert compared(judged("template", "held_out"))["silent"] == ["diagonal"]
    assert compared()["compared"] == []
    assert compared()["silent"] == ["template", "diagonal"]


def test_only_benches_that_judged_and_had_no_other_part_are_shown():
    rates = {"specificity": "0.95", "recall at 1 mm": "0.1", "recall from 2 mm": "0.4"}
    rows = [
        {"detector": detector, "part": part, "of the benches the": "worst", "bench": part, **rates}
        for detector in ("diagonal", "other")
        for part in ("chose", "judged only")
    ]
    shown = comparison.bench_rows(rows, ["diagonal", "template"])
    assert shown == rows[1:2]
    text = section("detectors", **page_of(evaluated([])) | {"benches": shown})
    assert "<td>judged only</td><td>95 %</td><td>10 %</td><td>40 %</td>" in text


def test_recordings_without_a_verdict_have_a_cell_of_their_own():
    counts = [(0.0, 0.0, 8), (0.0, 2.0, 1), (0.0, UNKNOWN, 1), (2.0, 0.0, 0), (2.0, 2.0, 5)]
    table = pd.DataFrame(counts, columns=["size_mm", "predicted_mm", "count"])
    healthy, nodule = detector_sections.confusion_rows(table, [0.0, 2.0])
    cells = [tuple(cell[key] for key in ("count", "share", "right")) for cell in healthy["cells"]]
    assert cells == [(8, 3, True), (1, 0, False), (1, 0, False)]
    assert (healthy["total"], nodule["total"]) == (10, 5)
    assert [cell["count"] for cell in nodule["cells"]] == [0, 5, 0]
    first, _ = detector_sections.confusion_rows(table.dropna(), [0.0, 2.0])
    assert len(first["cells"]) == 2


def test_a_rate_has_its_interval_and_counts_and_one_that_nobody_counted_is_not_a_number():
    schemes = ["leave_one_out", "resubstitution", "paper"]
    points = pd.DataFrame({"scheme": schemes, "rate": [0.5, 0.5, UNKNOWN]})
    points = points.assign(low=[0.2, UNKNOWN, UNKNOWN], high=0.8, hits=1, of=2)
    points = points.assign(measure="recall", size_mm=2.0, one_sided=False)
    table = rate_table(points, {"recall": "Recall"}, [2.0, 3.0])
    # Kills: heads in another order than the cells.
    assert table["heads"] == [f"Recall, {words.scheme(name)}" for name in schemes]
    (counted, unbounded, unprinted), missing = (row["cells"] for row in table["rows"])
    keys = ("text", "interval", "count")
    assert [counted[key] for key in keys] == ["50 %", "20 to 80 %", "1 of 2"]
    assert [unbounded[key] for key in keys] == ["50 %", "", "1 of 2"]
    assert unprinted["text"] == "not given"
    assert [cell["text"] for cell in missing] == ["not known", "not known", "not given"]


def test_more_passes_are_rows_and_sizes_are_columns():
    key = {"detector": "diagonal", "detected_low": 0.1, "detected_high": 0.9, "sites": 4}
    judged = [(1, 0.0), (1, 2.0), (2, 0.0)]
    rows = [key | {"passes": n, "size_mm": size, "detected": n / 4} for n, size in judged]
    made = retest_rows(pd.DataFrame(rows))
    assert made["sizes"] == ["no nodule", "2 mm"]
    assert [row["passes"] for row in made["rows"]] == [1, 2]
    assert [cell["text"] for cell in made["rows"][1]["cells"]] == ["50 %", "not known"]
    assert retest_rows(pd.DataFrame(columns=COLUMNS["retest"]))["rows"] == []


# Kills: the ratio of the odds upside down, the wrong "no nodule" verdicts taken for the right ones.
def test_the_slider_says_what_follows_from_sensitivity_and_specificity():
    def right(prevalence, sensitivity=0.9, specificity=0.8):
        ill, healthy = prevalence, 1 - prevalence
        ppv = sensitivity * ill / (sensitivity * ill + (1 - specificity) * healthy)
        npv = specificity * healthy / (specificity * healthy + (1 - sensitivity) * ill)
        return ppv, npv

    ours = SimpleNamespace(meaning=[Estimate(share, share, 1.0) for share in right(0.1)])
    said = detector_sections.meaning_values(ours, 0.1)
    assert said["percent"] == pytest.approx(10)
    assert len(said["moved"]) == detector_sections.MOST_PREVALENT
    assert said["moved"][10] == {name: said[name] for name in ("ppv", "npv")}
    for percent in (1, 37, 60):
        ppv, npv = right(percent / 100)
        assert said["moved"][percent] == {
            "ppv": Estimate(ppv, ppv, 1.0).in_hundred(),
            "npv": Estimate(1 - npv, 0.0, 1 - npv).in_hundred(),
        }
