"""A recording without a wave on every sensor has no verdict; the traits of a wave."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from scipy import stats
from scipy.signal import lfilter

from capsule.detectors import wave as waves
from capsule.detectors.wave import find_wave, missing_wave, phase_tests, rayleigh, wave_of
from capsule.detectors.wave_traits import UNKNOWN_TRAITS, wave_shares, wave_traits
from capsule.seeding import generator

BENCH = {"wave_speed_mm_s": 25, "wavelength_mm": 80, "pitch_mm": 6.3}
BENCH |= {"full_scale": 1024, "pressing_lowers_reading": True}
FALSE_RATE = 0.01
# Each sensor lies 6.3 of 80 mm, half a radian, behind the one before.
BEHIND = -0.5 * np.arange(4)


def numbers_of(*names):
    return generator(1, "wave check", *map(str, names))


def phase_of(period, samples=400, offsets=BEHIND, wander=0.0):
    """Return the phase of waves that reach one sensor after the other, and that may wander."""
    turns = 2 * np.pi * np.arange(samples) / period + wander
    return turns + np.array(offsets)[:, np.newaxis]


def wave(numbers, travel=1.0, height=40.0, noise=4.0):
    waves = height * np.cos(phase_of(32, 420, travel * BEHIND))
    return (500 + waves + numbers.normal(0, noise, (4, 420))).round()


def reason_of(values, false_rate=FALSE_RATE, **changes):
    bench = BENCH | changes
    return missing_wave(wave_of(values, 10.0, bench), bench, false_rate)


def white(numbers):
    return (500 + numbers.normal(0, numbers.uniform(0.5, 60), (4, 420))).round()


def slow(numbers):
    recursion = [1, -numbers.uniform(0.5, 0.99)]
    return (500 + lfilter([1], recursion, numbers.normal(0, 8, (4, 620)), axis=1)[:, 200:]).round()


def test_a_recording_has_a_wave_that_travels_or_a_reason():
    usual, noise = wave(numbers_of("wave")), white(numbers_of("single"))
    for values, reason in (
        (usual, ""),
        (wave(numbers_of("back"), travel=-1.0), ""),
        (wave(numbers_of("weak"), height=4.0), ""),
        (wave(numbers_of("hum"), travel=0.0), "all sensors respond at the same time: interference"),
        (np.where(np.arange(420) // 15 == 7, np.nan, usual), ""),
        (usual[:, :162], ""),
        (usual[:, :100], "the recording is shorter than four waves of 3.2 s"),
        # A single sensor cannot be compared.
        (noise[:1], ""),
        (noise[:2], "no wave on sensor_1 and sensor_2"),
    ):
        assert reason_of(values).partition(", not")[0] == reason
        # A rate of one asks for nothing.
        assert reason_of(values, false_rate=1) == ""


@pytest.mark.takes(2)
@pytest.mark.parametrize("noise", [white, slow])
def test_a_sensor_of_noise_beside_three_with_a_wave_passes_as_rarely_as_stated(noise):
    passed, runs = 0, 150
    for run in range(runs):
        numbers = numbers_of("one of four", noise.__name__, run)
        values = wave(numbers)
        values[run % 4] = noise(numbers)[0]
        reason = reason_of(values)
        passed += not reason
        assert reason in ("", f"no wave on sensor_{run % 4 + 1}")
        if run % 6 == 0:
            assert reason_of(noise(numbers)).startswith("no wave on sensor_")
    # A rate of 1 % gives more than this only once in a thousand times.
    assert passed <= stats.binom.ppf(0.999, runs, FALSE_RATE)


def test_directions_that_all_agree_and_that_cancel_are_the_ends_of_rayleighs_test():
    for count in (4, 9, 30):
        assert rayleigh(np.exp(2j * np.pi * np.arange(count) / count)) == pytest.approx(1.0)
        agreed = np.exp(np.sqrt(1 + 4 * count) - (1 + 2 * count))
        assert rayleigh(np.full(count, 1j)) == pytest.approx(agreed)
    # Zar (2010), example 27.1: eight angles with r = 0.82522, and 0.001 < P < 0.002.
    assert 0.001 < rayleigh(np.exp(1j * np.radians([45, 55, 81, 96, 110, 117, 132, 154]))) < 0.002


@pytest.mark.parametrize(("share", "passes"), [(0.22, False), (0.28, True), (-0.28, True)])
@pytest.mark.parametrize("sensors", [2, 4])
def test_a_wave_that_travels_a_quarter_of_the_way_is_no_interference(share, passes, sensors):
    values = wave(numbers_of("quarter"), travel=share, noise=1.0)[:sensors]
    assert (reason_of(values) == "") == passes
    # Where sensors lie half a wave apart, no travel can be asked for.
    values = wave(numbers_of("half"), travel=0.0)[:sensors]
    for pitch_mm, apart in ((39.9, False), (40.0, True)):
        assert (reason_of(values, pitch_mm=pitch_mm) == "") == apart


def test_each_sensor_gets_its_part_of_the_false_rate():
    values = wave(numbers_of("part"), height=1.5)
    chances, _ = phase_tests(wave_of(values, 10.0, BENCH))
    worst = int(chances.argmax())
    assert 0 < chances[worst] < 0.2
    assert reason_of(values, 4 * chances[worst]) == ""
    refused = reason_of(values, 3.99 * chances[worst])
    assert refused.startswith("no wave on sensor_") and f"sensor_{worst + 1}" in refused


def test_missing_samples_lie_on_a_line_or_at_the_nearest_reading_and_a_wave_keeps_sixteen():
    nan = np.nan
    values = np.array([[nan, nan, 2.0, nan, nan, 8.0, nan], [1.0, nan, 5.0, 7.0, 7.0, nan, 9.0]])
    expected = [[2.0, 2.0, 2.0, 4.0, 6.0, 8.0, 8.0], [1.0, 3.0, 5.0, 7.0, 7.0, 8.0, 9.0]]
    np.testing.assert_allclose(waves.fill_missing(values), expected)
    values = numbers_of("thinned").normal(size=(2, 101))
    for period, stride in ((5.0, 1), (16.0, 1), (31.9, 1), (32.0, 2), (47.9, 2), (48.0, 3)):
        made, by = waves.thinned(values, period)
        assert by == stride
        groups = np.split(values[:, : 101 // stride * stride], 101 // stride, axis=1)
        np.testing.assert_allclose(made, np.transpose([each.mean(axis=1) for each in groups]))


def test_the_beats_keep_step_with_a_wave_whose_phase_wanders():
    # Over the run, the phase against a wave of the mean period takes all directions.
    wander = 4 * np.sin(2 * np.pi * np.arange(1000) / 500)
    chances, travel = phase_tests(find_wave(np.cos(phase_of(20.0, 1000, wander=wander)), 20.0))
    np.testing.assert_allclose(np.log(chances), np.log(rayleigh(np.ones(50))), rtol=0.2)
    assert travel == pytest.approx(-1.5, abs=0.05)


@pytest.mark.parametrize(("samples", "period"), [(100, 30), (128, 14), (129, 45), (257, 48)])
def test_the_period_equals_the_formula_written_out(samples, period):
    numbers = generator(1, "period", str(samples))
    values = np.cos(phase_of(period, samples, (0, -1))) + numbers.normal(0, 0.7, (2, samples))
    # Neither the gain nor the rest of a sensor counts, nor one that is constant.
    scaled = np.vstack([values * [[40.0], [0.1]] + [[500.0], [-3.0]], np.full(samples, 7.0)])
    # A Hann window without zeros, and four lines for each line of the next power of two.
    place = np.arange(samples)
    padded = 4 * next(2**power for power in range(20) if 2**power >= samples)
    lines = np.arange(1, padded // 2)
    rows = (values - values.mean(axis=1)[:, np.newaxis]) / values.std(axis=1)[:, np.newaxis]
    rows *= np.sin(np.pi * (place + 1) / (samples + 1)) ** 2
    turns = np.exp(-2j * np.pi * np.outer(place, lines) / padded)
    power = (np.abs(rows @ turns) ** 2).sum(axis=0)
    # Within a factor of two of the expected 25 samples.
    highest = np.where(np.abs(padded / lines - 31.25) <= 18.75, power, 0).argmax()
    before, peak, after = power[highest - 1 : highest + 2]
    off = 0.5 * (before - after) / (before - 2 * peak + after)
    assert abs(off) < 0.5
    found = waves.wave_period(scaled, 25.0)
    assert found == pytest.approx(padded / (lines[highest] + off), rel=1e-9)
    # Where the power grows beyond these ends, it is the last line, or half a line beyond.
    for beyond, end in ((14.0, 2048 / 128.5), (75.0, 64)):
        assert waves.wave_period(np.cos(phase_of(beyond, 512)), 32.0) == pytest.approx(end)


@pytest.mark.parametrize("period", [20.0, 25.3])
def test_the_phase_equals_the_formula_written_out(period):
    numbers, wave, offsets = generator(1, "phase"), round(period), [0.0, -0.7, 2.0, -2.9]
    wander = 1.5 * np.sin(2 * np.pi * np.arange(400) / 300)
    values = 40 * np.cos(phase_of(period, 400, offsets, wander)) + numbers.normal(7, 8, (4, 400))
    irregular, offset = waves.wave_phase(values, period)
    np.testing.assert_allclose(offset, offsets, atol=0.1)
    # Around each sample lies a whole window of one wave, whose mean is taken off.
    first, last = (wave - 1) // 2, 400 - wave // 2
    means = [values[:, each - first :][:, :wave].mean(axis=1) for each in range(first, last)]
    turn = np.exp(-2j * np.pi * np.arange(first, last) / period)
    steady = (values[:, first:last] - np.transpose(means)) * turn
    # A Hann window of two waves, without zeros, lies around each sample, too.
    hann = np.cos(np.pi * np.arange(-wave, wave + 1) / (2 * wave + 2)) ** 2
    unit = np.array([np.convolve(row, hann, "valid") for row in steady])
    unit /= np.abs(unit)
    apart = np.angle((unit * unit[0].conj()).sum(axis=1))
    np.testing.assert_allclose(offset, apart, atol=1e-12)
    together = np.exp(-1j * apart) @ unit
    # Near the ends no whole window fits: the deviation stays what it was.
    known = np.arange(first + wave, last - wave)
    expected = np.interp(np.arange(400), known, np.unwrap(np.angle(together)))
    np.testing.assert_allclose(irregular, expected, atol=1e-9)
    np.testing.assert_allclose(irregular[50:-50], wander[50:-50], atol=0.2)


def test_four_waves_of_the_recordings_own_period_are_needed():
    for period, least, expected in ((20.0, 80, 20.0), (64.0, 256, 64.0), (30.0, 120, 20.0)):
        # Of the last, 80 samples are four waves as configured, but its own waves take longer.
        values = np.cos(phase_of(period, least))
        assert find_wave(values, expected) is not None
        assert find_wave(values[:, :-1], expected) is None


# The traits of a wave.

# Readings beyond the full scale do not come from a divider, and stay as they are.
STILL = BENCH | {"full_scale": 1, "pressing_lowers_reading": False}
RATE_HZ = 10.0


def wave_readings(period_s=3.2, step_s=0.25, noise=0.02, sensors=4, samples=600, shape=0.3):
    """Return a wave that reaches each sensor `step_s` before the one in front of it."""
    ahead = 2 * np.pi / period_s * step_s * np.arange(sensors)
    turn = phase_of(RATE_HZ * period_s, samples, ahead)
    return np.cos(turn) + shape * np.cos(2 * turn) + numbers_of(noise).normal(0, noise, turn.shape)


def traits_of(values):
    return wave_traits(wave_of(values, RATE_HZ, STILL), RATE_HZ)


@pytest.mark.parametrize(("period_s", "step_s"), [(2.5, -0.3), (4.0, 0.0), (2.5, 0.6)])
def test_period_and_steps_are_found(period_s, step_s):
    traits = traits_of(wave_readings(period_s, step_s))
    assert (traits.period_s, traits.step_s) == pytest.approx((period_s, step_s), abs=0.01)
    assert traits.step_spread_s < 0.02 and traits.unsteadiness < 0.01 and traits.wave_share > 0.98


def test_traits_of_sensors_out_of_turn_of_other_gains_alone_or_dead():
    values = wave_readings()
    usual, swapped = traits_of(values), traits_of(values[[0, 2, 1, 3]])
    # The steps are 0.5, -0.25 and 0.5 s in place of 0.25 s.
    assert (swapped.step_spread_s, swapped.step_s) == pytest.approx((0.5, 0.25), abs=0.02)
    changed = values * [[3.0], [0.1], [7.0], [1.0]] + [[-9.0], [2.0], [0.0], [100.0]]
    np.testing.assert_allclose(astuple(traits_of(changed)), astuple(usual), rtol=1e-6)
    # A single sensor has no steps.
    single, pair = (traits_of(wave_readings(sensors=sensors)) for sensors in (1, 2))
    assert np.isnan([single.step_s, single.step_spread_s]).all()
    assert (single.period_s, pair.step_s) == pytest.approx((3.2, 0.25), abs=0.01)
    # A dead sensor, or fewer than four waves, leaves no traits.
    for without in (values * [[1], [1], [0], [1]], wave_readings(samples=100)):
        assert traits_of(without) == UNKNOWN_TRAITS


def test_an_irregular_wave_is_unsteady_and_its_depth_is_measured_along_its_own_phase():
    wandering = 0.8 * np.sin(2 * np.pi * np.arange(600) / 270)
    values = np.cos(phase_of(32, 600, wander=wandering))
    # From one wave to the next, the wandering phase changes by 2 sin(pi 3.2 / 27) times itself.
    expected = 0.8 / np.sqrt(2) * 2 * np.sin(np.pi * 3.2 / 27) / (2 * np.pi)
    assert traits_of(values).unsteadiness == pytest.approx(expected, rel=0.15)
    # The cosine has a depth of 1, however irregularly it comes, and gaps take no part in the noise.
    values += numbers_of("own phase").normal(0, 0.3, values.shape)
    for missing in (slice(0), slice(5, None, 10)):
        values[:, missing] = np.nan
        bends = np.nanmean(np.abs(np.diff(values, n=2, axis=1)), axis=1)
        assert traits_of(values).noise == pytest.approx(np.median(bends), rel=0.05)


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
    values = wave_readings(noise=0.1)
    alone = [traits_of(values[[n, n]]).wave_share for n in range(4)]
    louder = values.copy()
    louder[2] += numbers_of("louder").normal(0, 0.6, 600)
    traits = traits_of(louder)
    assert traits.wave_share < min(alone) - 0.1
    assert traits.noise == pytest.approx(traits_of(values).noise, rel=0.3)
    # A constant has no share.
    wave = wave_of(values[:, :140], RATE_HZ, STILL)
    moved = replace(wave, steady=wave.steady + 5.0)
    np.testing.assert_allclose(wave_shares(moved), wave_shares(wave))
