"""The paper's printed numbers, and the counts that follow from them."""

from pathlib import Path

import pytest
import yaml

from capsule.evaluation.paper import printed_tables

PRINTED = Path(__file__).parents[3] / "workflow" / "report" / "paper.yaml"


@pytest.fixture(scope="module")
def printed():
    return yaml.safe_load(PRINTED.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def tables(printed):
    made = printed_tables(printed, 0.95)
    return {name: table.to_dict("records") for name, table in made.items()}


def test_the_counts_give_the_printed_rates(printed, tables):
    for said, row in zip(printed["detection"], tables["detection"], strict=True):
        assert round(100 * row["precision"], 1) == said["precision_percent"]
        assert round(100 * row["recall"], 1) == said["recall_percent"]
        assert row["tp"] + row["fn"] == printed["recordings_per_size"]
    for said, row in zip(printed["sizing"], tables["sizing"], strict=True):
        assert round(100 * row["exact_rate"], 1) == said["exact_percent"]
        assert round(100 * row["within_rate"], 1) == said["within_percent"]


def test_1_mm_is_15_of_26_and_2_mm_17_of_20(tables):
    counts = [(row["tp"], row["fp"], row["fn"]) for row in tables["detection"][:2]]
    assert counts == [(15, 11, 5), (17, 3, 3)]


def test_the_pie_and_the_specificity_follow(tables):
    pie = {row["predicted_mm"]: row["count"] for row in tables["confusion"]}
    assert pie == {0.0: 6, 1.0: 11, 2.0: 3, 3.0: 0, 4.0: 0, 5.0: 0}
    (row,) = tables["specificity"]
    assert (row["true_negatives"], row["healthy"], row["specificity"]) == (6, 20, 0.3)
    assert row["specificity_low"] < 0.3 < row["specificity_high"]
