"""The odometer, compared with a known way."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.survey.odometer import Odometer, nearest_turn, place_in_wave

SETTINGS = {"wavelength_mm": 80.0, "wave_speed_mm_s": 25.0, "pitch_mm": 6.3}
SPAN = 64


def felt(head_mm, wave_mm, numbers=None, noise=0.0):
    """Return the readings of four sensors that a wave presses along half of its length."""
    behind_mm = 6.3 * np.arange(4)[:, np.newaxis]
    angle = 2 * np.pi * (head_mm - behind_mm - wave_mm) / 80
    gain, rest = np.array([[1.0], [0.7], [1.3], [0.9]]), np.array([[0.2], [1.0], [-3.0], [5.0]])
    pressed = rest + gain * np.maximum(np.cos(angle + 0.4), 0)
    return pressed if numbers is None else pressed + noise * numbers.standard_normal(pressed.shape)


@given(st.floats(-30, 30), st.floats(0, 80))
def test_a_capsule_at_rest_is_found_whatever_the_phase_of_the_drive(move_mm, phase_mm):
    wave_mm = phase_mm + 2.5 * np.arange(SPAN)
    here, there = (
        place_in_wave(felt(np.full(SPAN, at), wave_mm), wave_mm, 6.3, 80.0) for at in (0.0, move_mm)
    )
    moved = nearest_turn(there - here, move_mm, 80.0)
    assert moved == pytest.approx(move_mm, abs=0.05)


def test_it_follows_a_noisy_capsule_over_several_wavelengths():
    numbers = np.random.default_rng(1)
    time = np.arange(6000)
    head_mm, wave_mm = 0.055 * time, 2.5 * time
    pressed = felt(head_mm, wave_mm, numbers, noise=0.05)
    pressed[2, 3000:3010] = np.nan
    pressed += 0.0005 * time  # drift
    odometer = Odometer(SETTINGS, 10.0, 0.0)
    errors = []
    for end in range(SPAN, time.size, 8):
        some = slice(end - SPAN, end)
        expected = odometer.position_mm if odometer.fixes else 0.0
        fix = odometer.fix(end - 1, pressed[:, some], wave_mm[some], expected)
        errors.append(fix - head_mm[end - SPAN // 2])
    assert np.std(errors) < 0.3
    assert np.ptp(odometer.way(np.arange(100, 5900)) - head_mm[100:5900]) < 2


def test_the_newest_wave_alone_gives_a_newer_position():
    numbers = np.random.default_rng(2)
    wave_mm = 2.5 * np.arange(SPAN)
    # A jump in the newer half; the fix over two waves shows half of it.
    head_mm = np.where(np.arange(SPAN) < SPAN // 2, 10.0, 13.0)
    pressed = felt(head_mm, wave_mm, numbers, noise=0.02) + 0.001 * np.arange(SPAN)
    still = felt(np.full(SPAN, 10.0), wave_mm)
    origin_mm = place_in_wave(still, wave_mm, 6.3, 80.0)
    odometer = Odometer(SETTINGS, 10.0, 10.0)
    odometer.origin_mm = origin_mm - 10.0
    assert np.isnan(odometer.newest(pressed, wave_mm))
    assert odometer.fix(63, pressed, wave_mm, 10.0) == pytest.approx(11.5, abs=0.4)
    assert odometer.newest(pressed, wave_mm) == pytest.approx(13.0, abs=0.4)
    assert np.isnan(odometer.newest(np.zeros_like(pressed), wave_mm))


def test_a_dead_sensor_is_left_out_and_three_dead_ones_say_nothing():
    wave_mm = 2.5 * np.arange(SPAN)
    pressed = felt(np.full(SPAN, 12.0), wave_mm)
    whole = place_in_wave(pressed, wave_mm, 6.3, 80.0)
    pressed[1] = 7.0
    assert place_in_wave(pressed, wave_mm, 6.3, 80.0) == pytest.approx(whole, abs=0.05)
    pressed[2] = np.nan
    assert place_in_wave(pressed, wave_mm, 6.3, 80.0) == pytest.approx(whole, abs=0.05)
    pressed[3] = 0.0
    assert np.isnan(place_in_wave(pressed, wave_mm, 6.3, 80.0))
