"""A seed determines the random benches, and runs differ only by the nodule."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scorer_teaching import episodes
from scorer_teaching.bench_family import Effect, draw_bench
from scorer_teaching.bench_recordings import simulate_bench

from capsule.detectors.search import SERIES, series_of
from capsule.detectors.wave import wave_of
from capsule.engine.configuration import read_config_file
from capsule.seeding import generator
from support.project import ROOT

CONFIGURATION = read_config_file(ROOT / "config" / "config.yaml")
SETTINGS = CONFIGURATION["diagonal"]
SIZES_MM = np.array([0.0, 1.0, 3.0, 5.0])


def streams(number):
    return partial(generator, 1, "bench", f"{number}")


def bench(number):
    return draw_bench(streams(number)("bench"))


def runs(number, sizes_mm=SIZES_MM):
    return simulate_bench(bench(number), sizes_mm, streams(number))


@pytest.mark.parametrize("number", range(4))
def test_a_seed_draws_recordings_of_four_sensors_that_differ_by_the_nodule(number):
    drawn, made, alone = bench(number), runs(number), runs(number, np.zeros(4))
    assert drawn == bench(number) != bench(number + 1)
    for counts, again in zip(made, runs(number), strict=True):
        np.testing.assert_array_equal(counts, again)
        assert counts.dtype == np.int16
        assert counts.shape[0] == 4 and 250 <= counts.shape[1] <= 990
        assert counts.min() >= 0 and counts.max() <= 1023
    assert not np.array_equal(made[3], alone[3])
    # A nodule without height leaves nothing.
    flat = replace(drawn, lump=replace(drawn.lump, height=0.0))
    for each, healthy in zip(simulate_bench(flat, SIZES_MM, streams(number)), alone, strict=True):
        np.testing.assert_array_equal(each, healthy)


def beats_of(counts):
    return series_of(wave_of(counts.astype(float), 10, SETTINGS))


@pytest.mark.parametrize(("untouched", "low", "high"), [(0.0, 1.2, np.inf), (1.0, 0.9, 1.1)])
def test_a_high_nodule_makes_the_beats_deeper_where_sensors_touch_it(untouched, low, high):
    drawn, adds = bench(0), Effect(adds=1.0, multiplies=0.0, lifts=0.0)
    lump = replace(drawn.lump, height=1.5, effect=adds, miss_mm=0.0, untouched_share=untouched)
    bumpy = replace(drawn, lump=lump, sensing=replace(drawn.sensing, divider=True, noise=0.005))
    made = simulate_bench(bumpy, np.repeat([0.0, 5.0], 12), streams(0))
    depths = [beats_of(counts)[:, SERIES.index("depth")].max(axis=1).mean() for counts in made]
    assert low < np.median(depths[12:]) / np.median(depths[:12]) < high


def test_an_episode_holds_the_beats_of_each_recording_and_many_benches_become_episodes():
    counts = [*runs(0), np.full((4, 300), 500)]
    series, filled = episodes.episode(counts, CONFIGURATION)
    assert (series.shape, series.dtype) == ((5, 4, len(SERIES), episodes.LENGTH), np.float16)
    assert filled[-1] == 0
    beats = beats_of(counts[0])
    assert filled[0] == beats.shape[-1]
    assert series[0, ..., : filled[0]] == pytest.approx(beats, rel=1e-3, abs=1e-3)
    assert not series[0, ..., filled[0] :].any()
    makers = [lambda: runs(0, episodes.SIZES_MM), lambda: runs(1, episodes.SIZES_MM)]
    taken = episodes.episodes_of(makers, CONFIGURATION)
    assert taken.series.shape == (2, 60, 4, len(SERIES), episodes.LENGTH)
    recordings = taken.recordings(1)
    assert len(recordings) == np.count_nonzero(taken.counts[1])
    assert recordings[0].shape == (4, len(SERIES), taken.counts[1, 0])
