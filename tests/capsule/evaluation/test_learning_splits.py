"""Splits of an archive into recordings that teach and recordings that are judged."""

from itertools import chain

import pytest

from capsule.evaluation.learning import deal, draw_splits, mean_taught
from capsule.seeding import generator

SIZES_MM = {f"{size}mm/{run}": float(size) for size in (0, 1, 2) for run in "ab"}
SIZES_MM |= {"0mm/c": 0.0, "0mm/d": 0.0}


def alone(sizes_mm):
    """Let each recording be a place of its own."""
    return {name: name for name in sizes_mm}


def test_every_size_is_dealt_evenly_and_every_recording_has_one_part():
    sizes_mm = {f"{size}mm/{run}": float(size) for size in (0, 1, 3) for run in range(9)}
    parts = deal(sizes_mm, generator(1, "deal"), alone(sizes_mm))
    assert sorted(name for part in parts for name in part) == sorted(sizes_mm)
    for size_mm in (0.0, 1.0, 3.0):
        assert {sum(sizes_mm[name] == size_mm for name in part) for part in parts} == {2, 3}


@pytest.mark.parametrize("recordings", [1, 2, 5, 8, 40, 200, 400, 700, 2000])
def test_a_split_holds_the_whole_archive_and_large_archives_are_split_less_often(recordings):
    names = [f"{place % 3}mm/{place}" for place in range(recordings)]
    sizes_mm = {name: float(name[0]) for name in names}
    by_share = draw_splits(sizes_mm, 1, alone(sizes_mm))
    splits = [split for of_share in by_share.values() for split in of_share]
    assert all(len(set(judged)) == len(judged) for judged in splits)
    assert all(set(judged) <= set(names) for judged in splits)
    assert list(by_share) == [0.25, 0.5, 0.75]
    of_half = by_share[0.5]
    assert {len(each) for each in by_share.values()} == {len(of_half)}
    assert len(splits) == 3 * len(of_half) <= 120
    assert len(of_half) * recordings < 960 + 4 * recordings or len(of_half) == 40


def test_splits_follow_from_the_order_of_the_recordings_and_the_seed_not_from_names():
    splits = draw_splits(SIZES_MM, 1, alone(SIZES_MM))
    # The names are in reverse order; the recordings keep their order.
    called = {name: f"{99 - place}" for place, name in enumerate(SIZES_MM)}
    renamed = {called[name]: size_mm for name, size_mm in SIZES_MM.items()}
    assert draw_splits(renamed, 1, alone(renamed)) == {
        share: [[called[name] for name in judged] for judged in of_share]
        for share, of_share in splits.items()
    }
    assert splits != draw_splits(SIZES_MM, 2, alone(SIZES_MM))


def test_in_a_small_archive_every_recording_is_judged_equally_often_at_each_share():
    for share in (0.25, 0.5, 0.75):
        splits = draw_splits(SIZES_MM, 1, alone(SIZES_MM))[share]
        times = [sum(name in judged for judged in splits) for name in SIZES_MM]
        assert times == [len(splits) * (1 - share)] * len(SIZES_MM)


@pytest.mark.parametrize("seed", range(5))
def test_passes_over_one_place_and_near_copies_are_never_on_both_sides(seed):
    sizes_mm = {f"{size}mm/{run}": float(size) for size in (0, 1, 2) for run in range(12)}
    places = {name: f"{name[:3]}/{int(name[4:]) // 3}" for name in sizes_mm}
    places["1mm/0"] = places["2mm/0"]  # A place may be passed with and without a nodule.
    for judged in chain(*draw_splits(sizes_mm, seed, places).values()):
        taught = sizes_mm.keys() - set(judged)
        assert taught and not {places[name] for name in taught} & {places[name] for name in judged}
    parts = deal(sizes_mm, generator(seed, "deal"), places)
    assert {sum(sizes_mm[name] == 0 for name in part) for part in parts} == {3}


def test_the_counts_of_splits_are_means_over_the_splits():
    sizes_mm = {"1mm/a": 1.0, "0mm/a": 0.0, "0mm/b": 0.0}
    splits = [["0mm/a", "1mm/a"], ["0mm/a", "0mm/b"], ["0mm/b"]]
    counts = mean_taught([(judged, 1) for judged in splits], sizes_mm)
    assert counts == pytest.approx({0.0: 2 / 3, 1.0: 2 / 3})


def test_the_counts_in_folds_are_means_over_the_recordings_that_are_judged():
    sizes_mm = {"0mm/a": 0.0, "0mm/b": 0.0, "0mm/c": 0.0, "1mm/a": 1.0}
    together = ("0mm/a", "0mm/b", "1mm/a")
    # What is held out does not count, though every fold leaves it out.
    folds = [({*each, "0mm/apart"}, len(each)) for each in (together, ("0mm/c",))]
    assert mean_taught(folds, sizes_mm) == {0.0: (1 + 1 + 1 + 2) / 4, 1.0: (0 + 0 + 0 + 1) / 4}
