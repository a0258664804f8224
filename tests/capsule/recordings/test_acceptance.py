"""The check of a recording: its outcome, its samples, and the column of each sample."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.engine.configuration import read_config_file
from capsule.errors import RecordingError
from capsule.recordings.acceptance import accept, check_recording
from capsule.recordings.quality import quality_words
from capsule.recordings.recording import Recording, format_recording
from capsule.recordings.time_base import columns_by_time
from capsule.seeding import generator
from support.project import ROOT
from support.synthetic import make_recording

CONFIG = read_config_file(ROOT / "config" / "config.yaml")
LARGEST = 1_000_000
# The highest count of the ADC in the unit of each recording.
UNITS = {
    "10 bit": ({"adc_bits": "10"}, 1),
    "12 bit": ({"adc_bits": "12"}, 4),
    "volts": ({"vref_v": "5", "adc_bits": "10"}, 5 / 1024),
    "volts of 12 bit": ({"unit": "V", "vref_v": "3.3", "adc_bits": "12"}, 3.3 / 1024),
}
SECTION = {
    "rate_hz": 10,
    "rate_tolerance": 0.05,
    "max_gap_s": 2.0,
    "max_missing_fraction": 0.2,
    "max_rail_fraction": 0.5,
    "max_constant_fraction": 0.8,
    "max_sensor_correlation": 0.95,
}
SETTINGS = {"rules": SECTION, "window": 84, "length": 1000}
RULES = {"rate_hz": 10, "rate_tolerance": 0.05, "stretch": 84, "length": 1000}
SAMPLES = 520
EVEN = np.arange(SAMPLES) * 0.1


def check(values, header):
    recording = Recording(make_recording(0, "0mm/r01").time_s, values, header)
    return check_recording("0mm/r01", format_recording(recording), LARGEST, CONFIG)


@pytest.mark.parametrize(("header", "step"), UNITS.values(), ids=UNITS)
@pytest.mark.parametrize("high", [False, True], ids=["lowest", "highest"])
def test_a_loose_sensor_is_told_in_every_unit(header, step, high):
    counts = make_recording(0, "0mm/r01").values
    values = counts * step
    bits = int(header["adc_bits"])
    top = 2**bits - 1 if "vref_v" not in header else float(header["vref_v"]) * (1 - 2**-bits)
    values[2, :70] = top if high else 0
    made, readings, _ = check(values, header)
    assert made["status"] == "accepted", made["reason"]
    assert made["at_ends"] == [0, 0, pytest.approx(0.1), 0]
    assert quality_words(readings, made["at_ends"], 10.0) == (
        "sensor 3 loose: at the end of its range in 10 % of the samples"
    )


def test_a_rejected_recording_has_no_share_at_the_ends():
    values = make_recording(0, "0mm/r01").values
    values[1] = 0
    made, readings, _ = check(values, {"adc_bits": "10"})
    assert made["status"] == "rejected" and made["at_ends"] == []
    assert np.isnan(readings).all()


# Kills: samples after the wave stopped as evidence, and a time that nobody understands as none.
@pytest.mark.parametrize(
    ("stated", "status", "columns", "reason"),
    [
        ("44.8", "accepted", 448, "no wave ran from 44.8 s on"),
        ("end", "accepted", 525, ""),
        ("900", "accepted", 525, ""),
        ("3", "rejected", 1000, "30 samples, fewer than the window of 84"),
        ("soon", "rejected", 1000, "'soon'; write the time in s"),
    ],
)
def test_what_came_after_the_wave_stopped_is_no_evidence(stated, status, columns, reason):
    made = make_recording(3.0, "3mm/r01", samples=525)
    stopped = Recording(made.time_s, made.values, {"wave_until_s": stated})
    check, values, _ = check_recording("3mm/r01", format_recording(stopped), LARGEST, CONFIG)
    assert (check["status"], values.shape[1]) == (status, columns)
    assert reason in check["reason"] and bool(reason) == bool(check["reason"])
    assert check["samples"] == 525


def recording(**changes):
    made = make_recording(3.0, "3mm/r01", samples=300)
    return Recording(**(vars(made) | changes))


def test_a_regular_recording_is_taken_as_it_is():
    np.testing.assert_array_equal(accept(recording(), **SETTINGS), recording().values)


def test_samples_that_never_came_leave_a_gap_and_shift_nothing():
    whole = recording()
    keep = np.delete(np.arange(300), slice(100, 115))
    cut = Recording(whole.time_s[keep], whole.values[:, keep], whole.header)
    values = accept(cut, **SETTINGS)
    assert values.shape == (4, 300)
    assert np.isnan(values[:, 100:115]).all()
    np.testing.assert_array_equal(values[:, keep], whole.values[:, keep])


@pytest.mark.parametrize("factor", [0.96, 0.985, 1.04])
def test_a_clock_that_is_off_opens_no_gaps_and_its_readings_stand_at_their_time(factor):
    # The grid was the recording's own: at 0.96, a place at 12.45 s stood at 11.95 s.
    time_s = EVEN * factor
    phases = np.arange(4)[:, np.newaxis]
    own = 500 + 100 * np.sin(2 * np.pi * time_s / 3.2 - phases)
    values = accept(recording(time_s=time_s, values=own), **SETTINGS)
    even_s = np.arange(values.shape[1]) * 0.1
    assert time_s[-1] - 0.1 < even_s[-1] <= time_s[-1] + 1e-9
    expected = 500 + 100 * np.sin(2 * np.pi * even_s / 3.2 - phases)
    np.testing.assert_allclose(values, expected, atol=0.6)


def test_a_gap_of_a_clock_that_is_off_stays_as_long_in_time():
    kept = np.delete(np.arange(SAMPLES), np.arange(200, 215))
    whole = make_recording(0, "0mm/r01", samples=SAMPLES)
    values = accept(Recording(kept / 9.7, whole.values[:, kept], whole.header), **SETTINGS)
    missing = np.flatnonzero(np.isnan(values).all(axis=0))
    assert missing.size == pytest.approx(15 / 0.97, abs=1)
    assert missing[0] == pytest.approx(200 / 0.97, abs=1)
    assert np.isnan(values).sum() == 4 * missing.size


@pytest.mark.parametrize("drift", [0.0, 0.9e-3, -0.9e-3])
def test_readings_at_the_configured_rate_stay_to_the_bit(drift):
    whole = make_recording(0, "0mm/r01", samples=SAMPLES)
    jitter = generator(1, "jitter").normal(0, 0.002, SAMPLES)
    times_s = EVEN * (1 + drift) + jitter
    values = accept(Recording(times_s, whole.values, whole.header), **SETTINGS)
    np.testing.assert_array_equal(values, whole.values)


def test_a_copy_with_another_clock_has_the_same_marks():
    whole = make_recording(0, "0mm/r01", samples=SAMPLES)
    made = [
        check_recording(
            "0mm/r01",
            format_recording(Recording(whole.time_s * factor, whole.values, whole.header)),
            LARGEST,
            CONFIG,
        )[0]["marks"]
        for factor in (1.0, 0.96)
    ]
    assert made[0] == made[1] and made[0]


def changed_time(index, time_s):
    times = recording().time_s.copy()
    times[index] = time_s
    return {"time_s": times}


def changed_sensor(sensor, readings):
    values = recording().values.copy()
    values[sensor - 1] = readings
    return {"values": values}


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        (changed_time(5, 0.2), "time runs backwards: 0.2 s follows 0.4 s"),
        (changed_time(5, 0.4), "time repeats: 0.4 s follows 0.4 s"),
        (changed_time(299, 1e20), r"1e\+21 samples are more than the 1000 columns"),
        ({"time_s": np.arange(300) * 1e-300}, "Hz, but recording.rate_hz is 10"),
        (changed_sensor(2, 512 + 1e-12 * np.arange(300)), "sensor_2 reads 512 in all samples"),
        (changed_sensor(2, 1e-200 * np.arange(300)), "sensor_2 reads 0 in all samples"),
        ({"header": {"adc_bits": "9" * 5000}}, "adc_bits: '9999999.*', which is not a number"),
        ({"header": {"adc_bits": "33"}}, "adc_bits: '33'; allowed is a whole number, 1 to 32"),
        ({"header": {"adc_bits": "10.5"}}, "allowed is a whole number"),
        ({"header": {"vref_v": "0"}}, "vref_v: 0; it must be above 0"),
        ({"header": {"rate_hz": "20"}}, "rate_hz: 20, but the samples come at 10 Hz"),
        ({"header": {"nodule_at_mm": "here"}}, "nodule_at_mm: 'here', which is not a number"),
    ],
)
def test_what_cannot_be_used_says_why(changes, reason):
    with pytest.raises(RecordingError, match=reason):
        accept(recording(**changes), **SETTINGS)


def test_a_recording_is_never_cut_nor_shorter_than_the_window():
    with pytest.raises(RecordingError, match=r"300 samples .* raise preprocessing\.length"):
        accept(recording(), **SETTINGS | {"length": 299})
    with pytest.raises(RecordingError, match="300 samples are fewer than the window of 301"):
        accept(recording(), **SETTINGS | {"window": 301})
    single = Recording(np.array([0.0]), np.ones((4, 1)))
    with pytest.raises(RecordingError, match="at least 2 samples; this one has 1"):
        accept(single, **SETTINGS)


def test_volts_are_taken_as_they_are():
    volts = np.clip(recording().values / 204.8, 0, 2.5)
    values = accept(recording(values=volts, header={}), **SETTINGS)
    np.testing.assert_array_equal(values, volts)


MOSTLY = np.arange(300) < 200


@pytest.mark.parametrize(
    ("readings", "scale", "header"),
    [
        (np.where(MOSTLY, 1023, 500), 1.0, {"adc_bits": "10"}),
        (np.where(MOSTLY, 1023, 500), 1.0, {}),
        (np.where(MOSTLY, 4095, 500), 1.0, {}),
        (np.where(MOSTLY, 0, 500), 1.0, {}),
        (np.where(MOSTLY, 1023, 500.25), 1.0, {"adc_bits": "10"}),
        (np.where(MOSTLY, 1023, 500.25), 1.0, {"adc_bits": "10", "vref_v": "5"}),
        (np.where(MOSTLY, 1023, 500), 5 / 1023, {"vref_v": "5.0"}),
        (np.where(MOSTLY, 1023, 500), 5 / 1024, {"vref_v": "5.0", "adc_bits": "10"}),
        (np.where(MOSTLY, 0, 500), 5 / 1024, {}),
    ],
)
def test_a_sensor_at_the_end_of_the_range_is_found_in_counts_and_volts(readings, scale, header):
    values = recording().values
    values[2] = readings
    with pytest.raises(RecordingError, match=r"sensor_3 is at .* in 67 % of the samples"):
        accept(recording(values=values * scale, header=header), **SETTINGS)


def test_two_channels_that_show_one_sensor_are_refused_whatever_drifts():
    numbers = np.random.default_rng(1)
    drift = np.linspace(0, 300, 300)
    sensors = recording().values + drift
    accept(recording(values=sensors), **SETTINGS)
    sensors[3] = sensors[1] + numbers.integers(-1, 2, 300)
    # In volts, the readings are small numbers.
    for values in (sensors, 1e-4 * sensors):
        with pytest.raises(
            RecordingError,
            match=r"sensor_2 and sensor_4 give nearly the same readings \(correlation 0\.",
        ):
            accept(recording(values=values, header={}), **SETTINGS)
    accept(
        recording(values=sensors), **SETTINGS | {"rules": SECTION | {"max_sensor_correlation": 1.0}}
    )


def jittered(time_s, seed, spread_s=0.025):
    """Return times moved by random jitter; two that would change places keep theirs."""
    moved = time_s + np.random.default_rng(seed).normal(0.0, spread_s, time_s.size)
    moved[[0, -1]] = time_s[[0, -1]]
    while np.any(wrong := np.diff(moved) <= 0.001):
        swapped = np.flatnonzero(wrong)
        moved[swapped], moved[swapped + 1] = time_s[swapped], time_s[swapped + 1]
    return np.round(moved, 3)


@pytest.mark.parametrize("seed", range(10))
def test_jitter_invents_no_sample_hides_no_gap_and_moves_it_by_its_own_extent_only(seed):
    kept = np.delete(np.arange(SAMPLES), [*range(60, 75), *range(200, 210), 400, 401])
    whole = columns_by_time(jittered(EVEN, seed), **RULES)
    np.testing.assert_array_equal(whole, np.arange(SAMPLES))
    columns = columns_by_time(jittered(EVEN[kept], seed), **RULES)
    assert columns[-1] == SAMPLES - 1
    clear = np.min(np.abs(kept[:, None] - [60, 74, 200, 209, 400]), axis=1) > 5
    np.testing.assert_array_equal(columns[clear], kept[clear])
    assert np.max(np.abs(columns - kept)) <= 2


@given(st.sets(st.integers(1, 298), max_size=60), st.floats(-0.04, 0.04), st.floats(-1e6, 1e6))
def test_samples_that_never_came_shift_nothing_whatever_the_clock(lost, slow, start):
    kept = np.delete(np.arange(300), sorted(lost))
    columns = columns_by_time(start + kept * 0.1 * (1.0 + slow), **RULES)
    np.testing.assert_array_equal(columns, kept)


@pytest.mark.parametrize("rate_hz", [36, 100, 300])
def test_time_that_is_rounded_to_the_millisecond_does_not_drift(rate_hz):
    time_s = np.round(np.arange(5000) / rate_hz, 3)
    columns = columns_by_time(time_s, **RULES | {"rate_hz": rate_hz, "length": 5000})
    np.testing.assert_array_equal(columns, np.arange(5000))


def test_a_pause_of_half_an_interval_opens_no_more_than_one_column():
    columns = columns_by_time(EVEN + 0.05 * (np.arange(SAMPLES) >= 200), **RULES)
    np.testing.assert_array_equal(columns[:200], np.arange(200))
    assert set(np.diff(columns)) <= {1, 2}
    assert columns[-1] <= SAMPLES


def two_rates(second_hz, first=0.6):
    steps = np.where(np.arange(SAMPLES - 1) < first * SAMPLES, 0.1, 1.0 / second_hz)
    return np.concatenate([[0.0], np.cumsum(steps)])


@pytest.mark.parametrize("second_hz", [4, 5, 8, 9, 11, 12.5, 20, 100])
def test_a_rate_that_changes_within_is_told(second_hz):
    with pytest.raises(RecordingError, match=r"the sampling rate changes: .*cut the file there"):
        columns_by_time(two_rates(second_hz), **RULES)


@pytest.mark.parametrize("second_hz", [20, 100])
def test_a_change_too_short_for_a_rate_of_its_own_is_told_by_count_and_duration(second_hz):
    time_s = two_rates(second_hz, first=0.95)
    with pytest.raises(RecordingError, match=r"too many samples for their time: .*correct time_s"):
        columns_by_time(time_s, **RULES)


def test_more_samples_than_the_time_has_room_for_are_told():
    time_s = np.sort(np.concatenate([EVEN, EVEN[200:215] + 0.05]))
    # Also if the time does not begin at 0; 201.5 intervals are rounded to either side.
    for start_s, end_s, room in ((0.0, "20.15", 203), (700.0, "720.15", 202)):
        told = f": 204 samples up to {end_s} s, but 10 Hz give {room};"
        with pytest.raises(RecordingError, match=re.escape(told)):
            columns_by_time(time_s + start_s, **RULES)


@pytest.mark.parametrize(("lost", "accepted"), [(20, True), (21, False)])
@pytest.mark.parametrize("start", [1, 150, 278])
@pytest.mark.parametrize("begins_s", [0, 7])
def test_a_gap_may_last_exactly_as_long_as_allowed(lost, accepted, start, begins_s):
    whole = recording()
    keep = np.delete(np.arange(300), slice(start, start + lost))
    cut = Recording(begins_s + whole.time_s[keep], whole.values[:, keep], whole.header)
    if accepted:
        assert np.isnan(accept(cut, **SETTINGS)[:, start : start + lost]).all()
    else:
        reason = (
            rf"samples are missing for 2\.1 s, from {begins_s + start / 10:g} s on; at most 2 s"
        )
        with pytest.raises(RecordingError, match=reason):
            accept(cut, **SETTINGS)


def test_exactly_the_allowed_share_of_samples_may_be_missing():
    whole = recording()
    lost = np.concatenate([np.arange(start, start + 15) for start in (20, 70, 120, 170)])
    for more, accepted in (([], True), ([250], False)):
        keep = np.delete(np.arange(300), [*lost, *more])
        cut = Recording(whole.time_s[keep], whole.values[:, keep], whole.header)
        if accepted:
            assert np.isnan(accept(cut, **SETTINGS)).all(axis=0).sum() == 60
        else:
            with pytest.raises(
                RecordingError, match=r"61 of 300 samples \(20 %\) are missing; at most 20 % are"
            ):
                accept(cut, **SETTINGS)


@pytest.mark.parametrize("end", [0, 1023])
def test_exactly_the_allowed_share_of_samples_may_lie_at_the_end_of_the_range(end):
    for count, accepted in ((150, True), (151, False)):
        values = recording().values
        values[2] = np.where(np.arange(300) < count, end, np.arange(300) + 200)
        if accepted:
            accept(recording(values=values), **SETTINGS)
        else:
            with pytest.raises(RecordingError, match=f"sensor_3 is at {end}, the end"):
                accept(recording(values=values), **SETTINGS)


def test_exactly_the_allowed_share_of_samples_may_read_the_same():
    for count, accepted in ((240, True), (241, False)):
        values = recording().values
        values[1] = np.where(np.arange(300) < count, 487, np.arange(300) + 500)
        if accepted:
            accept(recording(values=values), **SETTINGS)
        else:
            with pytest.raises(
                RecordingError, match=r"sensor_2 reads 487 in 80 % .* so it is stuck or loose"
            ):
                accept(recording(values=values), **SETTINGS)


@pytest.mark.parametrize("window", [84, 85])
def test_the_correlation_of_two_sensors_is_that_of_the_readings_minus_their_means(window):
    """The limit lies exactly at the correlation that is computed slowly."""
    values = recording().values
    numbers = np.random.default_rng(2)
    values[3] = values[1] + numbers.integers(-20, 21, 300)
    half = (window - 1) // 2
    starts = range(301 - window)
    level = [[row[start : start + window].mean() for start in starts] for row in values]
    moving = values[:, half : half + len(starts)] - np.array(level)
    length = np.sqrt((moving**2).sum(axis=1))
    correlation = (moving @ moving.T) / np.outer(length, length)
    largest = correlation[np.triu_indices(4, 1)].max()
    assert largest == correlation[1, 3] < 0.999
    above = SECTION | {"max_sensor_correlation": largest + 1e-9}
    accept(recording(values=values), rules=above, window=window, length=1000)
    below = SECTION | {"max_sensor_correlation": largest - 1e-9}
    with pytest.raises(RecordingError, match=rf"sensor_2 and sensor_4 .* {largest:.3f}\)"):
        accept(recording(values=values), rules=below, window=window, length=1000)


def test_a_recording_as_long_as_the_window_or_the_matrix_is_accepted():
    whole = recording()
    # Over a single window no two sensors can be compared.
    alike = SECTION | {"max_sensor_correlation": 1.0}
    assert accept(whole, rules=alike, window=300, length=1000).shape == (4, 300)
    assert accept(whole, rules=SECTION, window=84, length=300).shape == (4, 300)


def test_counts_may_reach_both_ends_of_the_converters_range_and_nothing_beyond():
    values = recording().values
    values[0, :2] = 0, 1023
    accept(recording(values=values), **SETTINGS)
    for beyond in (-1, 1024):
        values[0, 0] = beyond
        with pytest.raises(RecordingError, match=f"sensor_1 reads {beyond}, outside the ADC's"):
            accept(recording(values=values), **SETTINGS)


def test_two_samples_are_enough_for_the_window_of_two():
    two = Recording(np.array([0.0, 0.1]), np.array([[1.0, 2.0], [4.0, 3.5]]))
    rules = SECTION | {"max_sensor_correlation": 1.0, "max_rail_fraction": 1.0}
    np.testing.assert_array_equal(accept(two, rules=rules, window=2, length=1000), two.values)


def test_the_duration_is_from_the_first_sample_to_the_last():
    made = make_recording(0, "0mm/r01")
    late = Recording(made.time_s + 7.5, made.values, made.header)
    told, _, _ = check_recording("0mm/r01", format_recording(late), LARGEST, CONFIG)
    assert told["samples"] == made.time_s.size
    assert told["duration_s"] == pytest.approx(made.time_s[-1] - made.time_s[0])


@pytest.mark.parametrize(("rate_hz", "passes"), [(9.49, 0), (9.51, 1), (10.49, 1), (10.51, 0)])
def test_the_rate_may_differ_by_the_tolerance(rate_hz, passes):
    time_s = np.arange(SAMPLES) / rate_hz
    if passes:
        np.testing.assert_array_equal(columns_by_time(time_s, **RULES), np.arange(SAMPLES))
    else:
        with pytest.raises(RecordingError, match=r"rate is .* Hz, but recording\.rate_hz is 10"):
            columns_by_time(time_s, **RULES)


@pytest.mark.parametrize(("unit", "rate"), [(1e3, 1), (1e6, 1), (1e9, 1), (1e3, 0.6), (1e3, 1.8)])
def test_the_unit_of_time_is_guessed_within_a_factor_of_two(unit, rate):
    with pytest.raises(RecordingError, match=rf"is time_s in 1/{unit:.0f} of a second\?"):
        columns_by_time(EVEN * unit * rate, **RULES)


@pytest.mark.parametrize("factor", [0.4, 2.5, 400, 2500])
def test_no_unit_of_time_is_guessed_for_another_rate(factor):
    with pytest.raises(RecordingError, match=r"recording\.rate_hz is 10$"):
        columns_by_time(EVEN * factor, **RULES)


def test_a_recording_may_fill_the_matrix_to_its_last_column():
    kept = np.delete(np.arange(SAMPLES), range(100, 110))
    columns = columns_by_time(EVEN[kept], **RULES | {"length": SAMPLES})
    np.testing.assert_array_equal(columns, kept)
    with pytest.raises(RecordingError, match=f"{SAMPLES} samples are more than the"):
        columns_by_time(EVEN[kept], **RULES | {"length": SAMPLES - 1})


@pytest.mark.parametrize("first", [1, 2, 3, 5])
def test_a_gap_near_an_end_is_kept(first):
    for lost in (first, SAMPLES - 1 - first):
        kept = np.delete(np.arange(SAMPLES), lost)
        np.testing.assert_array_equal(columns_by_time(EVEN[kept], **RULES), kept)


def test_the_change_of_the_rate_is_told_with_its_place_and_both_rates():
    # 312 steps of 0.1 s, then steps of 0.2 s; the fifth stretch of 84 begins 24 of these later.
    told = r"5 Hz in the 84 samples from 36 s on, 10 Hz in most others"
    with pytest.raises(RecordingError, match=told):
        columns_by_time(two_rates(5), **RULES)
    with pytest.raises(RecordingError, match=r"10 Hz in the 84 samples from 0 s on, 5 Hz in most"):
        columns_by_time(two_rates(5, first=0.4), **RULES | {"rate_hz": 5})


@pytest.mark.parametrize(("lost", "late"), [(1, 0.0), (1, 0.03), (3, -0.03), (17, 0.02)])
@pytest.mark.parametrize("at", [8, 100, 260, 510])
def test_a_gap_has_as_many_columns_as_samples_are_missing(lost, late, at):
    kept = np.delete(np.arange(SAMPLES), range(at, min(at + lost, SAMPLES - 1)))
    time_s = kept * 0.1
    # The first sample after the gap may come a little early or late.
    time_s[at] += late
    np.testing.assert_array_equal(columns_by_time(time_s, **RULES), kept)


@pytest.mark.parametrize("samples", [2, 3, 5, 9, 10])
def test_a_short_recording_has_a_column_for_each_sample(samples):
    np.testing.assert_array_equal(
        columns_by_time(EVEN[:samples], **RULES | {"stretch": 2}), np.arange(samples)
    )


@pytest.mark.parametrize("rate_hz", [9.7, 9.995, 10.003, 10.3])
def test_a_clock_that_runs_fast_or_slow_finds_the_gaps_at_their_size(rate_hz):
    kept = np.delete(np.arange(SAMPLES), [*range(30, 38), 200, *range(400, 419)])
    columns = columns_by_time(kept / rate_hz, **RULES)
    np.testing.assert_array_equal(columns, kept)
