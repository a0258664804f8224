"""The beats of a recording, and the search that finds where those of all sensors agree."""

from dataclasses import astuple

import numpy as np
import pytest

from capsule.detectors import search as searches
from capsule.detectors.search import UNKNOWN, Beats, beats_of, passage_of, search_beats, series_of
from capsule.detectors.wave import find_wave, wave_of, wave_period, wave_phase
from capsule.engine.configuration import read_config_file
from capsule.seeding import generator
from support.project import ROOT


def find_beats(values, period):
    """Return the beats of readings that no divider gives and that a press raises."""
    wave = {"wavelength_mm": 80.0, "wave_speed_mm_s": 10 * 80.0 / period}
    divider = {"full_scale": np.inf, "pressing_lowers_reading": False}
    return beats_of(wave_of(values, 10, wave | divider), wave)


def readings(samples, period, deeper):
    """Return readings of four sensors that each wave presses, and harder around sample 350."""
    sample = np.arange(samples)
    phase = 2 * np.pi * sample / period
    extra = deeper * np.exp(-0.5 * ((sample - 350) / 30.0) ** 2)
    pressed = np.maximum(np.cos(phase - np.arange(4)[:, np.newaxis]) + extra, 0.0)
    noise = generator(1, "beats").normal(0.0, 0.01, pressed.shape)
    return 40 * (pressed + noise) - 512


# Kills: a line through another pair of windows, which 32 samples a wave do not show.
@pytest.mark.parametrize(
    ("samples", "period", "deeper"), [(700, 29.0, 0.5), (704, 32.0, 0.5), (700, 36.0, 60.0)]
)
def test_the_networks_beats_lie_a_quarter_of_a_wave_apart_on_lines(samples, period, deeper):
    """The lines are those between the beats of all windows."""
    wave = find_wave(readings(samples, period, deeper), 32.0)
    turn = np.exp(-1j * wave.phase)
    turns = np.stack([turn.real, -turn.imag, (turn**2).real, -(turn**2).imag])
    every = searches._in_usual_depths(wave, turns)
    centre = wave.centre(np.arange(wave.level.shape[1], dtype=float))
    series = series_of(wave)
    # The last one is at or before the last window, which an even number of quarters may reach.
    wanted = centre[0] + 8.0 * np.arange(series.shape[2])
    assert wanted[-1] <= centre[-1] < wanted[-1] + 8.0
    for channel, sensor in np.ndindex(5, 4):
        on_lines = np.interp(wanted, centre, every[channel, sensor]).clip(-30, 30)
        np.testing.assert_allclose(series[sensor, channel], on_lines, atol=1e-9)
    assert (np.abs(every).max() > 30) == (deeper > 1)


@pytest.mark.parametrize(("period", "wave"), [(16.0, 16), (17.0, 17)])
def test_beats_are_the_mean_and_the_harmonics_of_every_window_written_out(period, wave):
    values = readings(400, period, 0.5) + np.linspace(0.0, 60.0, 400) ** 1.2
    own_period = wave_period(values, 16.0)
    assert round(own_period) == wave
    irregular, offset = wave_phase(values, own_period)
    sample, expected = np.arange(400), []
    windows = [slice(start, start + wave) for start in range(400 - wave + 1)]
    centre = sample[: len(windows)] + (wave - 1) / 2
    for row, start in zip(values - values.mean(axis=1, keepdims=True), offset, strict=True):
        level = np.array([row[window].mean() for window in windows])
        trend = np.interp(sample, centre, level)
        for end, (outer, inner) in ((sample < centre[0], (0, wave)),
                                    (sample > centre[-1], (-1, -1 - wave))):  # fmt: skip
            slope = (level[outer] - level[inner]) / (centre[outer] - centre[inner])
            trend[end] = level[outer] + slope * (sample[end] - centre[outer])
        steady, phase = row - trend, irregular + 2 * np.pi * sample / own_period + start
        channels = [level]
        for turn in (np.cos(phase), np.cos(2 * phase)):
            both = [np.cov(steady[window], turn[window], ddof=0)[0, 1] for window in windows]
            channels.append(2 * np.array(both))
        every = np.array(channels)[:, :: wave // 4]
        medians = np.median(every, axis=1, keepdims=True)
        expected.append((every - medians) / np.median(channels[1]))
    found = find_beats(values, 16.0)
    np.testing.assert_allclose(found.channels, np.swapaxes(expected, 0, 1), atol=1e-10)
    at = centre[:: wave // 4]
    np.testing.assert_array_equal(found.centre, at)
    ahead_mm = np.interp(at, sample, irregular) * -80 / (2 * np.pi)
    ahead_mm -= np.polyval(np.polyfit(at, ahead_mm, 1), at)
    np.testing.assert_allclose(found.irregular_mm, ahead_mm, atol=1e-9)


def test_beats_do_not_depend_on_how_quickly_they_were_sampled():
    values = readings(400, 16.0, 0.5)
    slow = find_beats(values, 16.0)
    assert find_beats(values[:, :60], 16.0) is None
    # The last three samples are too few to make another one.
    quick = find_beats(np.hstack([np.repeat(values, 10, axis=1), values[:, :3]]), 160.0)
    np.testing.assert_allclose(quick.channels, slow.channels, atol=1e-10)
    np.testing.assert_allclose(quick.irregular_mm, slow.irregular_mm, atol=1e-10)
    np.testing.assert_allclose(quick.centre, 10 * slow.centre + 4.5)


# The search.

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")["diagonal"]
SEARCH = {"level_weight": 0.0, "depth_weight": 1.0, "shape_weight": 0.0, "least_spread": 0.2}
SEARCH |= {"limit": 4.0, "pitch_mm": 6.0, "lag_range": (80.0, 300.0), "lags": 12}
SEARCH |= {"step_mm": 0.5, "width_mm": 1.0, "dwell": 12.0}
DRAWN = {"pitch_mm": (1.0, 15.0), "step_mm": (0.2, 2.0), "width_mm": (0.3, 3.0)}
DRAWN |= {"limit": (1.0, 5.0), "level_weight": (-1.0, 1.0), "shape_weight": (0.0, 1.0)}


def written_out(beats, weighted, search):
    """Return the averages of the weighted beats and of the channels by speed and place."""
    behind_mm, found = search["pitch_mm"] * np.arange(weighted.shape[0]), {}
    dwell = search["dwell"] / (beats.centre[1] - beats.centre[0])
    slowest, fastest = search["pitch_mm"] / np.array(search["lag_range"])[::-1]
    values = np.concatenate([weighted[np.newaxis], beats.channels])
    for speed in np.linspace(slowest, fastest, search["lags"]):
        head_mm = beats.irregular_mm - beats.irregular_mm[0] + speed * beats.centre
        farthest_mm = max(head_mm.max() - behind_mm[behind_mm.size // 2], 0.0)
        for place_mm in np.arange(0.0, farthest_mm + search["step_mm"] / 2, search["step_mm"]):
            off = (head_mm - behind_mm[:, np.newaxis] - place_mm) / search["width_mm"]
            presence = np.exp(-(off**2) / 2)
            averages = (values * presence).sum(axis=2) / (presence.sum(axis=1) + dwell)
            found[search["pitch_mm"] / speed, place_mm] = averages.mean(axis=1)
    return found


@pytest.mark.parametrize("number", range(12))
def test_the_search_finds_what_the_formula_written_out_finds(number):
    numbers = generator(number, "written out")
    sensors, windows = numbers.integers(1, 7), numbers.integers(20, 200)
    # With a long pitch, most sensors reach hardly any place.
    search = SEARCH | {name: numbers.uniform(*ends) for name, ends in DRAWN.items()}
    search |= {"lags": numbers.integers(1, 20), "dwell": numbers.choice([1.0, 12.0, 100.0])}
    centre = 16.0 + numbers.integers(1, 8) * np.arange(windows)
    channels = numbers.normal(0.0, 0.3, (3, sensors, windows))
    beats = Beats(channels, centre, numbers.normal(0.0, 0.2, windows).cumsum())
    weighted = searches.standardised_beats(beats, search)
    # A restless sensor says less, and a single beat not everything.
    total = np.tensordot([search["level_weight"], 1, search["shape_weight"]], channels, 1)
    low, middle = np.quantile(total, [0.25, 0.5], axis=1, keepdims=True)
    in_spreads = total / np.hypot(search["least_spread"], (middle - low) / 0.6745)
    np.testing.assert_allclose(weighted, in_spreads.clip(-search["limit"], search["limit"]))
    passage, along, beyond_mm = search_beats(beats, search)
    tried = written_out(beats, weighted, search)
    places = sorted({place for _, place in tried})
    most = [max(tried[each][0] for each in tried if each[1] == place) for place in places]
    np.testing.assert_allclose(along, most, atol=5e-6)
    assert passage.evidence == pytest.approx(max(most), abs=5e-6)
    head_mm = search["pitch_mm"] / passage.lag_samples * centre - beats.irregular_mm[0]
    np.testing.assert_allclose(beyond_mm, head_mm + beats.irregular_mm - passage.location_mm)
    best = passage.lag_samples, passage.location_mm
    (there,) = (tried[each] for each in tried if each == pytest.approx(best, rel=1e-12))
    np.testing.assert_allclose(astuple(passage)[:4], there, rtol=1e-12, atol=1e-14)
    spreads = [np.mean(np.std(each, axis=1)) for each in channels]
    np.testing.assert_allclose(astuple(passage)[-3:], spreads)


def test_where_no_sensor_meets_a_place_nothing_is_said():
    # Only the first of four sensors, which lie far apart, passes a place.
    centre, channels = np.arange(16.0, 685.0), np.zeros((3, 4, 669))
    channels[1, 0] = 0.3 * np.exp(-0.5 * ((0.045 * centre - 7.0) / 1.5) ** 2)
    search = SEARCH | {"dwell": 0.0, "pitch_mm": 100.0, "lag_range": (1300.0, 5000.0)}
    passage = search_beats(Beats(channels, centre, 0 * centre), search)[0]
    assert 0 < passage.evidence <= search["limit"] / 4
    # Without a wave, no place is the best.
    assert passage_of(wave_of(np.ones((4, 300)), 10, SETTINGS), SETTINGS) is UNKNOWN
