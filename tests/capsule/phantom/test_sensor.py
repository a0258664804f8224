"""A sensor, its converter and its imperfections, sample by sample as they are documented."""

import dataclasses
import math

import numpy as np
import pytest

from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.sensor import Sensors, base_line_jumps, counts

PHANTOM = read_phantom(DEFAULT_TABLE, [])
RANDOM = ["resistance_spread", "settling", "drift_per_s", "noise", "jump"]
SENSOR = dataclasses.replace(PHANTOM.sensor, **dict.fromkeys(RANDOM, 0.0))
IMPERFECT = {
    "hysteresis": 0.4, "hysteresis_mm": 0.6, "release_peak": 0.25, "release_s": 0.5,
    "crosstalk": 0.2, "saturation_mm": 2.0, "creep_fraction": 0.3, "creep_s": 2.0, "lag_s": 0.3,
    "gauge_per_mm": 0.05,
}  # fmt: skip


def test_converter_floors_and_ends_at_its_rails():
    ohms = np.array([[0.0, 12000.0, 1e22, 11999.0]])
    # 12 kOhm against 12 kOhm is half the reference: 512; just below it is floored to 511.
    np.testing.assert_array_equal(counts(PHANTOM.electronics, ohms), [[0, 512, 1023, 511]])


def response(sensor, pressed_mm, rate_hz=10.0):
    """Return the response of each sensor, sample by sample; before the first all was constant."""
    decays = [
        math.exp(-1 / (rate_hz * time_s)) if time_s > 0 else 0.0
        for time_s in (sensor.release_s, sensor.lag_s, sensor.creep_s)
    ]
    responses = np.zeros_like(pressed_mm)
    for number, own in enumerate(pressed_mm):
        near = [pressed_mm[other] for other in (number - 1, number + 1) if 0 <= other < 4]
        strained = (own + sensor.crosstalk * sum(near)) / sensor.saturation_mm
        all_felt = sensor.saturation_mm * np.tanh(strained)
        before = held = quick = slow = all_felt[0]
        peak, half = 0.0, sensor.hysteresis_mm / 2
        for at, felt in enumerate(all_felt):
            held = max(felt - half, min(felt + half, held))
            peak = decays[0] * peak + sensor.release_peak * max(before - felt, 0.0)
            load = (1 - sensor.hysteresis) * felt + sensor.hysteresis * held + peak
            quick = load + decays[1] * (quick - load)
            slow = load + decays[2] * (slow - load)
            responses[number, at] = quick + sensor.creep_fraction * (slow - quick)
            before = felt
    return responses


@pytest.mark.parametrize(
    "changes", [{}, IMPERFECT, IMPERFECT | {"lag_s": 0.0, "saturation_mm": 50.0}]
)
def test_compression_lowers_the_resistance_by_its_response_however_it_is_asked_for(changes):
    sensor = dataclasses.replace(SENSOR, **changes)
    steps = np.random.default_rng(1).normal(0, 0.5, (4, 200))
    pressed_mm = np.abs(np.cumsum(steps, axis=1))
    sensors = Sensors(sensor, np.random.default_rng(1), (4, 200), 10.0)
    parts = np.split(pressed_mm, [1, 8, 60], axis=1)
    ohms = np.hstack([sensors.resistance(part) for part in parts])
    # With the usual gauge some are pressed to nothing: no compression makes a resistance negative.
    share = np.maximum(1 - sensor.gauge_per_mm * response(sensor, pressed_mm), 0.0)
    np.testing.assert_allclose(ohms, sensor.resistance_ohm * share, rtol=1e-9)


def jumps(recovery_s):
    return base_line_jumps(np.random.default_rng(2), (4, 100_000), 0.02, 0.1, recovery_s, 10.0)


def test_jumps_are_as_many_and_as_large_as_is_set_and_the_base_line_returns():
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
