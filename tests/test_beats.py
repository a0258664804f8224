import numpy as np
import pytest

from capsule.detectors.beats import fill_missing, find_beats, wave_period
from capsule.seeding import generator

WAVE = {"period": 32.0, "wavelength_mm": 80.0}


def readings(samples=700, period=32.0, position_mm=None, deeper=0.0, centre=350):
    """Four sensors pressed by half a wave each period; around a sample they are pressed more."""
    sample = np.arange(samples)
    travelled = np.zeros(samples) if position_mm is None else position_mm
    phase = 2 * np.pi * (sample / period - travelled / 80.0)
    extra = deeper * np.exp(-0.5 * ((sample - centre) / 30.0) ** 2)
    pressed = np.maximum(np.cos(phase - np.arange(4)[:, np.newaxis]) + extra, 0.0)
    noise = generator(1, "beats").normal(0.0, 0.01, pressed.shape)
    return 40 * (pressed + noise) - 512


def test_the_waves_own_period_is_found_within_a_factor_of_two():
    for period in (20.0, 32.0, 47.5):
        assert wave_period(readings(period=period), 32.0) == pytest.approx(period, rel=0.01)


def test_missing_samples_are_bridged_by_straight_lines():
    values = np.array([[np.nan, 1.0, np.nan, 3.0], [4.0, 4.0, np.nan, np.nan]])
    np.testing.assert_array_equal(fill_missing(values), [[1, 1, 2, 3], [4, 4, 4, 4]])


def test_a_steady_wave_has_only_usual_beats():
    beats = find_beats(readings(), **WAVE)
    assert np.abs(beats.channels).max() < 0.05
    assert np.abs(beats.irregular_mm).max() < 0.3


def test_beats_that_press_more_are_deeper_at_their_time():
    beats = find_beats(readings(deeper=0.5), **WAVE)
    level, depth, _ = beats.channels
    for channel in (level, depth):
        # A beat has one contact; it lies within a wave of the strongest press.
        assert (np.abs(beats.centre[channel.argmax(axis=1)] - 350) < 32).all()
    assert depth.max() > 0.2


def test_gain_offset_and_drift_of_a_sensor_hardly_matter():
    values = readings(deeper=0.5)
    plain = find_beats(values, **WAVE).channels
    scaled = find_beats(values * 0.004 + 1.5, **WAVE).channels
    np.testing.assert_allclose(scaled, plain, atol=1e-9)
    # A drift of five depths of the wave in a run.
    drifting = find_beats(values + np.linspace(0, 100, values.shape[1]), **WAVE).channels
    np.testing.assert_allclose(drifting[1:], plain[1:], atol=0.02)


def test_the_phase_is_an_odometer():
    sample = np.arange(700)
    position_mm = 0.04 * sample + 4.0 / (1 + np.exp(-(sample - 350) / 20.0))
    beats = find_beats(readings(position_mm=position_mm), **WAVE)
    true_mm = np.interp(beats.centre, sample, position_mm)
    steady = np.polyval(np.polyfit(beats.centre, true_mm, 1), beats.centre)
    assert np.abs(beats.irregular_mm - (true_mm - steady)).max() < 0.5


def test_too_short_a_recording_holds_no_beats():
    assert find_beats(readings(samples=60), **WAVE) is None
