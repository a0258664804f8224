"""The paper's printed numbers, and the counts that follow from them."""

import math
from pathlib import Path

import pandas as pd
import pytest
import yaml

from capsule.evaluation.columns import RATES
from capsule.evaluation.measures import measure_tables
from capsule.evaluation.paper import (
    Evaluation,
    detection_points,
    negative_points,
    printed_tables,
    sizing_points,
)

PRINTED = Path(__file__).parents[3] / "workflow" / "report" / "paper.yaml"


@pytest.fixture(scope="module")
def printed():
    return yaml.safe_load(PRINTED.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def tables(printed):
    made = printed_tables(printed, 0.95)
    return {name: table.to_dict("records") for name, table in made.items()}


def test_the_counts_give_the_printed_rates(printed, tables):
    for said, row in zip(printed["detection"], tables["detection"][1:], strict=True):
        assert round(100 * row["precision"], 1) == said["precision_percent"]
        assert round(100 * row["recall"], 1) == said["recall_percent"]
        assert row["tp"] + row["fn"] == printed["recordings_per_size"]
    counts = [(row["tp"], row["fp"], row["fn"]) for row in tables["detection"][1:3]]
    assert counts == [(15, 11, 5), (17, 3, 3)]
    for said, row in zip(printed["sizing"], tables["sizing"], strict=True):
        assert round(100 * row["exact_rate"], 1) == said["exact_percent"]
        assert round(100 * row["within_rate"], 1) == said["within_percent"]


def test_the_pie_and_the_specificity_follow(tables):
    pie = {row["predicted_mm"]: row["count"] for row in tables["confusion"]}
    assert pie == {0.0: 6, 1.0: 11, 2.0: 3, 3.0: 0, 4.0: 0, 5.0: 0}
    none, *_ = tables["detection"]
    assert (none["tp"], none["fn"], none["recall"]) == (6, 14, 0.3)
    assert none["recall_low"] < 0.3 < none["recall_high"]


# Of 2 mm, three of four are found and two of these have the right size; one healthy one is called.
VERDICTS = [(0.0, 0.0), (0.0, 0.0), (0.0, 2.0), (2.0, 2.0), (2.0, 2.0), (2.0, 6.0), (2.0, 0.0)]


def evaluated(verdicts=VERDICTS):
    """Return the rates of verdicts with templates of none, 2 and 6 mm, and a table of the paper."""
    columns = ["size_mm", "predicted_mm"]
    predictions = pd.DataFrame(verdicts, columns=columns).assign(
        detector="diagonal", scheme="held_out", rmse_0mm=0.5, rmse_2mm=0.5, rmse_6mm=0.5
    )
    rules = {"tolerance_mm": 1.0, "confidence": 0.95}
    tables = measure_tables(predictions, [0.0, 2.0, 6.0], rules, names=RATES)
    paper = {name: table.assign(detector="paper", scheme="paper") for name, table in tables.items()}
    return Evaluation(predictions, tables, paper)


def counts(points, size_mm):
    """Return hits and number of recordings by measure."""
    of_size = points[points["size_mm"] == size_mm].set_index("measure")
    return {name: tuple(row) for name, row in of_size[["hits", "of"]].iterrows()}


def test_a_point_holds_the_rate_and_the_counts_behind_it():
    tables = evaluated().tables
    detected = detection_points(tables["detection"])
    # Of no nodule and of any, other points tell.
    assert set(detected["size_mm"]) == {2.0, 6.0}
    assert counts(detected, 2.0) == {"precision": (3, 4), "recall": (3, 4)}
    assert counts(detected, 6.0) == {"precision": (0, 0), "recall": (0, 0)}
    sized = sizing_points(tables["sizing"])
    assert set(sized["size_mm"]) == {2.0, 6.0}
    assert counts(sized, 2.0) == {"exact_rate": (2, 4), "within_rate": (2, 4)}
    none = negative_points(tables["confusion"])
    assert counts(none, 0.0) == {"classified": (2, 3)}
    assert counts(none, 2.0) == {"classified": (1, 3)}
    for points in (detected, sized, none):
        known = points[points["of"] > 0]
        assert known["rate"].tolist() == pytest.approx((known["hits"] / known["of"]).tolist())
        assert (known["low"] <= known["rate"]).all() and (known["rate"] <= known["high"]).all()
    # Both sizes are at an end of the templates, which only the tolerance can pass.
    assert set(sized.loc[sized["one_sided"], "measure"]) == {"within_rate"}
    assert not detected["one_sided"].any() and not none["one_sided"].any()


def test_an_evaluation_knows_its_detectors_and_its_sizes():
    ours = evaluated()
    assert ours.detectors() == ["diagonal"]
    assert ours.sizes_mm() == [0.0, 2.0, 6.0]
    assert set(ours.of("sizing", "diagonal")["detector"]) == {"diagonal"}
    # If nothing was judged, the paper's own detector stands for all.
    assert evaluated([]).detectors() == ["template"]
    # Without a healthy recording, no verdict on one is shown.
    assert negative_points(evaluated([(2.0, 2.0)]).tables["confusion"]).empty


def test_of_the_papers_sizes_the_errors_are_not_known(tables):
    errors = ("mean_absolute_error_mm", "absolute_error_mm", "location_error_mm")
    for name in (f"{error}{end}" for error in errors for end in ("", "_low", "_high")):
        assert all(math.isnan(row[name]) for row in tables["sizing"])
    assert [row["recordings"] for row in tables["sizing"]] == [20] * 4
    assert [row["one_sided"] for row in tables["sizing"]] == [False, False, False, True]
