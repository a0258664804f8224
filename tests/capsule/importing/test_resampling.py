"""The sampling rate: no alias comes back, a slow tone stays, a gap stays a gap."""

import numpy as np
import pytest

from capsule.errors import CapsuleError
from capsule.importing.resampling import resample

# Of a tone's amplitude, away from both ends: what stands in docs/import.md.
TOLERANCE, ALIAS = 0.002, 1e-3
INSIDE = np.s_[:, 10:-10]


def tone(time_s, hertz=0.3):
    return np.sin(2 * np.pi * hertz * time_s + np.arange(4)[:, None])


def sampled(rate_hz, seconds=30.0):
    return np.arange(int(seconds * rate_hz)) / rate_hz


@pytest.mark.parametrize("rate_hz", [11, 25, 36.1, 50, 100, 333, 1000])
def test_a_slow_tone_stays_in_height_and_place_and_a_fast_one_does_not_come_back(rate_hz):
    time_s = sampled(rate_hz)
    for hertz in (0.1, 0.3125, 1.0, 2.5):
        new_s, new = resample(time_s, tone(time_s, hertz), 10.0)
        np.testing.assert_allclose(new[INSIDE], tone(new_s, hertz)[INSIDE], atol=TOLERANCE)
    # Samples that are only left out would show the last tones as these of 10 Hz.
    for folded in (0.3, 1.7, 5.0) if rate_hz >= 25 else ():
        _, new = resample(time_s, tone(time_s, 10 - folded), 10.0)
        assert np.abs(new[INSIDE]).max() < 2 * ALIAS
    new_s, new = resample(time_s, np.array([512 + 0 * time_s, 3 * time_s]), 10.0)
    exact = np.array([512 + 0 * new_s, 3 * new_s])
    whole = np.s_[:, 1:-1] if rate_hz == 11 else np.s_[:]
    np.testing.assert_allclose(new[whole], exact[whole], rtol=1e-6, atol=1e-4)


@pytest.mark.parametrize("rate_hz", [25, 36.1, 100])
def test_a_gap_stays_a_gap_and_no_more(rate_hz):
    time_s = sampled(rate_hz)
    kept = (time_s < 10.02) | (time_s > 11.53)
    new_s, new = resample(time_s[kept], tone(time_s)[:, kept], 10.0)
    # Samples that are missing are one, too.
    _, marked = resample(time_s, np.where(kept, tone(time_s), np.nan), 10.0)
    np.testing.assert_array_equal(marked, new)
    missing = np.isnan(new).all(axis=0)
    away = np.abs(new_s[:, None] - time_s[kept]).min(axis=1)
    np.testing.assert_array_equal(missing, away >= 0.05)
    assert 13 <= np.count_nonzero(missing) <= 15
    np.testing.assert_array_equal(np.isnan(new).any(axis=0), missing)
    # Within half the filter's length of a gap it has but one side.
    beside = ~missing & (np.abs(new_s - 10.775) < 1.6)
    np.testing.assert_allclose(new[:, beside], tone(new_s)[:, beside], atol=0.1)
    beyond = ~missing & ~beside & (new_s > 1) & (new_s < 29)
    np.testing.assert_allclose(new[:, beyond], tone(new_s)[:, beyond], atol=TOLERANCE)


def test_a_sample_lost_at_the_new_rate_parts_what_lies_on_either_side():
    # Kills: a gap from 2.5 intervals on. A step in the gap would ring on both sides of it.
    time_s = sampled(10)
    kept = np.abs(time_s - 10) > 0.05
    values = np.where(time_s < 10, 0.0, 100.0) * np.ones((4, 1))
    _, new = resample(time_s[kept] * 1.001, values[:, kept], 10.0)
    assert set(np.unique(new[~np.isnan(new)])) == {0.0, 100.0}


JITTER_S = np.random.default_rng(5).uniform(-0.005, 0.005, 1200)


@pytest.mark.parametrize(
    "time_s", [sampled(100)[np.arange(3000) % 7 > 0], sampled(40) + JITTER_S, sampled(6)]
)
def test_lost_samples_jitter_and_a_lower_rate_leave_no_gap(time_s):
    new_s, new = resample(time_s, tone(time_s), 10.0)
    np.testing.assert_allclose(new[INSIDE], tone(new_s + time_s[0])[INSIDE], atol=5e-3)


FILLS = "give --time-unit; otherwise give --time none"


@pytest.mark.parametrize(
    ("time_s", "words"),
    [
        (sampled(4), "4 Hz, less than half of"),
        (sampled(5) + 1e8 * (sampled(5) > 29.7), "too long for one run; correct them, or give"),
        (np.arange(100) / 1e9, FILLS),
        (np.arange(100) / 1e39, FILLS),
        # Ten samples at 100 kHz, and then a pause that is no gap yet, for ten minutes.
        (np.arange(40_000) / 1e5 + np.arange(40_000) // 10 * 0.149, FILLS),
    ],
)
def test_times_that_are_too_slow_or_would_fill_the_memory_are_refused(time_s, words):
    values = np.sin(np.arange(4 * time_s.size)).reshape(4, -1)
    with pytest.raises(CapsuleError, match=words):
        resample(time_s, values, 10.0)


def test_samples_that_lie_at_the_new_instants_are_not_smoothed():
    rng = np.random.default_rng(5)
    values = rng.normal(size=(4, 300))
    times = np.arange(300) / (10 + 1e-6) + rng.uniform(0, 1e-6, 300)
    _, new = resample(times, values, 10.0, start_s=times[20])
    np.testing.assert_allclose(new, values[:, 20 : 20 + new.shape[1]], atol=1e-5)
