"""The detectors side by side: every cell from its table, and nothing said that is not known."""

import numpy as np
import pandas as pd
import pytest

from capsule import words
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.measures import measure_tables
from capsule.page import comparison
from capsule.seeding import generator

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
ROWS = [row for rows in {**comparison.GROUPS, **comparison.FOLDED_GROUPS}.values() for row in rows]
UNKNOWN = float("nan")
SCHEMES = ["leave_one_out", "resubstitution"]


def verdicts(detector, scheme="leave_one_out", false_alarms=5, probability=False):
    """Judge 10 healthy recordings and 10 each of 1 and 3 mm; only the healthy ones are mistaken."""
    numbers = generator(1, "comparison", detector)
    size_mm = np.repeat([0.0, 1.0, 3.0], 10)
    predicted_mm = np.concatenate(
        [np.ones(false_alarms), np.zeros(10 - false_alarms), size_mm[10:]]
    )
    score = size_mm + numbers.normal(0, 0.5, 30)
    found = predicted_mm > 0
    columns = {
        "recording": [f"{size:g}mm/r{place}" for place, size in enumerate(size_mm)],
        "detector": detector,
        "scheme": scheme,
        "size_mm": size_mm,
        "predicted_mm": predicted_mm,
        "score": score,
        "threshold": 0.5,
        "probability": 1 / (1 + np.exp(-score)) if probability else np.nan,
        "estimate_mm": np.where(found, predicted_mm + 0.2, np.nan),
        "estimate_low_mm": np.nan,
        "estimate_high_mm": np.nan,
        "location_mm": np.where(found, 4.0, np.nan),
    }
    return pd.DataFrame(columns)


def judgements(*of_scheme, where=None):
    """Make all tables, as the rule evaluate does."""
    if not of_scheme:
        return {name: pd.DataFrame(columns=each) for name, each in COLUMNS.items()}
    predictions = pd.concat(of_scheme)
    rows = {
        name: {"site": "", "near_copies": "", "nodule_at_mm": str((where or {}).get(name, ""))}
        for name in predictions["recording"]
    }
    return measure_tables(predictions, [0.0], SETTINGS["evaluation"], rows)


def compared(*of_scheme, schemes=SCHEMES, where=None):
    return comparison.page_values(
        judgements(*of_scheme, where=where), schemes, SETTINGS, "diagonal"
    )


@pytest.fixture(scope="module")
def pages():
    """Return what is compared by leaving places out, and on held-out sessions."""
    both = verdicts("template"), verdicts("diagonal", false_alarms=1, probability=True)
    held_out = [verdicts("template", "held_out", 5), verdicts("diagonal", "held_out", 1)]
    where = {f"3mm/r{place}": 3.0 for place in range(20, 30)}
    return {
        "leave_one_out": compared(*both, where=where),
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
    of_each = [verdicts("template", name, alarms) for alarms, name in enumerate(schemes)]
    tables = compared(*of_each, schemes=schemes)["compared"]
    first = {each["title"]: each["groups"][0]["rows"][0]["cells"][0]["text"] for each in tables}
    assert list(first.items()) == [
        ("held-out sessions", "100 %"),
        ("leave-one-out", "90 %"),
        ("leave-one-session-out", "80 %"),
    ]


def test_a_detector_without_a_verdict_is_named_and_without_any_nothing_is_compared():
    assert compared(verdicts("template"))["silent"] == ["diagonal"]
    assert compared()["compared"] == []
    assert compared()["silent"] == ["template", "diagonal"]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.title)
def test_a_row_is_of_a_table_that_has_what_it_asks_for(row):
    columns = COLUMNS[row.table]
    assert row.sizes == "all" or "size_mm" in columns
    assert bool(row.measure) == ("measure" in columns)
    assert ("{size}" in row.title) == (row.sizes in ("each", "smallest"))


@pytest.mark.parametrize(
    ("value", "low", "high", "cell"),
    [
        (0.251, -0.1, 0.6, (0.251, "0.25 mm", "\u22120.10 to 0.60 mm")),
        (0.251, UNKNOWN, UNKNOWN, (0.251, "0.25 mm", "")),
        (UNKNOWN, UNKNOWN, UNKNOWN, (None, words.UNKNOWN, "")),
    ],
)
def test_a_number_has_its_unit_and_its_interval(value, low, high, cell):
    row = {"bias_mm": value, "bias_mm_low": low, "bias_mm_high": high}
    made = comparison.number_cell(row, "bias_mm", " mm")
    assert (made["value"], made["text"], made["interval"]) == cell
    assert comparison.difference({"difference": UNKNOWN})["text"] == words.UNKNOWN


def test_only_benches_that_judged_and_had_no_other_part_are_shown():
    rates = dict(zip(comparison.RATES, ("0.95", "0.1", "0.4"), strict=True))
    rows = [
        {"detector": detector, "part": part, "of the benches the": which, "bench": "steep", **rates}
        for detector in ("diagonal", "other")
        for part in ("chose", "judged only")
        for which in ("worst", "best")
    ]
    shown = comparison.bench_values(rows, ["diagonal", "template"])["bench_rows"]
    rates = ["95 %", "10 %", "40 %"]
    assert shown == [
        {"detector": "diagonal", "which": which, "bench": "steep", "rates": rates}
        for which in ("worst", "best")
    ]
    without = [{name: text for name, text in row.items() if name != "part"} for row in rows]
    assert comparison.bench_values(without, ["diagonal"]) == {"bench_rows": []}
