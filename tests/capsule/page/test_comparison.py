"""The detectors side by side: every cell from its table, and nothing said that is not known."""

from functools import partial

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
ROWS = [
    row
    for groups in (comparison.GROUPS, comparison.FOLDED_GROUPS)
    for rows in groups.values()
    for row in rows
]
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


@pytest.fixture(scope="module")
def page():
    both = verdicts("template"), verdicts("diagonal", false_alarms=1, probability=True)
    where = {f"3mm/r{place}": 3.0 for place in range(20, 30)}
    return comparison.page_values(judgements(*both, where=where), SCHEMES, SETTINGS, "diagonal")


def cells(page, title):
    (table,) = page["compared"]
    names = [detector["name"] for detector in table["detectors"]]
    groups = table["groups"] + table["folded_groups"]
    rows = [row for group in groups for row in group["rows"]]
    (row,) = [row for row in rows if row["title"] == title]
    return dict(zip(names, row["cells"], strict=True))


def test_every_detector_has_a_column_and_so_has_calling_everything_a_nodule(page):
    specificity = cells(page, "Specificity")
    # The leading detector stands first.
    assert list(specificity) == ["diagonal", "template", "always_nodule"]
    # Leaving one out does not measure what the threshold sets.
    assert [cell["text"] for cell in specificity.values()] == ["set to 95 %", "50 %", "0 %"]
    assert specificity["diagonal"]["interval"] == ""
    assert cells(page, "Sensitivity, 1 mm")["diagonal"]["text"] == "100 %"
    assert cells(page, "Balanced accuracy")["always_nodule"]["text"] == "50 %"


def test_what_a_detector_does_not_say_is_marked(page):
    brier = cells(page, "Brier score of the probability")
    assert brier["template"]["text"] == words.NOT_APPLICABLE
    assert brier["diagonal"]["count"] == "always stating the prevalence: 0.090"
    assert cells(page, "Exact size, of all nodules")["always_nodule"]["value"] is None


def test_size_and_place_have_their_errors(page):
    error = cells(page, "Mean absolute error, of those found")["diagonal"]
    assert (error["text"], error["count"]) == ("0.20 mm", "20 of 20")
    place = cells(page, "Median error of the place")["diagonal"]
    assert (place["text"], place["count"]) == ("1.00 mm", "10 recordings")


def test_the_difference_is_from_the_papers_detector():
    both = [
        verdicts(name, "held_out", alarms) for name, alarms in (("template", 5), ("diagonal", 1))
    ]
    page = comparison.page_values(judgements(*both), ["held_out"], SETTINGS, "diagonal")
    healthy = cells(page, "Specificity, difference")
    assert healthy["template"]["text"] == "reference"
    # 4 recordings more, none fewer: McNemar's p is twice the tail of 0 of 4.
    assert (healthy["diagonal"]["text"], healthy["diagonal"]["count"]) == ("+40", "p = 0.125")
    assert healthy["always_nodule"]["text"] == words.NOT_APPLICABLE
    assert cells(page, "Specificity")["diagonal"]["text"] == "90 %"


def test_of_a_specificity_that_the_threshold_sets_no_difference_is_told(page):
    healthy = cells(page, "Specificity, difference")
    assert healthy["diagonal"]["text"] == words.NOT_APPLICABLE
    assert cells(page, "Sensitivity, difference")["diagonal"]["text"] == "0"


def test_the_calibration_is_that_of_detectors_with_a_probability(page):
    (compared,) = page["compared"]
    assert {row["detector"] for row in compared["calibration"]} == {"diagonal"}
    assert sum(row["recordings"] for row in compared["calibration"]) == 30


def test_each_scheme_but_resubstitution_has_a_table_of_its_own():
    schemes = ["held_out", "leave_one_out", "leave_one_session_out", "resubstitution"]
    of_each = [verdicts("template", name, alarms) for alarms, name in enumerate(schemes)]
    page = comparison.page_values(judgements(*of_each), schemes, SETTINGS, "diagonal")
    assert [table["title"] for table in page["compared"]] == [
        "held-out sessions",
        "leave-one-out",
        "leave-one-session-out",
    ]
    first = [table["groups"][0]["rows"][0]["cells"][0]["text"] for table in page["compared"]]
    assert first == ["100 %", "90 %", "80 %"]


def test_a_detector_without_a_verdict_is_named():
    page = comparison.page_values(judgements(verdicts("template")), SCHEMES, SETTINGS, "diagonal")
    assert page["silent"] == ["diagonal"]


def test_without_any_verdict_nothing_is_compared():
    page = comparison.page_values(judgements(), SCHEMES, SETTINGS, "diagonal")
    assert page["compared"] == []
    assert page["silent"] == ["template", "diagonal"]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.title)
def test_a_row_is_of_a_table_that_has_what_it_asks_for(row):
    columns = COLUMNS[row.table]
    assert row.sizes == "all" or "size_mm" in columns
    assert bool(row.measure) == ("measure" in columns)
    assert ("{size}" in row.title) == (row.sizes in ("each", "smallest"))


def test_a_number_has_its_unit_and_its_interval():
    bias = partial(comparison.number_cell, name="bias_mm", unit=" mm")
    cell = bias({"bias_mm": 0.251, "bias_mm_low": -0.1, "bias_mm_high": 0.6})
    assert (cell["value"], cell["text"]) == (0.251, "0.25 mm")
    assert cell["interval"] == "\u22120.10 to 0.60 mm"
    cell = bias({"bias_mm": 0.251, "bias_mm_low": UNKNOWN, "bias_mm_high": UNKNOWN})
    assert (cell["text"], cell["interval"]) == ("0.25 mm", "")


def test_what_is_not_known_has_no_value():
    row = {"bias_mm": UNKNOWN, "bias_mm_low": UNKNOWN, "bias_mm_high": UNKNOWN}
    cell = comparison.number_cell(row, "bias_mm", " mm")
    assert (cell["value"], cell["text"]) == (None, words.UNKNOWN)
    cell = comparison.difference({"difference": UNKNOWN})
    assert (cell["value"], cell["text"]) == (None, words.UNKNOWN)


BENCHES = [
    {"detector": detector, "part": part, "of the benches the": which, "bench": bench}
    | dict(zip(comparison.RATES, rates, strict=True))
    for detector, part, which, bench, rates in [
        ("diagonal", "chose", "worst", "uneven", ("0.95", "0.8", "0.9")),
        ("diagonal", "chose", "best", "usual", ("0.95", "0.9", "0.99")),
        ("diagonal", "judged only", "worst", "steep", ("0.95", "0.1", "0.4")),
        ("diagonal", "judged only", "best", "calm", ("0.95", "0.9", "1.0")),
        ("diagonal", "judged only", "least specific", "steep", ("0.812", "0.1", "0.4")),
        ("other", "judged only", "worst", "steep", ("0.9", "0.0", "0.2")),
        ("other", "judged only", "best", "calm", ("0.9", "0.5", "0.7")),
    ]
]


def benches_of(detectors, rows=BENCHES):
    return comparison.bench_values(rows, detectors)


def test_the_benches_stand_in_a_table():
    assert benches_of(["diagonal", "other"])["bench_rows"][0] == {
        "detector": "diagonal",
        "which": "worst",
        "bench": "steep",
        "rates": ["95 %", "10 %", "40 %"],
    }


def test_only_detectors_that_judge_the_archive_are_named():
    assert benches_of(["template"]) == {"bench_rows": []}


def test_only_benches_that_judged_and_had_no_other_part_are_shown():
    rows = benches_of(["diagonal"])["bench_rows"]
    assert [row["bench"] for row in rows] == ["steep", "calm", "steep"]
    without = [{name: text for name, text in row.items() if name != "part"} for row in BENCHES]
    assert benches_of(["diagonal"], without)["bench_rows"] == []
