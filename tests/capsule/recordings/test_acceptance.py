"""The check of a recording: its outcome, its samples, and the column of each sample."""

from dataclasses import replace

import numpy as np
import pytest

from capsule.engine.configuration import read_config_file
from capsule.errors import RecordingError
from capsule.recordings.acceptance import accept, check_recording
from capsule.recordings.recording import Recording, format_recording
from capsule.recordings.time_base import columns_by_time
from capsule.seeding import generator
from support.project import ROOT
from support.synthetic import make_recording

CONFIG = read_config_file(ROOT / "config" / "config.yaml")
SECTION = CONFIG["recording"] | {"max_rail_fraction": 0.5}
SETTINGS = {"rules": SECTION, "window": 84, "length": 1000}
RULES = {"rate_hz": 10, "rate_tolerance": 0.05, "stretch": 84, "length": 1000}
# Of the recordings that `accept` takes, and of the times that `columns_by_time` takes.
MADE, SAMPLES = 300, 520
VOLTS = {"vref_v": "5", "adc_bits": "10"}
INDEX, EVEN = np.arange(MADE), np.arange(SAMPLES) * 0.1


def recording(**changes):
    return Recording(**(vars(make_recording(3.0, "3mm/r01", samples=MADE)) | changes))


def lacking(*lost, begins_s=0.0):
    """Return a recording without some samples."""
    whole, kept = recording(), without(*lost, samples=MADE)
    return recording(time_s=begins_s + whole.time_s[kept], values=whole.values[:, kept])


def without(*lost, samples=520):
    """Return the numbers of the samples that are kept."""
    return np.delete(np.arange(samples), [each for part in lost for each in part])


def with_sensor(number, readings):
    """Return a recording with one sensor replaced."""
    values = recording().values
    values[number - 1] = readings
    return recording(values=values)


def check(made):
    """Check the bytes of a recording as a job does."""
    return check_recording("3mm/r01", format_recording(made), 1_000_000, CONFIG)


# Outcomes.


def test_a_loose_sensor_and_marks_are_told_and_none_of_a_rejected_recording():
    values = make_recording(0, "0mm/r01").values * 5 / 1024
    time_s = np.arange(values.shape[1]) * 0.1
    values[2, :70] = 5 * 1023 / 1024
    made, *_ = check(Recording(time_s, values, VOLTS))
    assert (made["status"], made["at_ends"]) == ("accepted", [0, 0, pytest.approx(0.1), 0])
    # A copy with another clock has the same marks, and duration counts from its start.
    other, *_ = check(Recording(7.5 + time_s * 0.96, values, VOLTS))
    assert other["marks"] == made["marks"] != []
    assert other["duration_s"] == pytest.approx(0.96 * time_s[-1])
    values[1] = 0
    made, readings, _ = check(Recording(time_s, values, VOLTS))
    assert (made["status"], made["at_ends"]) == ("rejected", [])
    assert np.isnan(readings).all()


# Kills: a remedy that names another file, or a name that the refused file has already.
def test_a_file_of_another_program_is_refused_with_the_import_that_shows_it():
    content = format_recording(recording()).replace(b",", b";")
    for name, path, command in (
        ("2.5mm/r01", "", "raw/2.5mm/r01.csv --size 2.5 --name r01-imported"),
        ("unlabelled/p", "of a friend/p.csv", "'of a friend/p.csv' --unlabelled"),
    ):
        reason = check_recording(name, content, 1_000_000, CONFIG, path)[0]["reason"]
        assert reason.endswith(f": capsule import {command} --dry-run")


# Kills: samples after the wave stopped as evidence, and a time that nobody understands as none.
def test_what_came_after_the_wave_stopped_is_no_evidence():
    made = make_recording(3.0, "3mm/r01", samples=525)
    for stated, status, columns, reason in (
        ("52.4", "accepted", 524, "no wave ran from 52.4 s on"),
        ("end", "accepted", 525, ""),
        ("900", "accepted", 525, ""),
        ("3", "rejected", 1000, "30 samples, fewer than the window of 84"),
        ("soon", "rejected", 1000, "'soon'; write the time in s"),
    ):
        told, values, _ = check(replace(made, header={"wave_until_s": stated}))
        assert (told["status"], values.shape[1]) == (status, columns)
        assert reason in told["reason"] and bool(reason) == bool(told["reason"])
        assert (told["samples"], told["duration_s"]) == (525, pytest.approx(52.4))


# Samples.


@pytest.mark.parametrize("factor", [0.96, 0.985, 1.04])
def test_readings_of_a_clock_that_is_off_stand_at_their_time_and_gaps_stay_as_long(factor):
    def pressed(time_s):
        return 500 + 100 * np.sin(2 * np.pi * time_s / 3.2 - np.arange(4)[:, np.newaxis])

    # The grid was the recording's own: at 0.96, a place at 12.45 s stood at 11.95 s.
    time_s = EVEN * factor
    kept = np.delete(time_s, np.arange(200, 215))
    whole, values = (
        accept(recording(time_s=each, values=pressed(each)), **SETTINGS) for each in (time_s, kept)
    )
    even_s = np.arange(whole.shape[1]) * 0.1
    assert time_s[-1] - 0.1 < even_s[-1] <= time_s[-1] + 1e-9
    np.testing.assert_allclose(whole, pressed(even_s), atol=0.6)
    _, columns = np.isnan(values).nonzero()
    assert [columns.min(), columns.max()] == pytest.approx([200 * factor, 214 * factor], abs=1)
    assert columns.size == 4 * (np.ptp(columns) + 1)
    # Beside a gap the nearer reading stands in, at most half a sample away.
    np.testing.assert_allclose(np.where(np.isnan(values), whole, values), whole, atol=10)


# The last reading of 520 is half a sample away at 0.96e-3.
@pytest.mark.parametrize(("drift", "stay"), [(0.9e-3, True), (-0.9e-3, True), (1.2e-3, False)])
def test_readings_at_the_configured_rate_stay_to_the_bit_beside_gaps_too(drift, stay):
    whole = make_recording(0, "0mm/r01", samples=SAMPLES)
    time_s = EVEN * (1 + drift) + generator(1, "jitter").normal(0, 0.002, SAMPLES)
    kept, expected = without(range(100, 115)), whole.values.copy()
    expected[:, 100:115] = np.nan
    values = accept(Recording(time_s[kept], whole.values[:, kept], whole.header), **SETTINGS)
    assert np.array_equal(values, expected, equal_nan=True) == stay


# Reasons.


def changed_time(index, time_s):
    return recording(time_s=np.where(index == INDEX, time_s, recording().time_s))


@pytest.mark.parametrize(
    ("made", "reason"),
    [
        (Recording(np.array([0.0]), np.ones((4, 1))), "at least 2 samples; this one has 1"),
        (changed_time(5, 0.2), "time runs backwards: 0.2 s follows 0.4 s"),
        (changed_time(5, 0.4), "time repeats: 0.4 s follows 0.4 s"),
        (changed_time(299, 1e20), r"1e\+21 samples are more than the 1000 columns"),
        (recording(time_s=INDEX * 1e-300), "Hz, but recording.rate_hz is 10"),
        (with_sensor(2, 512 + 1e-12 * INDEX), "sensor_2 reads 512 in all samples"),
        (with_sensor(2, 1e-200 * INDEX), "sensor_2 reads 0 in all samples"),
        (with_sensor(1, INDEX - 1), "sensor_1 reads -1, outside the ADC's"),
        (with_sensor(1, np.where(INDEX, INDEX + 725, 0)), "sensor_1 reads 1024, outside the ADC's"),
        (with_sensor(3, np.where(INDEX < 200, 1023, INDEX)), "sensor_3 is at 1023, .* in 67 %"),
        (recording(header={"adc_bits": "9" * 5000}), "adc_bits: '9999999.*', .* not a number"),
        (recording(header={"adc_bits": "33"}), "adc_bits: '33'; .* a whole number, 1 to 32"),
        (recording(header={"vref_v": "0"}), "vref_v: 0; it must be above 0"),
        (recording(header={"rate_hz": "20"}), "rate_hz: 20, but the samples come at 10 Hz"),
        # Before its readings are compared with the converter's range.
        (recording(header={"unit": "mV", "adc_bits": "10"}), "unit: 'mv'; allowed"),
    ],
)
def test_what_cannot_be_used_says_why(made, reason):
    with pytest.raises(RecordingError, match=reason):
        accept(made, **SETTINGS)


def repeated(count, reading, others=200, per_count=1):
    """Return a recording of whose third sensor the first readings are equal."""
    made = with_sensor(3, np.where(count > INDEX, reading, INDEX + others))
    return made if per_count == 1 else recording(values=per_count * made.values, header=VOLTS)


# What makes a recording from a number, the highest number that is allowed, and the reason above it.
@pytest.mark.parametrize(
    ("make", "most", "reason"),
    [
        (lambda n: lacking(range(1, 1 + n)), 20, r"for 2\.1 s, from 0\.1 s on; at most 2 s"),
        # The longest gap counts, not the first.
        (lambda n: lacking(range(20, 25), range(278, 278 + n), begins_s=7), 20,
         r"for 2\.1 s, from 34\.8 s"),
        # In pieces of 15 at most.
        (lambda n: lacking(each // 15 * 50 + each % 15 + 20 for each in range(n)), 60,
         r"61 of 300 samples \(20 %\) are missing; at most 20 % are"),
        (lambda n: repeated(n, 0), 150, "sensor_3 is at 0, .*; at most 50 % are"),
        (lambda n: repeated(n, 1023), 150, "sensor_3 is at 1023, .* in 50 % of the samples"),
        # Averaged counts, and volts.
        (lambda n: repeated(n, 1023, 200.25), 150, "sensor_3 is at 1023, the"),
        (lambda n: repeated(n, 1023, per_count=5 / 1024), 150, "sensor_3 is at 4.99.* V, the"),
        (lambda n: repeated(n, 487, 500), 240,
         r"sensor_3 reads 487 in 80 % .* so it is stuck or loose; at most 80 % are"),
    ],
)  # fmt: skip
def test_exactly_as_much_as_allowed_is_accepted_and_no_more(make, most, reason):
    assert accept(make(most), **SETTINGS).shape == (4, MADE)
    with pytest.raises(RecordingError, match=reason):
        accept(make(most + 1), **SETTINGS)


def test_a_recording_is_never_cut_nor_shorter_than_the_window():
    # Over a single window no two sensors can be compared.
    settings = SETTINGS | {"rules": SECTION | {"max_sensor_correlation": 1.0}}
    for name, beyond, reason in (
        ("length", 299, r"300 samples .* raise preprocessing\.length"),
        ("window", 301, "300 samples are fewer than the window of 301"),
    ):
        assert accept(recording(), **settings | {name: 300}).shape == (4, MADE)
        with pytest.raises(RecordingError, match=reason):
            accept(recording(), **settings | {name: beyond})


@pytest.mark.parametrize("window", [84, 85])
def test_the_correlation_of_two_sensors_is_that_of_the_readings_minus_their_means(window):
    """The limit lies exactly at the correlation that is computed slowly."""
    values = recording().values
    values[3] = values[1] + np.random.default_rng(2).integers(-20, 21, MADE)
    level = np.array([np.convolve(row, np.full(window, 1 / window), "valid") for row in values])
    moving = values[:, (window - 1) // 2 :][:, : level.shape[1]] - level
    moving /= np.linalg.norm(moving, axis=1, keepdims=True)
    largest = moving[1] @ moving[3]
    # Over an odd window, nothing is left of a straight line minus its means. Volts are small
    # numbers, and a drift common to all sensors adds little.
    line, drift = np.vstack([INDEX + 200, values[1:]]), np.linspace(0, 300, MADE)
    for made, margin in ((1e-4 * values, 1e-9), (line, 1e-9), (values + drift, 0.02)):
        above, below = (
            SETTINGS | {"rules": SECTION | {"max_sensor_correlation": limit}, "window": window}
            for limit in (largest + margin, largest - margin)
        )
        accept(recording(values=made, header={}), **above)
        with pytest.raises(RecordingError, match=r"sensor_2 and .*_4 .*\(correlation 0\."):
            accept(recording(values=made, header={}), **below)


# Columns.


@pytest.mark.parametrize(
    ("time_s", "kept", "rules"),
    [
        # Exactly as slow as allowed; four samples that come late together are no gap.
        (np.arange(SAMPLES) / 8, without(), {"rate_hz": 8, "rate_tolerance": 0}),
        (EVEN + 0.08 * np.isin(np.arange(SAMPLES), range(200, 204)), without(), {}),
        # A pause of three quarters of an interval opens a column.
        *((EVEN + 0.1 * pause * (np.arange(SAMPLES) >= at), without(), {})
          for pause, at in ((0.5, 200), (0.7, 500))),
        (EVEN + 0.07 * (np.arange(SAMPLES) >= 500), without([100]), {}),
        *((EVEN - 0.02 * (np.arange(SAMPLES) > at), without([at]), {}) for at in (200, 500)),
        # The matrix is filled to its last column.
        (EVEN, without(range(100, 110)), {"length": SAMPLES}),
        *((EVEN, without([lost]), {}) for first in (1, 2, 3, 5) for lost in (first, 519 - first)),
        *((EVEN / 10 * each - 1e6, without(range(30, 38), [200], range(400, 419)), {})
          for each in (9.6, 9.7, 9.995, 10.003, 10.3, 10.4)),
        *((np.arange(SAMPLES) / each, without(), {}) for each in (9.51, 10.49)),
        *((EVEN, np.arange(samples), {"stretch": 2}) for samples in (2, 3, 5, 9, 10)),
        # Of two steps that differ, the usual one is not known, so the rate does not change.
        (EVEN, without(range(101, 105), range(106, 118)), {"stretch": 2}),
        *((np.round(np.arange(5000) / each, 3), np.arange(5000), {"rate_hz": each, "length": 5000})
          for each in (36, 100, 300)),
    ],
)  # fmt: skip
def test_a_column_is_that_of_the_time(time_s, kept, rules):
    np.testing.assert_array_equal(columns_by_time(time_s[kept], **RULES | rules), kept)


def jittered(time_s, seed):
    """Return times moved by random jitter, but for the first and the last."""
    moved = time_s + np.random.default_rng(seed).normal(0.0, 0.025, time_s.size)
    return np.sort([time_s[0], *moved[1:-1], time_s[-1]])


# Kills at 31: times without the line through their remainders.
@pytest.mark.parametrize("seed", [*range(4), 31])
def test_jitter_invents_no_sample_hides_no_gap_and_moves_it_by_its_own_extent_only(seed):
    whole = columns_by_time(1e6 + jittered(EVEN, seed), **RULES)
    np.testing.assert_array_equal(whole, np.arange(SAMPLES))
    kept = without(range(60, 75), range(200, 210), [400, 401])
    columns = columns_by_time(jittered(EVEN[kept], seed), **RULES)
    assert columns[-1] == SAMPLES - 1
    clear = np.min(np.abs(kept[:, None] - [60, 74, 200, 209, 400]), axis=1) > 5
    np.testing.assert_array_equal(columns[clear], kept[clear])
    assert np.max(np.abs(columns - kept)) <= 2


def two_rates(second_hz, first=0.6):
    steps = np.where(np.arange(SAMPLES - 1) < first * SAMPLES, 0.1, 1.0 / second_hz)
    return np.cumsum([0.0, *steps])


CROWDED = np.sort(np.concatenate([EVEN, EVEN[200:215] + 0.05]))
CHANGES = r"the sampling rate changes: .*cut the file there"
WRONG_RATE = r"rate is .* Hz, but recording\.rate_hz is 10"


@pytest.mark.parametrize(
    ("time_s", "reason", "rules"),
    [(*row, {}) for row in [
        *((two_rates(each), CHANGES) for each in (4, 9, 11, 100)),
        # Jitter makes a rate less certain, by its standard error.
        (two_rates(8) + generator(1, "jitter").normal(0, 0.01, SAMPLES), CHANGES),
        # 312 steps of 0.1 s, then of 0.2 s; the fifth stretch of 84 begins 24 of these later.
        (two_rates(5), r"5 Hz in the 84 samples from 36 s on, 10 Hz in most others"),
        # Such a step, then a gap, which is no step.
        (two_rates(20) + 2 * (np.arange(SAMPLES) >= 400), r"20 Hz in the 84 samples from 32\.4 s"),
        # A change too short for a rate of its own is told by count and duration.
        *((two_rates(each, 0.95), "too many samples for their time: ") for each in (20, 100)),
        # Also if the time does not begin at 0; 201.5 intervals are rounded to either side.
        (CROWDED, r": 204 samples up to 20\.15 s, but 10 Hz give 203;"),
        (CROWDED + 700, r": 204 samples up to 720\.15 s, but 10 Hz give 202;"),
        *((np.arange(SAMPLES) / each, WRONG_RATE) for each in (9.49, 10.51)),
        *((EVEN * unit * rate, rf"is time_s in 1/{unit:.0f} of a second\?")
          for unit, rate in ((1e3, 1), (1e6, 1), (1e9, 1), (1e3, 0.6), (1e3, 1.8))),
        # No unit of time is guessed for another rate.
        *((EVEN * each, f"{WRONG_RATE}$") for each in (0.4, 2.5, 400, 2500)),
    ]] + [
        # Half of a stretch is near the usual step, which counts; less than half is not.
        (np.cumsum([0, *[0.1] * 100, 0.112, 0.5]), r"8\.929 Hz in the 2 samples", {"stretch": 2}),
        (np.cumsum([0, *[0.1] * 99, 0.112, 0.5, 0.5]), " 2 Hz in the 3 samples", {"stretch": 3}),
        (EVEN, f"{SAMPLES} samples are more than the", {"length": SAMPLES - 1}),
        # The rate is checked of a recording that fills the matrix, too.
        (two_rates(8), CHANGES, {"length": SAMPLES}),
        (two_rates(5, 0.4), "10 Hz in the 84 samples from 0 s on, 5 Hz in most", {"rate_hz": 5}),
    ],
)  # fmt: skip
def test_times_that_cannot_be_used_say_why(time_s, reason, rules):
    with pytest.raises(RecordingError, match=reason):
        columns_by_time(time_s, **RULES | rules)
