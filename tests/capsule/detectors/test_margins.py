"""Margins that a fold may move across the threshold are found, without computing them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.detectors.margins import margin_reach, near_threshold
from capsule.detectors.matching import compare_templates
from capsule.detectors.operating_point import threshold_at
from capsule.particles import Particle, render
from capsule.seeding import generator
from capsule.sliding import RepeatedParticle, SlidingComparison
from support.paper_ranges import PAPER


def test_a_margin_moves_no_farther_than_its_reach():
    numbers = generator(1, "margins")
    drawn = PAPER.draw(4, 4, numbers)
    whole, fold, *others = [render(Particle.from_vector(each), 150, 1000) for each in drawn]
    fold = fold * 0.5
    noise = np.maximum(numbers.normal(0.0, 0.05, (10, 4, 1000)), 0.0)
    matrices = [*noise, *(noise[:2] + others)]
    norms = np.array([np.linalg.norm(matrix) for matrix in matrices])
    both = [RepeatedParticle(whole), RepeatedParticle(fold)]
    moved = [
        abs(np.subtract(*compare_templates(SlidingComparison(matrix), both).gains))
        for matrix in matrices
    ]
    assert (moved <= margin_reach(norms, whole, fold) * (1 + 1e-12)).all()


@given(st.lists(st.tuples(st.floats(-9, 9), st.floats(0, 3), st.floats(-1, 1)), min_size=1))
def test_only_margins_near_the_threshold_need_to_be_known(rows):
    margins, reach, share = np.array(rows).T
    true = margins + share * reach
    mixed = margins.copy()
    near = near_threshold(margins, reach, 0.9)
    mixed[near] = true[near]
    assert threshold_at(mixed, 0.9) == pytest.approx(threshold_at(true, 0.9), abs=1e-12)
