"""The sampling rate: no alias comes back, a slow tone stays, a gap stays a gap."""

import numpy as np
import pytest
from scipy.signal import freqz

from capsule.errors import CapsuleError
from capsule.importing.resampling import STOP_DB, low_pass, resample, usual_rate

RATES = [11, 25, 36.1, 50, 100, 333, 1000]
# Of a tone's amplitude, away from both ends: what stands in docs/import.md.
TOLERANCE = 0.002
ALIAS = 10 ** (-STOP_DB / 20)


def tone(time_s, hertz):
    return np.sin(2 * np.pi * hertz * time_s + np.arange(4)[:, None])


def sampled(rate_hz, seconds=30.0):
    return np.arange(int(seconds * rate_hz)) / rate_hz


@pytest.mark.parametrize("rate_hz", RATES)
@pytest.mark.parametrize("hertz", [0.1, 0.3125, 1.0, 2.0])
def test_a_slow_tone_is_kept_in_height_and_place(rate_hz, hertz):
    time_s = sampled(rate_hz)
    new_s, new = resample(time_s, tone(time_s, hertz), 10.0)
    inside = slice(10, -10)
    np.testing.assert_allclose(new[:, inside], tone(new_s, hertz)[:, inside], atol=TOLERANCE)


@pytest.mark.parametrize("rate_hz", [25, 36.1, 50, 100, 333, 1000])
@pytest.mark.parametrize("folded", [0.3, 1.7, 4.5])
def test_a_tone_above_the_new_nyquist_frequency_does_not_come_back(rate_hz, folded):
    hertz = 10 - folded  # would be read as `folded` at 10 Hz
    time_s = sampled(rate_hz)
    _, new = resample(time_s, tone(time_s, hertz), 10.0)
    inside = slice(10, -10)
    assert np.abs(new[:, inside]).max() < 2 * ALIAS
    # Samples that are only left out show it in full.
    assert np.abs(tone(np.arange(100) / 10, hertz)).max() > 0.9


@pytest.mark.parametrize("rate_hz", [20, 40, 100, 1000])
def test_the_filter_passes_and_stops_what_it_says(rate_hz):
    taps = low_pass(rate_hz, 10.0)
    assert taps.size % 2 == 1
    np.testing.assert_allclose(taps, taps[::-1])
    assert taps.size / rate_hz < 1.7
    hertz, response = freqz(taps, worN=8000, fs=rate_hz)
    gain = np.abs(response)
    np.testing.assert_allclose(gain[hertz <= 2.5], 1, atol=TOLERANCE)
    assert gain[hertz >= 5].max() < 1.2 * ALIAS


@pytest.mark.parametrize("rate_hz", [25, 36.1, 100])
def test_a_gap_stays_a_gap_and_no_more(rate_hz):
    time_s = sampled(rate_hz)
    values = tone(time_s, 0.3)
    kept = (time_s < 10.02) | (time_s > 11.53)
    new_s, new = resample(time_s[kept], values[:, kept], 10.0)
    missing = np.isnan(new).all(axis=0)
    away = np.abs(new_s[:, None] - time_s[kept]).min(axis=1)
    np.testing.assert_array_equal(missing, away >= 0.05)
    assert 13 <= np.count_nonzero(missing) <= 15
    np.testing.assert_array_equal(np.isnan(new).any(axis=0), missing)
    # Within half the filter's length of a gap it has but one side.
    beside = ~missing & (np.abs(new_s - 10.775) < 1.6)
    np.testing.assert_allclose(new[:, beside], tone(new_s, 0.3)[:, beside], atol=0.1)
    beyond = ~missing & ~beside & (new_s > 1) & (new_s < 29)
    np.testing.assert_allclose(new[:, beyond], tone(new_s, 0.3)[:, beyond], atol=TOLERANCE)


def test_a_sample_lost_at_the_new_rate_parts_what_lies_on_either_side():
    # Kills: a gap from 2.5 intervals on. A step in the gap would ring on both sides of it.
    time_s = sampled(10)
    kept = np.abs(time_s - 10) > 0.05
    values = np.where(time_s < 10, 0.0, 100.0) * np.ones((4, 1))
    _, new = resample(time_s[kept] * 1.001, values[:, kept], 10.0)
    assert set(np.unique(new[~np.isnan(new)])) == {0.0, 100.0}


def test_missing_samples_stay_missing():
    time_s = sampled(50)
    values = tone(time_s, 0.3)
    values[:, 500:550] = np.nan
    new_s, new = resample(time_s, values, 10.0)
    lost = np.isnan(new).all(axis=0)
    np.testing.assert_array_equal(lost, (new_s > 9.99 + 0.04) & (new_s < 10.99))


def test_single_samples_that_are_lost_at_a_high_rate_leave_no_gap():
    time_s = sampled(100)
    kept = np.arange(time_s.size) % 7 > 0
    new_s, new = resample(time_s[kept], tone(time_s, 0.3)[:, kept], 10.0)
    inside = slice(10, -10)
    np.testing.assert_allclose(new[:, inside], tone(new_s + time_s[1], 0.3)[:, inside], atol=5e-3)


def test_jitter_of_the_clock_does_no_harm():
    rng = np.random.default_rng(5)
    time_s = sampled(40) + rng.uniform(-0.005, 0.005, 1200)
    new_s, new = resample(time_s, tone(time_s, 0.3), 10.0)
    inside = slice(10, -10)
    exact = tone(new_s + time_s[0], 0.3)
    np.testing.assert_allclose(new[:, inside], exact[:, inside], atol=5e-3)


def test_a_lower_rate_is_raised_down_to_half_of_it():
    time_s = sampled(6)
    new_s, new = resample(time_s, tone(time_s, 0.3), 10.0)
    np.testing.assert_allclose(new[:, 10:-10], tone(new_s, 0.3)[:, 10:-10], atol=5e-3)
    slow = sampled(4)
    with pytest.raises(CapsuleError, match="4 Hz, less than half of"):
        resample(slow, tone(slow, 0.3), 10.0)


def test_what_is_constant_stays_and_what_rises_keeps_its_ends():
    time_s = sampled(100)
    values = np.array([np.full(time_s.size, 512.0), 3 * time_s])
    new_s, new = resample(time_s, values, 10.0)
    np.testing.assert_allclose(new, [np.full(new_s.size, 512.0), 3 * new_s], rtol=1e-6, atol=1e-4)


def test_the_usual_rate_is_that_of_most_steps():
    time_s = np.delete(sampled(36), np.arange(100, 140))
    assert usual_rate(time_s) == pytest.approx(36)


def test_a_gap_that_would_fill_the_memory_is_refused():
    time_s = sampled(5)
    time_s[-1] += 1e8
    with pytest.raises(CapsuleError, match="too long for one run; correct them, or give"):
        resample(time_s, tone(time_s, 0.3), 10.0)


@pytest.mark.parametrize(
    "time_s",
    [
        np.arange(100) / 1e9,
        np.arange(100) / 1e39,
        # Ten samples at 100 kHz, and then a pause that is no gap yet, for ten minutes.
        np.arange(40_000) / 1e5 + np.arange(40_000) // 10 * 0.149,
    ],
    ids=["1 GHz", "an odd header", "short bursts"],
)
def test_a_rate_that_would_fill_the_memory_is_refused(time_s):
    values = np.sin(np.arange(4 * time_s.size)).reshape(4, -1)
    with pytest.raises(CapsuleError, match="give --time-unit; otherwise give --time none"):
        resample(time_s, values, 10.0)


def test_samples_that_lie_at_the_new_instants_are_not_smoothed():
    rng = np.random.default_rng(5)
    values = rng.normal(size=(4, 300))
    times = np.arange(300) / (10 + 1e-6) + rng.uniform(0, 1e-6, 300)
    _, new = resample(times, values, 10.0, start_s=times[20])
    np.testing.assert_allclose(new, values[:, 20 : 20 + new.shape[1]], atol=1e-5)
