"""A recording without a wave on every sensor has no verdict."""

import numpy as np
import pytest
from scipy import stats
from scipy.signal import lfilter

from capsule.seeding import generator
from capsule.wave import missing_wave, rayleigh

pytestmark = pytest.mark.takes(0.2)

BENCH = {
    "wave_speed_mm_s": 25,
    "wavelength_mm": 80,
    "full_scale": 1024,
    "pressing_lowers_reading": True,
    "pitch_mm": 6.3,
}
FALSE_RATE, RUNS = 0.01, 100


def numbers_of(*names):
    return generator(1, "wave check", *map(str, names))


def wave(numbers, samples=420, behind=6.3 / 80, height=40.0, noise=4.0):
    phase = np.arange(samples) / 32 - behind * np.arange(4)[:, np.newaxis]
    values = 500 + height * np.sin(2 * np.pi * phase) + numbers.normal(0, noise, (4, samples))
    return values.round()


def reason_of(values, false_rate=FALSE_RATE):
    return missing_wave(values, 10.0, BENCH, false_rate)


def white(numbers):
    return (500 + numbers.normal(0, numbers.uniform(0.5, 60), (4, 420))).round()


def toggling(numbers):
    return 500.0 + (numbers.random((4, 420)) < 0.5)


def walk(numbers):
    steps = numbers.normal(0, numbers.uniform(0.3, 6), (4, 420))
    return np.clip(500 + steps.cumsum(axis=1), 0, 1023).round()


def slow(numbers):
    recursion = [1, -numbers.uniform(0.5, 0.99)]
    return (500 + lfilter([1], recursion, numbers.normal(0, 8, (4, 620)), axis=1)[:, 200:]).round()


NOISE = [white, toggling, walk, slow]


@pytest.mark.parametrize("noise", NOISE)
def test_noise_has_no_wave(noise):
    reasons = [reason_of(noise(numbers_of(noise.__name__, run))) for run in range(RUNS)]
    assert all(reason.startswith("no wave on sensor_") for reason in reasons)


@pytest.mark.parametrize("noise", NOISE)
def test_a_sensor_of_noise_beside_three_with_a_wave_passes_as_rarely_as_stated(noise):
    passed, runs = 0, 400
    for run in range(runs):
        numbers = numbers_of("one of four", noise.__name__, run)
        values = wave(numbers)
        values[run % 4] = noise(numbers)[0]
        reason = reason_of(values)
        passed += not reason
        assert reason in ("", f"no wave on sensor_{run % 4 + 1}")
    # A rate of 1 % gives more than this only once in a thousand times.
    assert passed <= stats.binom.ppf(0.999, runs, FALSE_RATE)


def test_what_reaches_all_sensors_at_once_is_no_wave():
    assert reason_of(wave(numbers_of("hum"), behind=0.0)).startswith(
        "all sensors respond at the same time"
    )


def test_a_wave_passes_from_either_end_and_where_it_hardly_stands_out():
    for run in range(RUNS):
        numbers = numbers_of("wave", run)
        assert not reason_of(wave(numbers))
        assert not reason_of(wave(numbers, behind=-6.3 / 80))
        assert not reason_of(wave(numbers, height=4.0))


def test_gaps_are_bridged():
    values = wave(numbers_of("gap"))
    values[:, 100:115] = np.nan
    assert not reason_of(values)


def test_five_waves_can_be_told_and_three_cannot():
    whole = wave(numbers_of("short"))
    assert not reason_of(whole[:, :162])
    assert reason_of(whole[:, :100]) == "the recording is shorter than four waves of 3.2 s"


def test_a_false_rate_of_one_asks_for_nothing():
    assert not reason_of(white(numbers_of("any")), false_rate=1)


@pytest.mark.parametrize("count", [5, 13, 30])
def test_the_chance_of_random_directions_is_as_rayleigh_says(count):
    numbers = numbers_of("rayleigh", count)
    turns = np.exp(2j * np.pi * numbers.random((20_000, count)))
    chances = np.array([rayleigh(row) for row in turns])
    for level in (0.2, 0.05, 0.01):
        assert np.mean(chances <= level) == pytest.approx(level, rel=0.25)
