"""The detectors side by side: every cell from its table, and nothing said that is not known."""

import numpy as np
import pandas as pd
import pytest

from capsule import words
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.measures import measure_tables
from capsule.page import comparison
from capsule.page.cells import cell_of
from capsule.seeding import generator
from support.verdicts import index_of, verdicts

SETTINGS = {
    "detectors": ["template", "diagonal"],
    "evaluation": {
        "tolerance_mm": 1.0,
        "confidence": 0.95,
        "specificity": 0.95,
        "prevalence": 0.1,
        "calibration_bins": 2,
        "passes": [1],
    },
}
UNKNOWN = float("nan")
SCHEMES = ["leave_one_out", "resubstitution"]


def judged(detector, scheme="leave_one_out", false_alarms=5, probability=False):
    """Judge 10 healthy recordings and 10 each of 1 and 3 mm; only the healthy ones are mistaken."""
    size_mm = np.repeat([0.0, 1.0, 3.0], 10)
    alarms = np.arange(30) < false_alarms
    predicted_mm = size_mm + alarms
    score = size_mm + generator(1, "comparison", detector).normal(0, 0.5, 30)
    return verdicts(
        zip(size_mm, predicted_mm, strict=True),
        detector,
        scheme,
        score=score,
        threshold=0.5,
        probability=1 / (1 + np.exp(-score)) if probability else np.nan,
        estimate_mm=np.where(predicted_mm > 0, predicted_mm + 0.2, np.nan),
        location_mm=np.where(predicted_mm > 0, 4.0, np.nan),
    )


def compared(*of_scheme, schemes=SCHEMES, where=("",) * 30):
    """Compare the detectors from all tables, as the rule evaluate makes them."""
    tables = {name: pd.DataFrame(columns=each) for name, each in COLUMNS.items()}
    if of_scheme:
        index = index_of(of_scheme[0], nodule_at_mm=where)
        tables = measure_tables(pd.concat(of_scheme), [0.0], SETTINGS["evaluation"], index)
    return comparison.page_values(tables, schemes, SETTINGS, "diagonal")


@pytest.fixture(scope="module")
def pages():
    """Return what is compared by leaving places out, and on held-out sessions."""
    both = judged("template"), judged("diagonal", false_alarms=1, probability=True)
    held_out = [judged("template", "held_out", 5), judged("diagonal", "held_out", 1)]
    return {
        "leave_one_out": compared(*both, where=[*[""] * 20, *[3.0] * 10]),
        "held_out": compared(*held_out, schemes=["held_out"]),
    }


def cells(page, title):
    (table,) = page["compared"]
    names = [detector["name"] for detector in table["detectors"]]
    groups = table["groups"] + table["folded_groups"]
    (row,) = [row for group in groups for row in group["rows"] if row["title"] == title]
    return dict(zip(names, row["cells"], strict=True))


@pytest.mark.parametrize(
    ("scheme", "title", "detector", "text", "count"),
    [
        # Leaving one out does not measure what the threshold sets.
        ("leave_one_out", "Specificity", "diagonal", "set to 95 %", ""),
        ("leave_one_out", "Specificity", "template", "50 %", ""),
        ("leave_one_out", "Specificity", "always_nodule", "0 %", ""),
        ("leave_one_out", "Specificity, difference", "diagonal", words.NOT_APPLICABLE, ""),
        ("leave_one_out", "Sensitivity, difference", "diagonal", "0", "p = 1.000"),
        ("leave_one_out", "Sensitivity, 1 mm", "diagonal", "100 %", ""),
        ("leave_one_out", "Balanced accuracy", "always_nodule", "50 %", ""),
        ("leave_one_out", "Mean absolute error, of those found", "diagonal", "0.20 mm", "20 of 20"),
        ("leave_one_out", "Median error of the place", "diagonal", "1.00 mm", "10 recordings"),
        # What a detector does not say is marked.
        ("leave_one_out", "Brier score of the probability", "template", words.NOT_APPLICABLE, ""),
        ("leave_one_out", "Exact size, of all nodules", "always_nodule", words.NOT_APPLICABLE, ""),
        ("held_out", "Specificity", "diagonal", "90 %", ""),
        ("held_out", "Specificity, difference", "template", "reference", ""),
        # 4 recordings more, none fewer: McNemar's p is twice the tail of 0 of 4.
        ("held_out", "Specificity, difference", "diagonal", "+40", "p = 0.125"),
        ("held_out", "Specificity, difference", "always_nodule", words.NOT_APPLICABLE, ""),
    ],
)
def test_a_cell_is_of_its_table_or_says_why_not(pages, scheme, title, detector, text, count):
    row = cells(pages[scheme], title)
    # The leading detector stands first.
    assert list(row) == ["diagonal", "template", "always_nodule"]
    assert (row[detector]["text"], row[detector]["count"]) == (text, count)


def test_the_probability_is_compared_with_stating_the_prevalence(pages):
    page = pages["leave_one_out"]
    brier = cells(page, "Brier score of the probability")["diagonal"]
    assert brier["count"] == "always stating the prevalence: 0.090"
    (table,) = page["compared"]
    assert {row["detector"] for row in table["calibration"]} == {"diagonal"}
    assert sum(row["recordings"] for row in table["calibration"]) == 30


def test_each_scheme_but_resubstitution_has_a_table_of_its_own():
    schemes = ["held_out", "leave_one_out", "leave_one_session_out", "resubstitution"]
    of_each = [judged("template", name, alarms) for alarms, name in enumerate(schemes)]
    tables = compared(*of_each, schemes=schemes)["compared"]
    first = {each["title"]: each["groups"][0]["rows"][0]["cells"][0]["text"] for each in tables}
    assert list(first.items()) == [
        ("held-out sessions", "100 %"),
        ("leave-one-out", "90 %"),
        ("leave-one-session-out", "80 %"),
    ]


def test_a_detector_without_a_verdict_is_named_and_without_any_nothing_is_compared():
    assert compared(judged("template"))["silent"] == ["diagonal"]
    assert compared()["compared"] == []
    assert compared()["silent"] == ["template", "diagonal"]


@pytest.mark.parametrize(
    ("value", "low", "cell"),
    [
        (0.251, -0.1, ("0.25 mm", "\u22120.10 to 0.60 mm")),
        (0.251, UNKNOWN, ("0.25 mm", "")),
        (UNKNOWN, UNKNOWN, (words.UNKNOWN, "")),
    ],
)
def test_a_number_has_its_unit_and_its_interval(value, low, cell):
    row = {"bias_mm": value, "bias_mm_low": low, "bias_mm_high": 0.6}
    made = cell_of(row, "bias_mm", words.number, " mm")
    assert (made["text"], made["interval"]) == cell


def test_only_benches_that_judged_and_had_no_other_part_are_shown():
    rates = dict(zip(comparison.RATES, ("0.95", "0.1", "0.4"), strict=True))
    rows = [
        {"detector": detector, "part": part, "of the benches the": "worst", "bench": part, **rates}
        for detector in ("diagonal", "other")
        for part in ("chose", "judged only")
    ]
    (shown,) = comparison.bench_values(rows, ["diagonal", "template"])["bench_rows"]
    assert (shown["detector"], shown["bench"]) == ("diagonal", "judged only")
    assert shown["rates"] == ["95 %", "10 %", "40 %"]
