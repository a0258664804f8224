"""The search makes fair trials, stays in its ranges, and comes near to the paper."""

import json
from argparse import Namespace

import numpy as np
import pytest
import yaml
from phantom_study import calibrate
from phantom_study.calibrate import Cloud, FreeParameter, free_parameters, rewritten, search
from phantom_study.paper_table import read_paper_table

from capsule.errors import CapsuleError
from capsule.phantom.files import DEFAULT_TABLE
from capsule.phantom.parameters import phantom_from_table, value_of
from support.paper import LIKE_THE_PAPER

pytestmark = pytest.mark.slow

PAPER = read_paper_table()
FREE = [FreeParameter("part.share", 0.0, 1.0)]
PLAN = Namespace(
    generations=2, candidates=12, archives=3, finalists=4, final_archives=5,
    spread=0.2, rate=0.5, seed=1,
)  # fmt: skip


def trial_at(share):
    """Return a trial with the paper's table for a share of 0.8, and a worse one otherwise."""
    confusion = LIKE_THE_PAPER.copy()
    missed = np.minimum(confusion[1:], round(20 * abs(share - 0.8)))
    confusion[1:] -= missed
    confusion[1:, 0] += missed.sum(axis=1)
    return {"confusion": json.dumps(confusion.tolist())} | PAPER.motion


def searched(plan):
    """Return what a search asks for (stage, shares, seeds), and its winner."""
    asked = []

    def trials_of(stage, values, seeds):
        shares = [candidate["part.share"] for candidate in values]
        asked.append((stage, shares, list(seeds)))
        return [trial_at(share) for share in shares]

    return asked, search(FREE, trials_of, PAPER, plan)["part.share"]


def test_candidates_of_a_generation_meet_the_same_archives_and_finalists_meet_others():
    asked, winner = searched(PLAN)
    for number, (stage, shares, seeds) in enumerate(asked[:2]):
        assert stage == f"generation {number + 1}"
        assert len(set(shares)) == PLAN.candidates
        assert shares == [share for share in shares[:: PLAN.archives] for _ in range(PLAN.archives)]
        first = 101_000 + number * PLAN.archives
        assert seeds == [first, first + 1, first + 2] * PLAN.candidates
    known = {seed for _, _, seeds in asked[:2] for seed in seeds}
    assert [stage for stage, _, _ in asked[2:]] == [f"final 1 candidate {n}" for n in (1, 2, 3, 4)]
    assert winner in {shares[0] for _, shares, _ in asked[2:]}
    for _, shares, seeds in asked[2:]:
        assert len(set(shares)) == 1
        assert len(set(seeds)) == PLAN.final_archives
        assert not known & set(seeds)


def test_the_search_comes_near_to_the_paper_and_comes_there_again():
    long = Namespace(**vars(PLAN) | {"generations": 12})
    asked, winner = searched(long)
    off = [np.abs(np.array(asked[number][1]) - 0.8).mean() for number in (0, 11)]
    assert off[1] < off[0] / 2
    assert winner == pytest.approx(0.8, abs=0.1)
    assert searched(long) == (asked, winner)


def test_another_seed_asks_for_other_candidates_and_archives():
    (asked, _), (others, _) = searched(PLAN), searched(Namespace(**vars(PLAN) | {"seed": 2}))
    for (_, shares, seeds), (_, other_shares, other_seeds) in zip(asked, others, strict=True):
        assert not set(seeds) & set(other_seeds)
        # The first cloud's centre is the middle of the range, whatever the seed.
        assert set(shares) & set(other_shares) <= {0.5}


def test_the_winner_has_the_nearest_worst_cell_then_the_nearest_cells(monkeypatch):
    off = iter([(2.0, 1.0), (1.0, 3.0), (1.0, 2.0), (1.0, 2.0)])
    monkeypatch.setattr(calibrate, "shortfall", lambda trials, paper: next(off))
    asked, winner = searched(PLAN)
    assert winner == asked[2 + 2][1][0]


def test_positions_and_values_belong_together():
    size, share = FreeParameter("size", 0.01, 100.0), FREE[0]
    assert size.at(0.5) == pytest.approx(1.0)
    assert share.at(0.25) == pytest.approx(0.25)
    for parameter in (size, share):
        assert parameter.at(0.0) == pytest.approx(parameter.low)
        assert parameter.at(1.0) == pytest.approx(parameter.high)


def test_the_first_candidate_is_the_centre_and_all_stay_in_range():
    cloud = Cloud(np.array([0.5, 0.1]), np.array([0.4, 0.4]))
    positions = cloud.draw(np.random.default_rng(2), 24)
    assert positions[0] == pytest.approx(cloud.centre)
    assert positions.shape == (24, 2)
    assert positions.min() >= 0
    assert positions.max() <= 1


def test_the_table_names_what_is_free_and_its_present_value_lies_in_the_range():
    table = yaml.safe_load(DEFAULT_TABLE.read_text(encoding="utf-8"))
    phantom = phantom_from_table(table)
    free = free_parameters(table)
    assert free
    for parameter in free:
        assert parameter.low <= value_of(phantom, parameter.name) <= parameter.high
        part, key = parameter.name.split(".")
        assert table[part][key]["source"] == "calibrated"


def test_new_values_are_written_into_the_table_and_comments_stay():
    text = DEFAULT_TABLE.read_text(encoding="utf-8")
    changed = rewritten(text, {"advance.speed_mm_s": 0.5})
    phantom = phantom_from_table(yaml.safe_load(changed))
    assert value_of(phantom, "advance.speed_mm_s") == 0.5
    # The wave has a speed of the same name, which stays.
    assert value_of(phantom, "wall.speed_mm_s") == 25
    assert changed.count("#") == text.count("#")
    with pytest.raises(CapsuleError, match=r"no line 'advance\.sped"):
        rewritten(text, {"advance.sped": 1.0})
