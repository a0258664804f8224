"""The search for free parameters solves a task with a known answer."""

import itertools

import numpy as np
import pytest
import yaml
from phantom_study.search import FreeParameter, evolve, free_parameters, values_at

from capsule.errors import CapsuleError
from capsule.phantom.files import DEFAULT_TABLE
from capsule.phantom.parameters import phantom_from_table, rewritten, value_of

FREE = [FreeParameter("size", 0.01, 100.0, True), FreeParameter("share", 0.0, 1.0, False)]


def test_positions_and_values_belong_together():
    assert FREE[0].at(0.5) == pytest.approx(1.0)
    assert FREE[1].at(0.25) == pytest.approx(0.25)
    for parameter in FREE:
        assert parameter.at(0.0) == pytest.approx(parameter.low)
        assert parameter.at(1.0) == pytest.approx(parameter.high)


def steps_of(generations, seed):
    def losses_of(candidates, number):
        return [
            abs(np.log10(values["size"] / 10)) + abs(values["share"] - 0.8) for values in candidates
        ]

    steps = evolve(
        FREE,
        losses_of,
        lambda number: np.random.default_rng([seed, number]),
        candidates=24,
        spread=0.2,
        rate=0.5,
    )
    return list(itertools.islice(steps, generations))


def test_the_search_finds_the_answer_and_finds_it_again():
    def next_candidates():
        positions = steps_of(25, seed=1)[-1].cloud.draw(np.random.default_rng(3), 5)
        return [values_at(FREE, candidate) for candidate in positions]

    for candidate in next_candidates():
        assert candidate["size"] == pytest.approx(10, rel=0.5)
        assert candidate["share"] == pytest.approx(0.8, abs=0.1)
    assert next_candidates() == next_candidates()


def test_the_first_candidate_is_the_middle_and_all_stay_in_range():
    step = steps_of(1, seed=2)[0]
    assert step.values[0] == pytest.approx({"size": 1.0, "share": 0.5})
    assert len(step.values) == len(step.losses) == 24
    for values in step.values:
        assert 0.01 <= values["size"] <= 100
        assert 0 <= values["share"] <= 1


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
