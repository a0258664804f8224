"""The detectors side by side: every cell from its table, and nothing said that is not known."""

import numpy as np
import pandas as pd
import pytest

from capsule import words
from capsule.evaluation import tables
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.folds import group_scheme
from capsule.page import comparison
from capsule.seeding import generator

SETTINGS = {
    "detectors": ["template", "diagonal"],
    "evaluation": {
        "schemes": ["leave_one_out", "resubstitution"],
        "groups": ["site"],
        "tolerance_mm": 1.0,
        "specificity": 0.95,
        "prevalence": 0.1,
    },
}


def verdicts(detector, scheme="leave_one_out", false_alarms=5, probability=False):
    """Judge 10 healthy recordings and 10 each of 1 and 3 mm; only the healthy ones are mistaken."""
    numbers = generator(1, "comparison", detector)
    size_mm = np.repeat([0.0, 1.0, 3.0], 10)
    predicted_mm = np.concatenate(
        [np.ones(false_alarms), np.zeros(10 - false_alarms), size_mm[10:]]
    )
    score = size_mm + numbers.normal(0, 0.5, 30)
    stated = 1 / (1 + np.exp(-score)) if probability else np.full(30, np.nan)
    estimate_mm = np.where(predicted_mm > 0, predicted_mm + 0.2, np.nan)
    names = tuple(f"{size:g}mm/r{place}" for place, size in enumerate(size_mm))
    key = {"detector": detector, "scheme": scheme}
    place = np.where(predicted_mm > 0, 4.0, np.nan)
    return tables.Verdicts(key, names, size_mm, predicted_mm, score, stated, estimate_mm, place)


def judgements(*of_scheme, where=None):
    """Make all tables, as the script judge.py does."""
    made = {name: [] for name in COLUMNS}
    for each in of_scheme:
        areas, points = tables.curves(each, 1, 100, 0.95)
        stated, brier = tables.calibrated(each, 0.1, 2, 0.95)
        made["auc"] += areas
        made["roc"] += points
        made["calibration"] += stated
        made["brier"] += brier
        made["predictive_values"] += tables.predictive(each, 0.1, 0.95)
        made["size_error"] += tables.size_errors(each, 0.95)
        made["localisation"] += tables.localisation(each, where or {}, 0.95)
        made["permutation"] += tables.permutation(each, 1, 100, 0.95)
    if of_scheme:
        made["comparison"] = tables.comparisons(of_scheme, 1.0, 0.95)
        made["summary"] = tables.summary(of_scheme, 1.0, 0.95)
    return {
        name: pd.DataFrame(rows, columns=None if rows else COLUMNS[name])
        for name, rows in made.items()
    }


@pytest.fixture(scope="module")
def page():
    both = verdicts("template"), verdicts("diagonal", false_alarms=1, probability=True)
    where = {f"3mm/r{place}": 3.0 for place in range(20, 30)}
    return comparison.page_values(judgements(*both, where=where), SETTINGS, "diagonal")


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
    assert [cell["text"] for cell in specificity.values()] == ["90 %", "50 %", "0 %"]
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


def test_the_difference_is_from_the_papers_detector(page):
    healthy = cells(page, "Specificity, difference")
    assert healthy["template"]["text"] == "reference"
    # 4 recordings more, none fewer: McNemar's p is twice the tail of 0 of 4.
    assert (healthy["diagonal"]["text"], healthy["diagonal"]["count"]) == ("+40", "p = 0.125")
    assert healthy["always_nodule"]["text"] == words.NOT_APPLICABLE


def test_the_calibration_is_that_of_detectors_with_a_probability(page):
    assert {row["detector"] for row in page["calibration"]} == {"diagonal"}
    assert sum(row["recordings"] for row in page["calibration"]) == 30


def test_leaving_groups_out_has_a_table_of_its_own():
    grouped = [verdicts("template"), verdicts("template", group_scheme("site"), 7)]
    parts = [judgements(each) for each in grouped]
    joined = {name: pd.concat([part[name] for part in parts]) for name in COLUMNS if
              not parts[0][name].empty}  # fmt: skip
    joined = {name: joined.get(name, parts[0][name]) for name in COLUMNS}
    page = comparison.page_values(joined, SETTINGS, "diagonal")
    assert [table["title"] for table in page["compared"]] == ["leave-one-out", "leave-one-site-out"]
    first = [table["groups"][0]["rows"][0]["cells"][0]["text"] for table in page["compared"]]
    assert first == ["50 %", "30 %"]


def test_a_detector_without_a_verdict_is_named_with_the_reason():
    page = comparison.page_values(judgements(verdicts("template")), SETTINGS, "diagonal")
    assert page["silent"].startswith("diagonal has given no verdict on a labelled recording.")
    assert "recordings without a nodule" in page["silent"]


def test_without_any_verdict_nothing_is_compared():
    page = comparison.page_values(judgements(), SETTINGS, "diagonal")
    assert page["compared"] == page["calibration"] == []
    assert page["silent"].startswith("template and diagonal have given no verdict")
