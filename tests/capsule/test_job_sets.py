"""Sets of recordings for one job each: complete, small enough, and stable as names change."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capsule.batches import job_sets, search_sets

POOL = [f"{folder}/r-{run}" for folder in ("0mm", "2.5mm", "unlabelled") for run in range(99)]
NAMES = st.sampled_from(POOL)
ARCHIVES = st.sets(NAMES, max_size=60).map(sorted)


@settings(deadline=None, max_examples=40)
@given(ARCHIVES, st.integers(1, 9))
def test_each_recording_is_in_exactly_one_set_and_none_is_too_large(names, most):
    sets = job_sets(names, most)
    assert sorted(name for members in sets.values() for name in members) == sorted(names)
    assert all(1 <= len(members) <= most for members in sets.values())


@settings(deadline=None, max_examples=40)
@given(ARCHIVES, st.integers(1, 9))
def test_a_set_holds_recordings_of_one_folder(names, most):
    for label, members in job_sets(names, most).items():
        assert {name.partition("/")[0] for name in members} == {label.partition("/")[0]}


@settings(deadline=None, max_examples=40)
@given(ARCHIVES, NAMES, st.integers(1, 9))
def test_a_name_that_comes_or_goes_changes_or_divides_one_set(names, another, most):
    others = [name for name in names if name != another]
    without, among = job_sets(others, most), job_sets([*others, another], most)
    lost = [members for label, members in without.items() if among.get(label) != members]
    made = [members for label, members in among.items() if without.get(label) != members]
    assert len(lost) <= 1
    before = [name for members in lost for name in members]
    assert sorted(name for members in made for name in members) == sorted([*before, another])


@settings(deadline=None, max_examples=40)
@given(st.permutations([f"3mm/r{run:02d}" for run in range(20)]), st.integers(1, 9))
def test_the_order_of_names_does_not_matter(names, most):
    assert job_sets(names, most) == job_sets(sorted(names), most)


def test_names_of_sets_say_their_bits():
    assert list(job_sets(["0mm/r01", "3mm/r01", "3mm/r02", "3mm/r03"], 2)) == [
        "0mm/set",
        "3mm/set-0",
        "3mm/set-1",
    ]


@pytest.mark.parametrize("count", [1000, 2000])
def test_sets_are_filled_by_half_and_more_on_average(count):
    sets = job_sets([f"3mm/r{run:04d}" for run in range(count)], 100)
    assert len(sets) <= 2 * count / 100


def test_a_folder_is_searched_whole_until_it_is_large():
    runs = [f"3mm/r{run:03d}" for run in range(101)]
    assert search_sets(["0mm/r01", *runs[:100]]) == {"0mm": ["0mm/r01"], "3mm": runs[:100]}
    assert list(search_sets(["0mm/r01", *runs])) == ["0mm", "3mm/set-0", "3mm/set-1"]
