"""The folds: which recordings teach the detector that judges a recording."""

from collections import Counter
from math import ceil

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from capsule.evaluation.folds import (
    Folds,
    group_folds,
    group_scheme,
    header_groups,
    left_out_together,
    nearly_the_same,
    number_of_folds,
    scheme_folds,
)


def test_the_parts_of_the_folds_judge_everybody_once():
    for scheme, groups in (("leave_one_site_out", list("xyxz")), ("leave_one_out", list("abcd"))):
        folds = Folds(scheme, groups)
        for judged, left_out in folds.parts():
            for recording in judged:
                assert np.flatnonzero(~folds.training(recording)).tolist() == left_out.tolist()
        assert sorted(place for judged, _ in folds.parts() for place in judged) == [0, 1, 2, 3]
    ((judged, left_out),) = Folds("resubstitution", list("abcd")).parts()
    assert (judged.size, left_out.size) == (4, 0)


def test_the_parts_come_in_the_order_of_the_recordings():
    # A detector that computes neighbouring folds together would otherwise compute each many times.
    parts = Folds("leave_one_out", ["5mm/r1", "0mm/r9", "3mm/r2"]).parts()
    assert [judged.tolist() for judged, _ in parts] == [[0], [1], [2]]
    parts = Folds("leave_one_site_out", list("zxzy")).parts()
    assert [judged.tolist() for judged, _ in parts] == [[0, 2], [1], [3]]


def test_groups_come_from_the_headers():
    sites = {"0mm/a": "x", "0mm/b": "x", "0mm/c": "y", "0mm/d": "", "0mm/e": "", "1mm/f": "y"}
    names, headers = list(sites), {name: {"site": site} for name, site in sites.items()}
    folds = Folds(group_scheme("site"), header_groups("site", names, headers))
    assert folds.training(0).tolist() == [False, False, True, True, True, True]
    assert folds.training(3).tolist() == [True, True, True, False, True, True]
    assert header_groups("session", names, headers) is None
    assert Folds("resubstitution", names).training(1).all()
    alone = [True, False, True, True, True, True]
    assert Folds("leave_one_out", names).training(1).tolist() == alone


def test_groups_are_left_out_only_if_one_of_several_recordings_leaves_enough_to_teach():
    def used(**sessions):
        """Return whether these sessions, such as "0 0 1", are left out."""
        session_of = {
            f"{size}mm/{session}{run}": session
            for session, sizes in sessions.items()
            for run, size in enumerate(sizes.split())
        }
        headers = {name: {"session": session} for name, session in session_of.items()}
        return header_groups("session", list(headers), headers) is not None

    assert used(first="0 0 0 1", second="0 0 0 2")
    assert not used(first="0 0 0 1 2")
    assert not used(first="0 0 0 1", second="3")
    assert not used(first="0 0 0 0", second="1 1 2 2")
    # The second is judged by the first, though not the other way round.
    assert used(first="0 0 0 1", second="2 2")
    # Each is left out in leave-one-out, too.
    assert not used(first="0", second="0", third="0", fourth="0", fifth="1", sixth="2")


def test_recordings_that_no_detector_judges_count_as_teaching_nobody():
    sessions = dict.fromkeys(["0mm/a", "0mm/b", "0mm/c", "1mm/d"], "1") | {
        "2mm/e": "2",
        "2mm/f": "2",
    }
    headers = {name: {"session": session} for name, session in sessions.items()}
    assert header_groups("session", list(headers), headers)
    headers["0mm/b"]["no_verdict"] = "no wave"
    assert header_groups("session", list(headers), headers) is None


def test_what_is_nearly_the_same_is_left_out_and_judged_by_itself():
    names = ["1mm/a", "1mm/b", "0mm/c", "0mm/d", "0mm/e", "2mm/f"]
    rows = {
        name: {"near_copies": "", "site": site} for name, site in zip(names, "xxyzvw", strict=True)
    }
    rows["1mm/b"]["near_copies"], rows["0mm/c"]["near_copies"] = "0mm/c gone", "1mm/b"
    alike = nearly_the_same(rows)
    assert alike == {1: [2], 2: [1]}
    for folds in (Folds("leave_one_out", names, alike), group_folds("site", rows, 1000)):
        for judged, left_out in folds.parts():
            for recording in judged:
                assert np.flatnonzero(~folds.training(recording)).tolist() == left_out.tolist()
            assert ({1, 2} <= set(left_out)) == bool({1, 2} & set(judged))
        assert sorted(place for judged, _ in folds.parts() for place in judged) == list(range(6))
    assert Folds("resubstitution", names, alike).training(1).all()


def test_up_to_the_largest_number_of_folds_each_recording_is_left_out_alone():
    assert len(set(left_out_together([0.0, 3.0, 0.0, None], 4))) == 4


def test_beyond_it_neighbours_of_one_size_are_left_out_together():
    sizes_mm = [0.0, 3.0, 0.0, 3.0, 0.0, 3.0, 0.0]
    groups = left_out_together(sizes_mm, 4)
    assert groups == ["0.0:0", "3.0:0", "0.0:0", "3.0:0", "0.0:1", "3.0:1", "0.0:1"]
    # Leaving out a whole size would leave no template of it, so there is a group for each at least.
    assert len(set(left_out_together(sizes_mm, 1))) == 2


@given(st.lists(st.sampled_from([0.0, 1.0, 2.0]), min_size=1, max_size=60), st.integers(3, 70))
def test_no_group_mixes_sizes_and_none_is_larger_than_needed(sizes_mm, most):
    groups = left_out_together(sizes_mm, most)
    assert len(set(zip(groups, sizes_mm, strict=True))) == len(set(groups)) <= most
    largest = max(Counter(groups).values())
    if largest > 1:
        smaller = sum(ceil(n / (largest - 1)) for n in Counter(sizes_mm).values())
        assert smaller > most


@given(st.integers(1, 100_000), st.integers(100, 5000))
def test_the_work_of_all_folds_stops_growing_with_the_square(recordings, most):
    folds = number_of_folds(recordings, most)
    assert 100 <= folds <= most
    if recordings > most:
        # The next fold would be too much work.
        assert folds == 100 or recordings * folds <= most**2 < recordings * (folds + 1)
    else:
        assert folds == most
    assert number_of_folds(recordings + 1, most) <= folds


def test_a_large_archive_has_few_folds():
    rows = {f"{place % 6}mm/r{place}": {"near_copies": ""} for place in range(3000)}
    (folds,) = scheme_folds(["leave_one_out"], rows, 1000)
    # At most the square of 1000 by 3000, which is 333; nine at a time would be 336 folds.
    assert [places.size for _, places in folds.parts()] == [10] * 300


def test_a_scheme_leaves_no_more_out_together_than_needed():
    rows = {f"{size}mm/r{run}": {"near_copies": ""} for run in range(3) for size in (0, 2)}
    (alone,) = scheme_folds(["leave_one_out"], rows, 6)
    (pairs,) = scheme_folds(["leave_one_out"], rows, 4)
    assert [judged.tolist() for judged, _ in alone.parts()] == [[0], [1], [2], [3], [4], [5]]
    assert [judged.tolist() for judged, _ in pairs.parts()] == [[0, 2], [1, 3], [4], [5]]


def test_many_sites_are_left_out_together_with_sites_of_the_same_sizes():
    sites = {"0mm/a": "v", "2mm/a": "w", "0mm/b": "v", "2mm/b": "x", "2mm/c": "y", "2mm/d": "z"}
    sites |= {f"0mm/{name}": name for name in "cde"}
    rows = {name: {"site": site, "near_copies": ""} for name, site in sites.items()}
    each, pairs = (group_folds("site", rows, most).parts() for most in (8, 5))
    assert [judged.tolist() for judged, _ in each] == [[0, 2], [1], [3], [4], [5], [6], [7], [8]]
    assert [judged.tolist() for judged, _ in pairs] == [[0, 2], [1, 3], [4, 5], [6, 7], [8]]


def test_in_a_large_archive_a_shared_site_changes_only_the_folds_of_its_recordings():
    shared = {"3mm/r7", "3mm/r2000"}
    rows = {
        f"{size}mm/r{run}": {"site": f"{size} mm, {run}", "near_copies": ""}
        for run in range(2400)
        for size in ([0, 3] if run < 3 else [3])
    }
    for name in shared:
        rows[name]["site"] = "both"
    (alone,) = scheme_folds(["leave_one_out"], rows, 1000)
    names = list(rows)
    one_out, site_out = (
        {frozenset(names[place] for place in left_out) for _, left_out in folds.parts()}
        for folds in (alone, group_folds("site", rows, 1000))
    )
    assert frozenset(shared) in site_out
    changed = {left_out for left_out in one_out if left_out & shared}
    assert one_out - site_out == changed and len(changed) == 2
    assert site_out - one_out == {left_out - shared for left_out in changed} | {frozenset(shared)}
