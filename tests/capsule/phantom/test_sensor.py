"""A sensor's imperfections: none at strength 0, otherwise as documented."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.sensor import base_line_jumps, counts, crosstalk, play, release_peak

LOADS = arrays(np.float64, (4, 30), elements=st.floats(0, 5))


def test_converter_floors_and_ends_at_its_rails():
    ohms = np.array([[0.0, 12000.0, 1e22, 11999.0]])
    # 12 kOhm against 12 kOhm is half the reference: 512; just below it is floored to 511.
    electronics = read_phantom(DEFAULT_TABLE, []).electronics
    np.testing.assert_array_equal(counts(electronics, ohms), [[0, 512, 1023, 511]])


@given(LOADS, st.floats(0.1, 2.0))
def test_play_keeps_within_half_its_width_and_does_not_depend_on_speed(load, width):
    held = play(load, width)
    assert np.abs(held - load).max() <= width / 2 + 1e-12
    slower = play(np.repeat(load, 3, axis=1), width)
    np.testing.assert_array_equal(slower[:, 2::3], held)


def test_loading_and_unloading_take_ways_that_lie_apart_by_the_width():
    load = np.concatenate([np.arange(0, 3.01, 0.1), np.arange(3, -0.01, -0.1)])[np.newaxis]
    held = play(load, 0.6)[0]
    up, down = held[:31], held[31:][::-1]
    np.testing.assert_allclose((down - up)[6:25], 0.6, atol=1e-9)
    np.testing.assert_allclose(up[6:], load[0, 6:31] - 0.3, atol=1e-9)


def test_a_second_peak_comes_on_release_only_and_decays():
    load = np.r_[np.zeros(10), np.full(10, 2.0), np.zeros(60)][np.newaxis]
    peak = release_peak(load, 0.25, 0.5, 10.0)[0]
    np.testing.assert_allclose(peak[:20], 0.0, atol=1e-12)
    assert peak[20] == pytest.approx(0.25 * 2.0)
    np.testing.assert_allclose(peak[20:40], peak[20] * np.exp(-np.arange(20) / 5), atol=1e-9)


@given(LOADS, st.floats(0.01, 0.5))
def test_crosstalk_adds_the_neighbours_and_no_others(load, share):
    near = np.eye(4, k=1) + np.eye(4, k=-1)
    np.testing.assert_allclose(crosstalk(load, share), load + share * near @ load, atol=1e-12)


def test_jumps_are_as_many_and_as_large_as_is_set_and_the_base_line_returns():
    def jumps(recovery_s):
        return base_line_jumps(np.random.default_rng(2), (4, 100_000), 0.02, 0.1, recovery_s, 10.0)

    # What returns within a sample leaves the bare jumps.
    bare, slow = jumps(1e-3), jumps(10.0)
    jumped = np.abs(bare) > 1e-9
    assert jumped.mean() == pytest.approx(0.02 / 10, rel=0.1)
    assert bare[jumped].std() == pytest.approx(0.1, rel=0.1)
    np.testing.assert_allclose(bare[:, 0], 0.0, atol=1e-15)
    first, following = np.flatnonzero(jumped[0])[:2]
    decay = np.exp(-np.arange(following - first) / 100)
    np.testing.assert_allclose(slow[0, first:following], bare[0, first] * decay, atol=1e-9)
    # Each sensor jumps for itself, and jumps that overlap add up.
    assert not (jumped[0] & jumped[1]).all()
    assert slow.std() == pytest.approx(0.1 * math.sqrt(0.02 * 10.0 / 2), rel=0.1)
