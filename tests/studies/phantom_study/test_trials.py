"""The paper's cells, and trials: each is logged once, can be repeated, and has its distance."""

import numpy as np
import pytest
from phantom_study import calibrate, simulated_archive
from phantom_study.paper_table import cells, distance, mean_difference, read_paper_table, summary
from phantom_study.simulated_archive import quick, read_detector

from capsule.errors import CapsuleError
from capsule.method.particle import Particle
from capsule.method.templates import by_size
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.store.files import read_csv
from support.documents import text_of
from support.paper import LIKE_THE_PAPER
from support.project import ROOT

pytestmark = pytest.mark.takes(0.5)

PAPER = read_paper_table()


def test_the_papers_numbers_come_from_one_table_of_120_runs():
    assert LIKE_THE_PAPER.sum(axis=1).tolist() == [PAPER.runs] * 6
    rates = cells(LIKE_THE_PAPER, PAPER)
    assert rates == PAPER.cells
    assert distance(rates | PAPER.motion, PAPER) == 0
    # Rates of whole runs: 57.7 % is 15 of 26.
    assert rates["precision 1 mm"] == 100 * 15 / 26


def test_summary_says_whether_the_paper_lies_in_the_central_range():
    archives = [PAPER.cells | {"exact 5 mm": value} for value in np.arange(20.0, 60.0)]
    rows = {row["cell"]: row for row in summary(archives, PAPER)}
    assert [rows[f"exact {size} mm"]["inside"] for size in (4, 5)] == [True, False]
    assert rows["exact 5 mm"]["low"] == pytest.approx(20.975)
    assert mean_difference(list(rows.values())) == pytest.approx((39.5 - 15) / len(PAPER.cells))


def test_the_documentation_shows_the_table_that_was_measured():
    text = text_of("workflow/studies/phantom.md")
    rows = read_csv(ROOT / "workflow/studies/results/phantom-table.csv")
    assert [row["cell"] for row in rows] == list(PAPER.cells)
    for row in rows:
        cell, *numbers, inside = row.values()
        paper, mean, low, high = (f"{float(each):.1f}" for each in numbers)
        shown = "yes" if inside == "True" else "no"
        assert f"| {cell} | {paper} | {mean} | {low}-{high} | {shown} |" in text
    difference = np.mean([abs(float(row["mean"]) - float(row["paper"])) for row in rows])
    assert f"differ from the paper by {difference:.1f} points on average" in text


@pytest.mark.slow
def test_a_logged_trial_can_be_made_again(monkeypatch):
    def averaged(fitted):
        # The templates of the log hold the mean of sigma, not the root of the mean variance.
        parts = by_size(fitted).items()
        means = {size: np.mean([p.to_vector() for p in each], axis=0) for size, each in parts}
        return {size: [Particle.from_vector(mean)] for size, mean in means.items()}

    monkeypatch.setattr(simulated_archive, "by_size", averaged)
    logged = read_csv(ROOT / "workflow/studies/results/phantom-calibration.csv")[0]
    values = {name: float(logged[name]) for name in logged if "." in name}
    phantom, detector = read_phantom(DEFAULT_TABLE, []), quick(read_detector())
    again = calibrate.try_out(phantom, detector, PAPER, values, int(logged["archive_seed"]))
    assert {name: str(value) for name, value in again.items()} | {"stage": "generation 1"} == logged


CANDIDATES = [{"part.size": 1.5}, {"part.size": 2.5}, {"part.size": 3.5}]
SEEDS = [7, 8, 9]


def test_trials_are_made_once_and_then_read_and_only_what_is_missing_is_made(tmp_path):
    path, asked = tmp_path / "new/log.csv", []

    def make(values, seeds):
        for candidate, seed in zip(values, seeds, strict=True):
            asked.append(seed)
            yield {"archive_seed": seed, "confusion": "[]"} | candidate
            # Every trial is in the file before the next is asked for.
            assert [int(row["archive_seed"]) for row in read_csv(path)] == asked

    made = calibrate.TrialLog(path, make).trials("first", CANDIDATES[:2], SEEDS[:2])
    known = calibrate.TrialLog(path, make).trials("first", CANDIDATES, SEEDS)
    assert asked == SEEDS
    assert known[:2] == [{name: str(value) for name, value in trial.items()} for trial in made]
    calibrate.TrialLog(path, make).trials("second", CANDIDATES, [1, 2, 3])
    assert [row["stage"] for row in read_csv(path)] == 3 * ["first"] + 3 * ["second"]
    # Trials of another value, parameter or archive, and fewer trials, are refused.
    before, other = path.read_bytes(), [{"part.size": 9.5}, *CANDIDATES[1:]]
    for candidates, seeds in (
        (other, SEEDS), ([{"part.other": 1.5}] * 3, SEEDS), (CANDIDATES, [7, 8, 10]),
        (CANDIDATES[:2], SEEDS[:2]),
    ):  # fmt: skip
        with pytest.raises(CapsuleError, match=r"log\.csv: first has other candidates than this"):
            calibrate.TrialLog(path, make).trials("first", candidates, seeds)
    assert path.read_bytes() == before
