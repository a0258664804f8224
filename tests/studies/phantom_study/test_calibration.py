"""The calibration makes fair trials, and the finalist that is nearest to the paper wins."""

import json
from dataclasses import replace

import numpy as np
import pytest
from phantom_study.arguments import read_paper_table
from phantom_study.calibration import Calibration, Finalist, Plan, winner
from phantom_study.search import FreeParameter

from support.like_the_paper import LIKE_THE_PAPER

pytestmark = pytest.mark.slow

PAPER = read_paper_table()
FREE = [FreeParameter("part.share", 0.0, 1.0, False)]
PLAN = Plan(
    generations=2,
    candidates=12,
    archives=3,
    finalists=4,
    final_archives=5,
    spread=0.2,
    rate=0.5,
    seed=1,
)


class Source:
    """A source that gives the paper's table for a share of 0.8, and a worse one otherwise."""

    def __init__(self):
        self.asked = []

    def trials(self, stage, values, seeds):
        """Record the arguments, and return the trials."""
        shares = [candidate["part.share"] for candidate in values]
        self.asked.append((stage, shares, list(seeds)))
        return [trial_at(share) for share in shares]


def trial_at(share):
    confusion = LIKE_THE_PAPER.copy()
    missed = np.minimum(confusion[1:], round(20 * abs(share - 0.8)))
    confusion[1:] -= missed
    confusion[1:, 0] += missed.sum(axis=1)
    return {"confusion": json.dumps(confusion.tolist())} | PAPER.motion


def calibrate(plan):
    source = Source()
    calibration = Calibration(FREE, source, PAPER, plan)
    generations = list(calibration.generations())
    return source.asked, generations, list(calibration.finalists(generations[-1].cloud))


def test_all_candidates_of_a_generation_meet_the_same_archives():
    asked, generations, _ = calibrate(PLAN)
    for number, (stage, shares, seeds) in enumerate(asked[:2]):
        assert stage == f"generation {number + 1}"
        candidates = [values["part.share"] for values in generations[number].values]
        assert shares == [share for share in candidates for _ in range(PLAN.archives)]
        first = 101_000 + number * PLAN.archives
        assert seeds == [first, first + 1, first + 2] * PLAN.candidates


def test_finalists_meet_archives_that_no_generation_met():
    asked, _, finalists = calibrate(PLAN)
    known = {seed for _, _, seeds in asked[:2] for seed in seeds}
    for (stage, shares, seeds), finalist in zip(asked[2:], finalists, strict=True):
        assert (stage, shares[0]) == (finalist.stage, finalist.values["part.share"])
        assert len(set(shares)) == 1
        assert len(set(seeds)) == PLAN.final_archives
        assert not known & set(seeds)


def test_the_search_comes_near_to_the_paper_and_comes_there_again():
    long = replace(PLAN, generations=12)
    _, generations, finalists = calibrate(long)
    assert np.median(generations[-1].losses) < np.median(generations[0].losses)
    assert winner(finalists).values["part.share"] == pytest.approx(0.8, abs=0.1)
    assert calibrate(long)[2] == finalists


def test_another_seed_asks_for_other_candidates_and_archives():
    (asked, _, _), (others, _, _) = calibrate(PLAN), calibrate(replace(PLAN, seed=2))
    for (_, shares, seeds), (_, other_shares, other_seeds) in zip(asked, others, strict=True):
        assert not set(seeds) & set(other_seeds)
        # The first cloud's centre is the middle of the range, whatever the seed.
        assert set(shares) & set(other_shares) <= {0.5}


def test_the_winner_has_the_nearest_worst_cell_then_the_nearest_cells():
    finalists = [
        Finalist("a", {}, worst=2.0, difference=1.0),
        Finalist("b", {}, worst=1.0, difference=3.0),
        Finalist("c", {}, worst=1.0, difference=2.0),
        Finalist("d", {}, worst=1.0, difference=2.0),
    ]
    assert winner(finalists).stage == "c"
