"""The strength of the contact: 1 where it is absent, else wandering, and drawn anew by slips."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.phantom.contact import reseated_strength, shaped_noise, wandering_strength
from capsule.phantom.files import DEFAULT_TABLE, read_phantom

SEAT = read_phantom(DEFAULT_TABLE, []).seat


def wander(seed, samples=990, **values):
    seat = dataclasses.replace(SEAT, **values)
    return wandering_strength(seat, np.random.default_rng(seed), 4, samples, 10.0)


@given(st.integers(0, 2**32))
def test_a_seat_that_does_not_wander_has_strength_1(seed):
    np.testing.assert_array_equal(wander(seed), np.ones((4, 990)))


def test_strength_wanders_by_as_much_and_as_slowly_as_is_set_in_each_sensor_for_itself():
    strength = np.log(wander(3, samples=200_000, strength_spread=0.2, strength_time_s=8.0))
    assert strength.std() == pytest.approx(0.2, rel=0.05)
    assert strength.mean() == pytest.approx(0.0, abs=0.02)
    # The correlation of a first-order noise falls to 1/e in its time.
    later = [np.corrcoef(row[:-80], row[80:])[0, 1] for row in strength]
    assert np.mean(later) == pytest.approx(np.exp(-1), abs=0.03)
    between = np.corrcoef(strength)[np.triu_indices(4, 1)]
    assert np.abs(between).max() < 0.1


def test_shaped_noise_has_deviation_1_whatever_the_gain():
    for gain in (np.ones(50_001), np.linspace(1, 0, 50_001) ** 4):
        noise = shaped_noise(np.random.default_rng(5), gain, 3, 50_000)
        assert noise.shape == (3, 50_000)
        assert noise.std() == pytest.approx(1.0, rel=0.05)


@given(st.integers(0, 2**32), st.lists(st.floats(0, 3), min_size=10, max_size=10))
def test_slips_that_do_not_reseat_change_no_strength(seed, slips_mm):
    wave = np.arange(990) // 100
    strength = reseated_strength(SEAT, np.random.default_rng(seed), 4, np.array(slips_mm), wave)
    np.testing.assert_array_equal(strength, np.ones((4, 990)))


def test_strength_changes_in_the_wave_after_a_slip_and_only_then():
    slips_mm = np.zeros(10)
    slips_mm[[2, 6]] = 0.7
    wave = np.arange(1000) // 100
    seat = dataclasses.replace(SEAT, reseat_spread=0.3)
    strength = reseated_strength(seat, np.random.default_rng(1), 4, slips_mm, wave)
    for row in strength:
        np.testing.assert_array_equal(np.flatnonzero(np.diff(row)) + 1, [300, 700])
    many = [
        np.log(reseated_strength(seat, np.random.default_rng(number), 4, slips_mm, wave))
        for number in range(500)
    ]
    assert np.std(many) == pytest.approx(0.3, rel=0.05)
