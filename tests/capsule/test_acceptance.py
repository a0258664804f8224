import numpy as np
import pytest

from capsule.acceptance import accept
from capsule.errors import RecordingError
from capsule.recording import Recording
from support.synthetic import make_recording

SETTINGS = {
    "rate_hz": 10,
    "rate_tolerance": 0.05,
    "max_gap_s": 2.0,
    "max_missing_fraction": 0.2,
    "max_rail_fraction": 0.5,
    "max_constant_fraction": 0.8,
    "max_sensor_correlation": 0.95,
    "window": 84,
    "length": 1000,
}


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


def test_a_clock_that_is_off_by_a_little_opens_no_gaps():
    values = accept(recording(time_s=np.arange(300) * 0.0985), **SETTINGS)
    assert values.shape == (4, 300)
    assert not np.isnan(values).any()


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
        ({"time_s": np.arange(300) * 0.05}, "rate is 20 Hz, but recording.rate_hz is 10"),
        ({"time_s": np.arange(300) * 100.0}, "is time_s in 1/1000 of a second"),
        (changed_time(299, 1e20), r"1e\+21 samples are more than the 1000 columns"),
        ({"time_s": np.arange(300) * 1e-300}, "Hz, but recording.rate_hz is 10"),
        (changed_sensor(2, 512 + 1e-12 * np.arange(300)), "sensor_2 reads 512 in all samples"),
        (changed_sensor(2, 1e-200 * np.arange(300)), "sensor_2 reads 0 in all samples"),
        ({"header": {"adc_bits": "9" * 5000}}, "adc_bits: '9999999.*', which is not a number"),
        ({"header": {"adc_bits": "33"}}, "adc_bits: '33'; allowed is a whole number, 1 to 32"),
        ({"header": {"adc_bits": "10.5"}}, "allowed is a whole number"),
        (
            {"time_s": np.arange(300) * 0.1 + 3.0 * (np.arange(300) > 50)},
            "samples are missing for 3 s, ",
        ),
        (changed_time(299, 1e9), "more than the 1000 columns"),
        (changed_sensor(2, 512), "sensor_2 reads 512 in all samples"),
        (changed_sensor(3, np.where(np.arange(300) < 200, 1023, 500)), "sensor_3 is at 1023"),
        (changed_sensor(3, np.where(np.arange(300) < 2, 1024, 500)), "reads 1024, outside"),
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


def test_a_sensor_that_is_stuck_but_for_a_few_samples_is_refused():
    values = recording().values
    values[1] = 487
    values[1, ::9] = 488
    with pytest.raises(
        RecordingError, match=r"sensor_2 reads 487 in 89 % of the samples, so it is stuck or loose"
    ):
        accept(recording(values=values), **SETTINGS)


def test_two_channels_that_show_one_sensor_are_refused_whatever_drifts():
    numbers = np.random.default_rng(1)
    drift = np.linspace(0, 300, 300)
    sensors = recording().values + drift
    accept(recording(values=sensors), **SETTINGS)
    sensors[3] = sensors[1] + numbers.integers(-1, 2, 300)
    with pytest.raises(
        RecordingError,
        match=r"sensor_2 and sensor_4 give nearly the same readings \(correlation 0\.",
    ):
        accept(recording(values=sensors), **SETTINGS)
    accept(recording(values=sensors), **SETTINGS | {"max_sensor_correlation": 1.0})
