"""The wave: a clock's sine where nothing is irregular, and each irregularity for itself."""

import dataclasses

import numpy as np
import pytest

from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.wall import cam_time, crest_shape, wave_height, wave_period, wave_train

PHANTOM = read_phantom(DEFAULT_TABLE, [])
WALL, SINE = PHANTOM.wall, PHANTOM.wave
PERIOD_S = wave_period(WALL)
ANGLES = np.linspace(-20, 20, 4001)


def train_of(wave, waves=40):
    return wave_train(wave, np.random.default_rng(1), PERIOD_S, waves)


def height_of(wave, time_s, waves=40):
    return wave_height(WALL, wave, train_of(wave, waves), np.array(0.0), time_s, 0.0)


@pytest.mark.parametrize("skew", [-0.9, -0.4, 0.0, 0.4, 0.9])
def test_a_skewed_wave_moves_inwards_for_its_share_of_the_period(skew):
    wave = dataclasses.replace(SINE, skew=skew)
    assert np.abs(np.diff(crest_shape(wave, ANGLES))).max() < 0.025 / (1 - abs(skew))
    # A place's angle falls with time, so what rises in time falls along the angle.
    one_period = crest_shape(wave, np.linspace(0, 2 * np.pi, 20_001))
    assert np.mean(np.diff(one_period) < 0) == pytest.approx((1 + skew) / 2, abs=1e-3)
    assert one_period[0] == one_period.max() == 1
    assert np.mean(one_period > 0) == pytest.approx(0.5, abs=1e-3)


def test_a_sharp_wave_keeps_height_and_sign_and_presses_for_a_shorter_time():
    pulse = crest_shape(dataclasses.replace(SINE, sharpness=3), ANGLES)
    np.testing.assert_allclose(pulse, np.cos(ANGLES) ** 3, atol=1e-12)


def test_periods_jitter_around_the_motors_mean_and_time_never_turns_back():
    wave = dataclasses.replace(SINE, period_spread=0.3)
    train = train_of(wave)
    periods = np.diff(train.starts_s)
    assert np.log(periods).std() == pytest.approx(0.3, rel=0.3)
    assert periods.mean() == pytest.approx(PERIOD_S)
    cams_s = cam_time(train, np.linspace(0, 40 * PERIOD_S, 5000))
    assert (np.diff(cams_s) > 0).all()
    # Where a wave really starts, the cams stand as evenly turning ones at that wave's turn.
    np.testing.assert_allclose(cam_time(train, train.starts_s), PERIOD_S * np.arange(41), atol=1e-9)


def test_crests_differ_and_some_are_missing_while_nothing_else_changes():
    wave = dataclasses.replace(SINE, amplitude_spread=0.2, missing_probability=0.25)
    crests = train_of(wave, 4000).crests
    assert np.mean(crests == 0) == pytest.approx(0.25, abs=0.02)
    assert np.log(crests[crests > 0]).std() == pytest.approx(0.2, rel=0.05)
    time_s = np.arange(0, 100, 0.05)
    sine, height = height_of(SINE, time_s), height_of(wave, time_s, 4000)
    np.testing.assert_array_equal(height[sine <= 0], sine[sine <= 0])
    # At phase 0 crest n passes place 0 at n periods.
    at_crests = [np.argmin(np.abs(time_s - number * PERIOD_S)) for number in range(25)]
    assert height[at_crests] == pytest.approx(sine[at_crests] * crests[:25], abs=1e-9)
    # The walls meet halfway.
    wild = dataclasses.replace(SINE, amplitude_spread=2.0)
    assert height_of(wild, time_s).max() == WALL.lumen_mm / 2
