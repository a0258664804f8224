"""The folds: a place is left out whole, and held-out sessions teach nothing."""

from collections import Counter
from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from capsule.detectors.base import TrainingArchive
from capsule.detectors.familiar import TOO_FEW
from capsule.detectors.search import Passage
from capsule.detectors.wave_traits import WaveTraits
from capsule.evaluation import cross_validation
from capsule.evaluation.cross_validation import HELD_OUT, LEAVE_ONE_OUT, RESUBSTITUTION, Detectors
from capsule.method.templates import TemplateSet
from capsule.recordings.names import size_mm
from capsule.recordings.origin import places_of
from support.training import recordings_of

RULES = {"schemes": [LEAVE_ONE_OUT, RESUBSTITUTION], "groups": ["session", "setup"]}
RULES |= {"held_out": [], "most_folds": 1000}


def row(site="", session="", setup="", near_copies=""):
    names = {"site": site, "session": session, "setup": setup}
    return names | {"near_copies": near_copies, "no_verdict": ""}


def by_scheme(rows, **changes):
    """Return the folds of each scheme as pairs of judged and left-out recordings."""
    found = {}
    for fold in cross_validation.folds_of(rows, RULES | changes):
        found.setdefault(fold.scheme, []).append((fold.judged, set(fold.left_out)))
    return found


def test_groups_are_left_out_if_three_leave_enough_to_teach():
    for key, healthy, nodules, folds in (
        ("session", "aabbc", "abc", 3),
        # Two sessions say nothing about a third one, and without "a" two healthy recordings teach.
        ("session", "aaabbb", "ab", 0),
        ("session", "aaabc", "abc", 0),
        ("session", "aabbc", "aaa", 0),
        ("setup", "aabbcc", "ddef", 6),
        ("setup", "aabbcc", "ddee", 0),
        ("setup", "aabb", "ddef", 0),
        # A recording without a set-up is left out with its place.
        ("setup", ["a", "b", "c", ""], "def", 7),
    ):
        of_both = ("0mm", healthy), ("2mm", nodules)
        rows = {f"{size}/r{n}": row(**{key: of[n]}) for size, of in of_both for n in range(len(of))}
        found = by_scheme(rows).get(f"leave_one_{key}_out", [])
        assert len(found) == folds
        for judged, left_out in found:
            assert set(judged) == left_out and len({rows[name][key] for name in judged}) == 1
        # A recording that no detector judges teaches nobody.
        rows["0mm/r0"]["no_verdict"] = rows["0mm/r1"]["no_verdict"] = "no wave"
        assert key == "setup" or f"leave_one_{key}_out" not in by_scheme(rows)


@st.composite
def archives(draw):
    """Draw the rows of an archive with sites, sessions, set-ups and near copies."""
    sizes = draw(st.lists(st.sampled_from([0, 1, 2]), min_size=1, max_size=16))
    names = [f"{size}mm/r{number}" for number, size in enumerate(sizes)]
    text, copies = st.sampled_from(["", "a", "b", "c", "d"]), st.sampled_from(["", *names])
    return {name: row(draw(text), draw(text), draw(text), draw(copies)) for name in names}


# Of two held-out recordings, one is a pass over a place that teaches.
SHARED = {"0mm/a": row("x", "a"), "0mm/b": row("x"), "0mm/c": row("y", "a")}


@example(SHARED, ["a"], 100)
@given(archives(), st.sampled_from([[], ["a"], ["a", "b"]]), st.integers(100, 120))
def test_no_scheme_but_resubstitution_is_taught_by_a_place_that_it_judges(rows, kept, most):
    place, judged = places_of(rows), {}
    apart = {name for name, each in rows.items() if each["session"] in kept}
    for fold in cross_validation.folds_of(rows, RULES | {"held_out": kept, "most_folds": most}):
        judged.setdefault(fold.scheme, []).extend(fold.judged)
        assert apart <= fold.left_out
        if fold.scheme != RESUBSTITUTION:
            taught = {place[name] for name in rows if name not in fold.left_out}
            assert not taught & {place[name] for name in fold.judged}
        # That pass takes the place from itself alone.
        if fold.scheme == HELD_OUT and fold.left_out - apart:
            assert len({place[name] for name in fold.judged}) == 1
    order = [HELD_OUT, LEAVE_ONE_OUT, "leave_one_session_out", "leave_one_setup_out"]
    assert list(judged) == [each for each in (*order, RESUBSTITUTION) if each in judged]
    # Under each scheme, each recording is judged once, the held-out ones under a scheme of theirs.
    for scheme, names in judged.items():
        assert sorted(names) == sorted(apart if scheme == HELD_OUT else rows.keys() - apart)


@given(st.integers(1, 100_000), st.integers(100, 5000))
def test_the_work_of_all_folds_stops_growing_with_the_square(recordings, most):
    folds = cross_validation.number_of_folds(recordings, most)
    assert 50 <= folds <= most
    # The next fold would be too much work.
    if recordings > most and folds > 50:
        assert recordings * folds <= most**2 < recordings * (folds + 1)
    assert recordings > most or folds == most
    assert cross_validation.number_of_folds(recordings + 1, most) <= folds


@pytest.mark.parametrize(("places", "most"), [(6, 6), (6, 7), (7, 6), (13, 6), (3000, 1000)])
def test_places_of_one_size_are_left_out_together_if_there_are_more_than_the_folds(places, most):
    rows = {f"{number % 3}mm/r{number}": row() for number in range(places)}
    # A place stays whole, and is left out with places of the same sizes.
    rows |= {f"0mm/p{number}": row("pair") for number in range(2)} | {"2mm/p2": row("pair")}
    judged = [names for names, _ in by_scheme(rows, most_folds=most)[LEAVE_ONE_OUT]]
    assert ("0mm/p0", "0mm/p1", "2mm/p2") in judged
    alone = [names for names in judged if "2mm/p2" not in names]
    assert all(len({size_mm(name) for name in names}) == 1 for names in alone)
    allowed, together = cross_validation.number_of_folds(len(rows), most), max(map(len, alone))
    assert len(judged) <= allowed
    # As few places together as possible: with one fewer, there would be too many folds.
    of_size = Counter(size_mm(name) for names in alone for name in names).values()
    assert together == 1 or 1 + sum(np.ceil(n / (together - 1)) for n in of_size) > allowed


def test_an_unlabelled_pass_over_a_labelled_place_is_judged_without_that_place():
    rows = {"0mm/a": row("x"), "2mm/b": row("y"), "unlabelled/p": row("y"), "unlabelled/q": row()}
    rows["unlabelled/r"] = row(near_copies="0mm/a")
    asked = SimpleNamespace(rows=lambda judged, left_out: [(judged, set(left_out))])
    judged = cross_validation.judge_unlabelled(asked, [*rows][2:], rows, ["0mm/h"])
    left_out = {"p": {"0mm/h", "2mm/b"}, "q": {"0mm/h"}, "r": {"0mm/h", "0mm/a"}}
    assert judged == [([f"unlabelled/{name}"], names) for name, names in left_out.items()]


def test_held_out_rates_come_first_but_choose_nothing():
    for *taught, choosing in (
        (RESUBSTITUTION, LEAVE_ONE_OUT, LEAVE_ONE_OUT),
        (RESUBSTITUTION,) * 2,
    ):
        for schemes, main in ((taught, choosing), ([*taught, HELD_OUT], HELD_OUT)):
            assert cross_validation.main_scheme(schemes) == main
            assert cross_validation.choosing_scheme(schemes) == choosing


SIZES_MM = {"0mm/a": 0.0, "0mm/b": 0.0, "0mm/c": 0.0, "2mm/a": 2.0, "2mm/b": 2.0}
SETTINGS = {"detectors": ["diagonal", "template"], "recording": {"rate_hz": 10}}
SETTINGS |= {"diagonal": {"size_ridge": 1.0}}
SETTINGS["evaluation"] = {"specificity": 0.6, "prevalence": 0.5, "size_confidence": 0.9}


@pytest.fixture(scope="module")
def archive():
    bump = np.repeat([[0.0] * 100 + [1.0] * 50 + [0.0] * 150], 2, axis=0)
    # No fold changes these templates: what it does to them is tested for all detectors.
    templates = TemplateSet((0.0, 2.0), (None, None), (0 * bump, bump), 50)
    usual = 10, 200, 130, 1, 1, 1
    passages = {name: Passage(n, n, n, n, *usual) for n, name in enumerate(SIZES_MM)}
    traits = dict.fromkeys(SIZES_MM, WaveTraits(3.2, 0.25, 0.02, 0.005, 0.95, 0.1))
    matrices = {name: bump * (size > 0) for name, size in SIZES_MM.items()}
    recordings = recordings_of(passages, traits=traits, matrices=matrices)
    return TrainingArchive(SIZES_MM, recordings, templates, {}, SETTINGS)


def test_every_detector_has_a_row_in_the_order_of_the_configuration(archive):
    detectors = Detectors(archive)
    rows = list(detectors.rows(["0mm/a", "2mm/b"], []))
    order = [(row["recording"], row["detector"]) for row in rows]
    assert order == [*product(["0mm/a", "2mm/b"], SETTINGS["detectors"])]
    assert all(row.keys() == {"recording", "detector", *detectors.columns} for row in rows)
    by_diagonal, by_rule = rows[2:]
    # 200 samples at 10 Hz. Only detectors by templates have distances to them.
    names = ("predicted_mm", "location_s", "rmse_0mm", "rmse_2mm")
    assert [by_diagonal[name] for name in names] == [2.0, 20.0, None, None]
    assert by_rule["predicted_mm"] == 2.0 and by_rule["rmse_2mm"] < by_rule["rmse_0mm"]


def test_what_is_left_out_or_has_no_verdict_teaches_nothing(archive):
    detectors = Detectors(archive)
    silent = Detectors(replace(archive, no_verdict={"0mm/c": "no wave on sensor_1"}))
    for each in silent.rows(["0mm/c"], []):
        assert np.isnan([each["predicted_mm"], each["score"], each["threshold"]]).all()
        # Nobody tells of a recording that no detector judges.
        names = ("no_verdict", "rmse_0mm", "rmse_2mm", "familiar", "unfamiliar_because")
        assert [each[name] for name in names] == ["no wave on sensor_1", None, None, "", ""]
    without = list(detectors.rows(["2mm/a"], ["0mm/c"]))
    assert str(list(silent.rows(["2mm/a"], []))) == str(without)
    (with_all, _), (by_threshold, _) = detectors.rows(["2mm/a"], []), without
    assert by_threshold["threshold"] < with_all["threshold"]
    # What is familiar is taught by the same recordings, and they teach what is handed on.
    assert (by_threshold["unfamiliar_because"], by_threshold["unlike_value"]) == (TOO_FEW, 4.0)
    stored = silent.stored()
    handed_on = stored["recordings"], stored["diagonal"]["threshold"]
    assert handed_on == (len(SIZES_MM) - 1, by_threshold["threshold"])


def test_each_fold_is_judged_once_by_the_others_and_listed_by_detector_scheme_and_fold():
    judged = []

    def rows(names, left_out):
        judged.append((names, set(left_out)))
        for name in names:
            yield from ({"detector": each, "recording": name, "fold": len(judged)} for each in "ba")

    archive = {name: row("x" if "b" in name else "") for name in SIZES_MM}
    folds = cross_validation.folds_of(archive, RULES)
    again = [replace(fold, scheme="again") for fold in folds if fold.scheme == LEAVE_ONE_OUT]
    asked = SimpleNamespace(names=["b", "a"], rows=rows)
    made = cross_validation.cross_validate(asked, [*folds, *again])
    # The passes over the place x stand where its first pass does. Folds that differ in the scheme
    # alone are judged once.
    order = [("0mm/a",), ("0mm/b", "2mm/b"), ("0mm/c",), ("2mm/a",)]
    assert judged == [*((names, set(names)) for names in order), (tuple(SIZES_MM), set())]
    turns = [(name, turn) for turn, names in enumerate(order, start=1) for name in names]
    of_scheme = [(LEAVE_ONE_OUT, *turn) for turn in turns]
    of_scheme += [(RESUBSTITUTION, name, 5) for name in SIZES_MM]
    of_scheme += [("again", *turn) for turn in turns]
    names = ("detector", "scheme", "recording", "fold", "size_mm")
    found = [tuple(row[name] for name in names) for row in made]
    assert found == [(each, *of, SIZES_MM[of[1]]) for each in "ba" for of in of_scheme]
