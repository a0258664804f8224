"""The paper's cells, and a table that reproduces them."""

from pathlib import Path

import numpy as np
import pytest

from capsule.evaluation.rates import detection_table, sizing_table
from edges.files import read_csv
from phantom_study.paper_table import (
    MOTION,
    PAPER,
    cells,
    distance,
    mean_difference,
    motion,
    summary,
)
from support.like_the_paper import LIKE_THE_PAPER

ROOT = Path(__file__).resolve().parents[2]


def runs_of(confusion):
    """Give the true and the predicted size of each run of a table."""
    true_mm, predicted_mm = np.divmod(np.repeat(np.arange(36), confusion.ravel()), 6)
    return true_mm.astype(float), predicted_mm.astype(float)


def test_the_papers_numbers_come_from_one_table_of_120_runs():
    found = cells(LIKE_THE_PAPER)
    assert found == pytest.approx(PAPER)
    assert distance(found | MOTION) == pytest.approx(0)


def test_the_motion_counts_like_cells():
    found = motion(np.array([True, True, True, False]), np.array([99, 100, 250, 250.5]))
    assert list(found.values()) == [75, 50]
    # By Laplace's rule 15 and 10 of 20 runs make 16/22 and 11/22 likely.
    spreads = [np.sqrt(p * (1 - p) / 20) for p in (16 / 22, 11 / 22)]
    wanted = np.sqrt(((0.25 / spreads[0]) ** 2 + (0.5 / spreads[1]) ** 2) / 24)
    assert distance(cells(LIKE_THE_PAPER) | found) == pytest.approx(wanted)


def test_a_rate_that_hardly_varies_is_sooner_far_off():
    like_the_paper = PAPER | MOTION
    sure = distance(like_the_paper | {"recall 2 mm": 100.0})
    unsure = distance(like_the_paper | {"exact 3 mm": 40.0})
    # Both are off by 15 points.
    assert sure > 2 * unsure


def test_cells_agree_with_the_evaluation():
    confusion = np.random.default_rng(1).multinomial(20, np.full(6, 1 / 6), size=6)
    found = cells(confusion)
    for row in detection_table(*runs_of(confusion), [1, 2, 3, 4, 5], 0.95):
        size = row["size_mm"]
        assert found[f"precision {size} mm"] == pytest.approx(100 * row["precision"])
        assert found[f"recall {size} mm"] == pytest.approx(100 * row["recall"])
    for row in sizing_table(*runs_of(confusion), [1, 2, 3, 4, 5], 1.0, 0.95)[1:]:
        size = row["size_mm"]
        assert found[f"exact {size} mm"] == pytest.approx(100 * row["exact_rate"])
        assert found[f"within 1 mm of {size} mm"] == pytest.approx(100 * row["within_rate"])


def test_a_precision_of_nothing_found_is_missing_and_far_off():
    nothing = np.zeros((6, 6), dtype=int)
    nothing[:, 0] = 20
    found = cells(nothing)
    assert np.isnan(found["precision 5 mm"])
    assert distance(found | MOTION) > 10


def test_summary_says_whether_the_paper_lies_in_the_central_range():
    archives = [cells(LIKE_THE_PAPER) | {"exact 5 mm": value} for value in np.arange(20.0, 60.0)]
    rows = {row["cell"]: row for row in summary(archives)}
    assert rows["exact 4 mm"]["inside"]
    assert not rows["exact 5 mm"]["inside"]
    assert rows["exact 5 mm"]["low"] == pytest.approx(20.975)
    assert mean_difference(list(rows.values())) == pytest.approx((39.5 - 15) / len(PAPER))


def test_the_documentation_shows_the_table_that_was_measured():
    text = (ROOT / "docs/phantom.md").read_text(encoding="utf-8")
    rows = read_csv(ROOT / "docs/phantom-table.csv")
    assert [row["cell"] for row in rows] == list(PAPER)
    for row in rows:
        paper, mean, low, high = (float(row[key]) for key in ("paper", "mean", "low", "high"))
        inside = "yes" if row["inside"] == "True" else "no"
        assert (
            f"| {row['cell']} | {paper:.1f} | {mean:.1f} | {low:.1f}-{high:.1f} | {inside} |"
            in text
        )
    difference = np.mean([abs(float(row["mean"]) - float(row["paper"])) for row in rows])
    assert f"differ from the paper by {difference:.1f} points on average" in text
