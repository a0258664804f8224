"""The traits of a wave are those with which it was made."""

from dataclasses import astuple, replace

import numpy as np
import pytest

from capsule.detectors.wave import wave_of
from capsule.detectors.wave_traits import UNKNOWN_TRAITS, wave_shares, wave_traits
from capsule.seeding import generator

BENCH = {"wave_speed_mm_s": 25, "wavelength_mm": 80, "pressing_lowers_reading": False}
# Readings beyond the full scale do not come from a divider, and stay as they are.
BENCH |= {"full_scale": 1}
RATE_HZ = 10.0


def readings(period_s=3.2, step_s=0.25, noise=0.02, sensors=4, samples=600, shape=0.3):
    """Return a wave that reaches each sensor `step_s` before the one in front of it."""
    time_s = np.arange(samples) / RATE_HZ + step_s * np.arange(sensors)[:, np.newaxis]
    turn = 2 * np.pi * time_s / period_s
    numbers = generator(1, "traits", f"{period_s} {step_s} {noise} {sensors}")
    return np.cos(turn) + shape * np.cos(2 * turn) + numbers.normal(0, noise, turn.shape)


def traits_of(values):
    return wave_traits(wave_of(values, RATE_HZ, BENCH), RATE_HZ)


@pytest.mark.parametrize("period_s", [2.5, 4.0])
@pytest.mark.parametrize("step_s", [-0.3, 0.0, 0.6])
def test_period_and_steps_are_found(period_s, step_s):
    traits = traits_of(readings(period_s, step_s))
    assert traits.period_s == pytest.approx(period_s, rel=0.01)
    assert traits.step_s == pytest.approx(step_s, abs=0.01)
    assert traits.step_spread_s < 0.02
    assert traits.unsteadiness < 0.01
    assert traits.wave_share > 0.98


def test_a_sensor_out_of_turn_spreads_the_steps_and_gain_and_offset_do_not_matter():
    values = readings()
    usual, swapped = traits_of(values), traits_of(values[[0, 2, 1, 3]])
    # The steps are 0.5, -0.25 and 0.5 s in place of 0.25 s.
    assert swapped.step_spread_s == pytest.approx(0.5, abs=0.02)
    assert swapped.step_s == pytest.approx(0.25, abs=0.01)
    changed = values * [[3.0], [0.1], [7.0], [1.0]] + [[-9.0], [2.0], [0.0], [100.0]]
    np.testing.assert_allclose(astuple(traits_of(changed)), astuple(usual), rtol=1e-6)


def test_an_irregular_wave_is_unsteady_and_its_depth_is_measured_along_its_own_phase():
    time_s = np.arange(600) / RATE_HZ + 0.25 * np.arange(4)[:, np.newaxis]
    wandering = 0.8 * np.sin(2 * np.pi * np.arange(600) / RATE_HZ / 27)
    values = np.cos(2 * np.pi * time_s / 3.2 + wandering)
    # From one wave to the next, the wandering phase changes by 2 sin(pi 3.2 / 27) times itself.
    expected = 0.8 / np.sqrt(2) * 2 * np.sin(np.pi * 3.2 / 27) / (2 * np.pi)
    assert traits_of(values).unsteadiness == pytest.approx(expected, rel=0.15)
    # The cosine has a depth of 1, however irregularly it comes.
    values += generator(1, "own phase").normal(0, 0.3, values.shape)
    bends = np.abs(np.diff(values, n=2, axis=1)).mean(axis=1)
    assert traits_of(values).noise == pytest.approx(np.median(bends), rel=0.05)


def test_a_single_sensor_has_no_steps_and_a_dead_sensor_or_fewer_than_four_waves_no_traits():
    traits = traits_of(readings(sensors=1))
    assert np.isnan([traits.step_s, traits.step_spread_s]).all()
    assert traits_of(readings(sensors=2)).step_s == pytest.approx(0.25, abs=0.01)
    assert traits.period_s == pytest.approx(3.2, rel=0.01)
    dead = readings()
    dead[2] = 5.0
    for values in (dead, readings(samples=100)):
        assert traits_of(values) == UNKNOWN_TRAITS


def test_the_share_of_the_wave_counts_its_first_two_overtones_and_what_lies_near_them():
    """Tones are added to a wave; the band is 0.3 to 6.4 times its frequency."""
    time = np.arange(1600)
    wave = np.cos(2 * np.pi * time / 32)
    # Outside the band, or near the wave and its overtones, a tone takes no share of the power.
    rows = dict.fromkeys((2, 3, 1.08, 2.08, 2.92, 0.2, 6.6, 7.0), 1.0)
    rows |= dict.fromkeys((0.4, 0.5, 1.5, 2.5, 4, 5, 6, 6.2), 1 / (1 + 0.25**2))
    for multiple, share in rows.items():
        # The mean over a wave is subtracted, and that of two neighbouring samples lowers the tone.
        left = (1 - np.sinc(multiple)) * np.cos(np.pi * multiple / 32) / np.cos(np.pi / 32)
        tone = 0.25 / left * np.cos(2 * np.pi * multiple * time / 32)
        found = traits_of(np.tile(wave + tone, (2, 1))).wave_share
        assert found == pytest.approx(share, abs=0.01), multiple


def test_the_share_is_that_of_the_sensor_with_the_least_and_noise_the_median_over_sensors():
    values = readings(noise=0.1)
    alone = [traits_of(values[[n, n]]) for n in range(4)]
    louder = values.copy()
    louder[2] += generator(1, "louder").normal(0, 0.6, 600)
    traits = traits_of(louder)
    assert traits.wave_share < min(each.wave_share for each in alone) - 0.1
    assert traits.noise == pytest.approx(traits_of(values).noise, rel=0.3)


def test_a_constant_has_no_share_and_missing_samples_take_no_part_in_the_noise():
    wave = wave_of(readings(samples=140), RATE_HZ, BENCH)
    moved = replace(wave, steady=wave.steady + 5.0)
    np.testing.assert_allclose(wave_shares(moved), wave_shares(wave))
    values = readings(noise=0.3, shape=0.0)
    values[:, 100:110] = np.nan
    bends = np.abs(np.diff(values, n=2, axis=1))
    expected = np.median(np.nanmean(bends, axis=1))
    assert traits_of(values).noise == pytest.approx(expected, rel=0.03)
