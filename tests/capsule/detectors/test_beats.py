import numpy as np
import pytest

from capsule.detectors.search import _in_usual_depths, beats_of, series_of
from capsule.detectors.wave import find_wave, wave_of, wave_period, wave_phase
from capsule.seeding import generator


def find_beats(values, period=32.0):
    """Return the beats of readings that no divider gives and that a press raises."""
    wave = {"wavelength_mm": 80.0, "wave_speed_mm_s": 10 * 80.0 / period}
    divider = {"full_scale": np.inf, "pressing_lowers_reading": False}
    return beats_of(wave_of(values, 10, wave | divider), wave)


def readings(samples=700, period=32.0, position_mm=None, deeper=0.0, centre=350):
    """Return readings of four sensors that each wave presses, and harder around one sample."""
    sample = np.arange(samples)
    travelled = np.zeros(samples) if position_mm is None else position_mm
    phase = 2 * np.pi * (sample / period - travelled / 80.0)
    extra = deeper * np.exp(-0.5 * ((sample - centre) / 30.0) ** 2)
    pressed = np.maximum(np.cos(phase - np.arange(4)[:, np.newaxis]) + extra, 0.0)
    noise = generator(1, "beats").normal(0.0, 0.01, pressed.shape)
    return 40 * (pressed + noise) - 512


# Kills: a line through another pair of windows, which 32 samples a wave do not show.
@pytest.mark.parametrize(
    ("samples", "period", "deeper", "expected"),
    [(700, 29.0, 0.5, 32.0), (704, 32.0, 0.5, 32.0), (700, 36.0, 60.0, 32.0)],
)
def test_the_networks_beats_lie_a_quarter_of_a_wave_apart_on_lines_between_those_of_all_windows(
    samples, period, deeper, expected
):
    wave = find_wave(readings(samples, period, deeper=deeper), expected)
    turn = np.exp(-1j * wave.phase)
    turns = np.stack([turn.real, -turn.imag, (turn**2).real, -(turn**2).imag])
    every = _in_usual_depths(wave, turns)
    centre = wave.centre(np.arange(wave.level.shape[1], dtype=float))
    series = series_of(wave)
    # The last one is at or before the last window, which an even number of quarters may reach.
    wanted = centre[0] + expected / 4 * np.arange(series.shape[2])
    assert wanted[-1] <= centre[-1] < wanted[-1] + expected / 4
    for channel, sensor in np.ndindex(5, 4):
        on_lines = np.interp(wanted, centre, every[channel, sensor]).clip(-30, 30)
        np.testing.assert_allclose(series[sensor, channel], on_lines, atol=1e-9)
    assert (np.abs(every).max() > 30) == (deeper > 1)


@pytest.mark.parametrize(("period", "wave"), [(16.0, 16), (17.0, 17)])
def test_beats_are_the_mean_and_the_harmonics_of_every_window_written_out(period, wave):
    values = readings(samples=400, period=period, deeper=0.5)
    values += np.linspace(0.0, 60.0, 400) ** 1.2
    own_period = wave_period(values, 16.0)
    assert round(own_period) == wave
    irregular, offset = wave_phase(values, own_period)
    sample, first = np.arange(400), np.arange(400 - wave + 1)
    centre = first + (wave - 1) / 2
    windows = [slice(start, start + wave) for start in first]
    expected = []
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
            channels.append(
                [2 * np.cov(steady[window], turn[window], ddof=0)[0, 1] for window in windows]
            )
        every = np.array(channels)[:, :: wave // 4]
        medians = np.median(every, axis=1, keepdims=True)
        expected.append((every - medians) / np.median(channels[1]))
    found = find_beats(values, period=16.0)
    np.testing.assert_allclose(found.channels, np.swapaxes(expected, 0, 1), atol=1e-10)
    at = centre[:: wave // 4]
    np.testing.assert_array_equal(found.centre, at)
    ahead_mm = np.interp(at, sample, irregular) * -80 / (2 * np.pi)
    ahead_mm -= np.polyval(np.polyfit(at, ahead_mm, 1), at)
    np.testing.assert_allclose(found.irregular_mm, ahead_mm, atol=1e-9)


def test_beats_do_not_depend_on_how_quickly_they_were_sampled():
    values = readings(samples=400, period=16.0, deeper=0.5)
    slow = find_beats(values, period=16.0)
    assert find_beats(values[:, :60], period=16.0) is None
    # The last three samples are too few to make another one.
    quick_values = np.concatenate([np.repeat(values, 10, axis=1), values[:, :3]], axis=1)
    quick = find_beats(quick_values, period=160.0)
    np.testing.assert_allclose(quick.channels, slow.channels, atol=1e-10)
    np.testing.assert_allclose(quick.irregular_mm, slow.irregular_mm, atol=1e-10)
    np.testing.assert_allclose(quick.centre, 10 * slow.centre + 4.5)


def test_a_nodule_deepens_the_beats_under_any_drift_and_the_phase_is_an_odometer():
    steady, values = find_beats(readings()), readings(deeper=0.5)
    assert np.abs(steady.channels).max() < 0.05 and np.abs(steady.irregular_mm).max() < 0.3
    beats = find_beats(values)
    # A beat has one contact, which is within one wave of the strongest press.
    assert (np.abs(beats.centre[beats.channels[:2].argmax(axis=2)] - 350) < 32).all()
    # A drift of five times the depth of the wave in one run.
    drifting = find_beats(values + np.linspace(0, 100, values.shape[1])).channels
    np.testing.assert_allclose(drifting[1:], beats.channels[1:], atol=0.02)
    sample = np.arange(700)
    position_mm = 0.04 * sample + 4.0 / (1 + np.exp(-(sample - 350) / 20.0))
    beats = find_beats(readings(position_mm=position_mm))
    true_mm = np.interp(beats.centre, sample, position_mm)
    true_mm -= np.polyval(np.polyfit(beats.centre, true_mm, 1), beats.centre)
    assert np.abs(beats.irregular_mm - true_mm).max() < 0.5
