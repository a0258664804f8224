"""The paper's cells are right, and a table can reproduce them."""

import numpy as np
import pytest
from phantom_study.paper_table import cells, distance, mean_difference, read_paper_table, summary

from capsule.store.files import read_csv
from support.paper import LIKE_THE_PAPER
from support.project import ROOT

PAPER = read_paper_table()


def test_the_papers_numbers_come_from_one_table_of_120_runs():
    assert LIKE_THE_PAPER.sum(axis=1).tolist() == [PAPER.runs] * 6
    rates = cells(LIKE_THE_PAPER, PAPER)
    assert rates == PAPER.cells
    assert distance(rates | PAPER.motion, PAPER) == 0
    kinds = [name.partition(" mm")[0].rpartition(" ")[0] for name in rates]
    assert kinds[:18] == 5 * ["precision"] + 5 * ["recall"] + 4 * ["exact"] + 4 * ["within"]
    # The pie has slices of none, 1 mm and 2 mm.
    slices = [f"no nodule as {size}" for size in ("none", "1 mm", "2 mm")]
    assert list(rates)[18:] == ["specificity", *slices]
    # Rates of whole runs: 57.7 % is 15 of 26.
    assert rates["precision 1 mm"] == 100 * 15 / 26


def test_the_distance_counts_in_spreads_with_the_motion_as_cells():
    rates = dict(zip(PAPER.motion, (75.0, 50.0), strict=True))
    # By Laplace's rule 15 and 10 of 20 runs make 16/22 and 11/22 likely.
    spreads = [np.sqrt(p * (1 - p) / 20) for p in (16 / 22, 11 / 22)]
    wanted = np.sqrt(((0.25 / spreads[0]) ** 2 + (0.5 / spreads[1]) ** 2) / 24)
    assert distance(PAPER.cells | rates, PAPER) == pytest.approx(wanted)
    # A rate that hardly varies is sooner far off, here by 15 points each.
    paper = PAPER.cells | PAPER.motion
    sure, unsure = (
        distance(paper | off, PAPER) for off in ({"recall 2 mm": 100.0}, {"exact 3 mm": 40.0})
    )
    assert sure > 2 * unsure
    # A precision of nothing found is missing and far off.
    nothing = cells(20 * np.eye(6, dtype=int)[[0] * 6], PAPER)
    assert np.isnan(nothing["precision 5 mm"])
    assert distance(nothing | PAPER.motion, PAPER) > 10


def test_summary_says_whether_the_paper_lies_in_the_central_range():
    like_the_paper = cells(LIKE_THE_PAPER, PAPER)
    archives = [like_the_paper | {"exact 5 mm": value} for value in np.arange(20.0, 60.0)]
    rows = {row["cell"]: row for row in summary(archives, PAPER)}
    assert rows["exact 4 mm"]["inside"]
    assert not rows["exact 5 mm"]["inside"]
    assert rows["exact 5 mm"]["low"] == pytest.approx(20.975)
    assert mean_difference(list(rows.values())) == pytest.approx((39.5 - 15) / len(PAPER.cells))


def test_the_documentation_shows_the_table_that_was_measured():
    text = (ROOT / "workflow/studies/phantom.md").read_text(encoding="utf-8")
    rows = read_csv(ROOT / "workflow/studies/results/phantom-table.csv")
    assert [row["cell"] for row in rows] == list(PAPER.cells)
    for row in rows:
        paper, mean, low, high = (
            f"{float(row[key]):.1f}" for key in ("paper", "mean", "low", "high")
        )
        inside = "yes" if row["inside"] == "True" else "no"
        assert f"| {row['cell']} | {paper} | {mean} | {low}-{high} | {inside} |" in text
    difference = np.mean([abs(float(row["mean"]) - float(row["paper"])) for row in rows])
    assert f"differ from the paper by {difference:.1f} points on average" in text
