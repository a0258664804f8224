"""Learning curves of a simple detector, whose rates can be counted by hand."""

from collections import Counter
from itertools import chain, combinations, product
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from capsule.detectors.base import NO_VERDICT, TrainingArchive, Verdict
from capsule.evaluation import learning
from capsule.evaluation.cross_validation import Fold, grouped
from capsule.evaluation.learning import deal, draw_splits
from capsule.seeding import generator
from support.training import NO_TEMPLATES

SCORES = {
    "0mm/a": 0.1, "0mm/b": 0.2, "0mm/c": 0.4, "0mm/d": 0.6,
    "1mm/a": 0.3, "1mm/b": 0.5, "2mm/a": 0.7, "2mm/b": 0.15,
}  # fmt: skip
SIZES_MM = {name: float(name[0]) for name in SCORES}
ALONE = {name: name for name in SCORES}
SHARES = [0.25, 0.5, 0.75]


class Loudest(SimpleNamespace):
    """A detector: a nodule is what scores above all healthy recordings that taught it."""

    @classmethod
    def taught(cls, archive, left_out):
        """Learn from the others."""
        teach = archive.recordings.keys() - {*left_out}
        healthy = [archive.recordings[name] for name in teach if archive.sizes_mm[name] == 0]
        return cls(limit=max(healthy, default=None))

    def verdict(self, score):
        """Judge one recording."""
        if None in (self.limit, score):
            return NO_VERDICT
        return Verdict(2.0 * (score > self.limit), score, self.limit)


def archive_of(scores, places=ALONE):
    sizes_mm = {name: float(name[0]) for name in scores}
    settings = {"evaluation": {"seed": 1, "confidence": 0.95}}
    return TrainingArchive(sizes_mm, scores, NO_TEMPLATES, {}, settings, places=places)


def rows_of(scores=SCORES, places=ALONE, apart=(), scheme="leave_one_out"):
    """Return the rows of the detector; leave-one-out is judged as the evaluation does."""
    archive = archive_of(scores, places)
    made = {n: Loudest.taught(archive, [n]).verdict(scores[n]).predicted_mm for n in scores}
    predictions = pd.DataFrame({"recording": list(made), "predicted_mm": made.values()})
    predictions = predictions.assign(detector="loudest", scheme=scheme)
    members = grouped((name for name in scores if name not in apart), places).values()
    folds = [Fold("leave_one_out", tuple(each), frozenset(each)) for each in members]
    folds += [Fold("held_out", (name,), frozenset({name})) for name in apart]
    return learning.learning_rows({"loudest": Loudest}, archive, predictions, folds)


def last_of(rows):
    return [row for row in rows if row["share"] == learning.ALL_BUT_ONE]


def test_over_all_splits_each_recording_counts_as_often_as_it_is_judged_rightly():
    names = SCORES.keys()
    splits = [sorted(names - {*taught}) for taught in combinations(SCORES, 4)]
    right = learning.mean_right(Loudest, archive_of(SCORES), splits)
    for name, size_mm in SIZES_MM.items():
        every = combinations(names - {name}, 4)
        healthy = [[SCORES[other] for other in taught if other[0] == "0"] for taught in every]
        # Without a healthy recording there is no threshold, and no verdict at all.
        verdicts = [(SCORES[name] > max(each)) == (size_mm > 0) for each in healthy if each]
        assert right[name] == pytest.approx(np.mean(verdicts))
    # The detector is silent on it, which is not right.
    silent = archive_of(SCORES | {"2mm/a": None})
    right = learning.mean_right(Loudest, silent, [["0mm/c", "2mm/a"]])
    assert (right["0mm/c"], right["2mm/a"]) == (1.0, 0.0) and np.isnan(right["1mm/b"])


def test_rates_are_given_of_healthy_recordings_of_each_size_and_of_all_but_the_smallest():
    for sizes_mm, every, main in (
        ([0, 1, 2, 1], [(0, 0), (1, 1), (2, 2)], [(0, 0), (1, 1), (2, 2)]),
        ([1, 2, 5], [(1, 1), (2, 2), (5, 5), (2, 5)], [(1, 1), (2, 5)]),
        ([0], [(0, 0)], [(0, 0)]),
        ([], [], []),
    ):
        assert learning.size_ranges(sizes_mm) == every
        assert learning.main_ranges(sizes_mm) == main


def test_the_curve_has_four_points_whose_gain_ends_at_leave_one_out():
    rows = rows_of()
    assert all(row.keys() == set(learning.COLUMNS) for row in rows)
    points = [(row["share"], row["size_from_mm"]) for row in rows]
    assert points == list(product((*SHARES, 1.0), (0.0, 1.0, 2.0)))
    assert [row["taught"] for row in rows[::3]] == [2.0, 4.0, 6.0, 7.0]
    # Only 0mm/d is louder than the other healthy ones; only 2mm/a is louder than 0mm/d.
    last = last_of(rows)
    names = ("rate", "judged", "taught_healthy", "taught_of_size")
    expected = [[0.75, 4, 3.5, 3.5], [0.0, 2, 3.5, 1.75], [0.5, 2, 3.5, 1.75]]
    assert [[row[name] for name in names] for row in last] == expected
    assert all(np.isnan(row["gain"]) for row in last)
    for row, whole in zip(rows[:-3], last * 3, strict=True):
        assert row["rate"] + row["gain"] == pytest.approx(whole["rate"])
        assert row["gain_low"] < row["gain"] < row["gain_high"]
    without = rows_of(scheme="resubstitution")
    assert {row["share"] for row in without} == {*SHARES}
    assert all(np.isnan(row["gain"]) for row in without)


def test_places_are_the_clusters_and_what_is_held_out_neither_teaches_nor_is_judged():
    rows = rows_of(places={name: name[:3] + str("ab".count(name[-1])) for name in SCORES})
    assert all(row["clusters"] <= 2 for row in rows if row["size_from_mm"] == row["size_to_mm"])
    assert all(np.isnan(row["rate_low"]) for row in rows if row["judged"] > row["clusters"])
    # Two healthy places of two recordings: two of four teach.
    assert [row["taught_healthy"] for row in last_of(rows)] == [3.0] * 3
    # Of seven recordings, each of a place of two leaves out two, and each of the others one.
    seven = {name: score for name, score in SCORES.items() if name != "0mm/d"}
    for row in last_of(rows_of(seven, ALONE | {"0mm/a": "0mm/b"})):
        assert row["taught"] == pytest.approx(7 - 9 / 7, abs=5e-7)
    # Were "0mm/d" to teach, nothing but 2mm/a would be louder.
    rows = rows_of(apart=["0mm/d"])
    assert [(row["judged"], row["taught"]) for row in last_of(rows)] == [(3, 6), (2, 6), (2, 6)]
    assert (rows[7]["share"], rows[7]["size_from_mm"]) == (0.75, 1.0) and rows[7]["rate"] > 0


@pytest.mark.parametrize("sizes", [[], [0], [2], [0, 1], [0, 0], [1, 2], [0, 1, 2] * 400], ids=len)
def test_of_any_number_of_recordings_the_rates_are_those_of_what_is_judged(sizes):
    scores = {f"{size}mm/{number}": number * 7 % 31 / 31 for number, size in enumerate(sizes)}
    judged = Counter()
    for row in rows_of(scores, {name: name for name in scores}):
        judged[row["share"]] += row["judged"] * (row["size_from_mm"] == row["size_to_mm"])
        assert np.isnan(row["rate"]) == (row["judged"] == 0)
        assert not row["judged"] or 0 <= row["rate_low"] <= row["rate"] <= row["rate_high"] <= 1
    assert judged[1.0] == len(sizes)
    # In a large archive not every recording is judged at every share.
    assert judged[0.75] < judged[1.0] or len(sizes) < 1200


@pytest.mark.parametrize("recordings", [1, 2, 5, 8, 40, 400, 2000])
def test_every_share_has_as_many_splits_and_large_archives_are_split_less_often(recordings):
    sizes_mm = {f"{place}": float(place % 3) for place in range(recordings)}
    by_share = draw_splits(sizes_mm, 1, {name: name for name in sizes_mm})
    assert list(by_share) == SHARES
    (splits,) = {len(each) for each in by_share.values()}
    assert splits <= 40
    assert splits * recordings < 960 + 4 * recordings or splits == 40
    for share, of_share in by_share.items():
        times = Counter(chain(*of_share))
        assert set(times) <= sizes_mm.keys() and max(times.values()) <= splits
        # Where all parts take their turn, every recording is judged equally often.
        assert splits < 40 or set(times.values()) == {splits * (1 - share)}


@pytest.mark.parametrize("seed", range(3))
def test_splits_follow_from_order_and_seed_part_no_place_and_deal_every_size_evenly(seed):
    # The names are in reverse order; the recordings keep their order.
    called = {f"{99 - place}": name for place, name in enumerate(SIZES_MM)}
    splits, sizes_mm = draw_splits(SIZES_MM, seed, ALONE), SIZES_MM.values()
    renamed = draw_splits(dict(zip(called, sizes_mm, strict=True)), seed, {n: n for n in called})
    for share, of_share in renamed.items():
        assert [[called[name] for name in judged] for judged in of_share] == splits[share]
    assert splits != draw_splits(SIZES_MM, seed + 1, ALONE)
    sizes_mm = {f"{size}mm/{run}": float(size) for size in (0, 1, 2) for run in range(12)}
    places = {name: f"{name[:3]}/{int(name[4:]) // 3}" for name in sizes_mm}
    places["1mm/0"] = places["2mm/0"]  # A place may be passed with and without a nodule.
    for judged in chain(*draw_splits(sizes_mm, seed, places).values()):
        taught = sizes_mm.keys() - set(judged)
        assert taught and not {places[name] for name in taught} & {places[name] for name in judged}
    for of_all, where, healthy in ((sizes_mm, places, 3), (SIZES_MM, ALONE, 1)):
        parts = deal(of_all, generator(seed, "deal"), where)
        assert sorted(chain(*parts)) == sorted(of_all)
        assert {sum(of_all[name] == 0 for name in part) for part in parts} == {healthy}
