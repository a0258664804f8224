"""The folds: which recordings teach the detector that judges a recording."""

import numpy as np

from capsule.evaluation.folds import (
    Folds,
    group_folds,
    group_scheme,
    header_groups,
    nearly_the_same,
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
    names = ["a", "b", "c", "d"]
    headers = {"a": {"site": "x"}, "b": {"site": "x"}, "c": {"site": "y"}, "d": {}}
    folds = Folds(group_scheme("site"), header_groups("site", names, headers))
    assert folds.training(0).tolist() == [False, False, True, True]
    assert folds.training(3).tolist() == [True, True, True, False]
    assert header_groups("session", names, headers) is None
    assert header_groups("site", ["a", "b"], headers) is None
    assert Folds("resubstitution", names).training(1).all()
    assert Folds("leave_one_out", names).training(1).tolist() == [True, False, True, True]


def test_what_is_nearly_the_same_is_left_out_and_judged_by_itself():
    names = ["a", "b", "c", "d"]
    rows = {
        name: {"near_copies": "", "site": site} for name, site in zip(names, "xxyz", strict=True)
    }
    rows["b"]["near_copies"], rows["c"]["near_copies"] = "c gone", "b"
    alike = nearly_the_same(rows)
    assert alike == {1: [2], 2: [1]}
    for folds in (Folds("leave_one_out", names, alike), group_folds("site", rows)):
        for judged, left_out in folds.parts():
            for recording in judged:
                assert np.flatnonzero(~folds.training(recording)).tolist() == left_out.tolist()
            assert ({1, 2} <= set(left_out)) == bool({1, 2} & set(judged))
        assert sorted(place for judged, _ in folds.parts() for place in judged) == [0, 1, 2, 3]
    assert Folds("resubstitution", names, alike).training(1).all()
