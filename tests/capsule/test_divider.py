import numpy as np
import pytest

from capsule.divider import relative_resistance


def test_the_reading_of_a_divider_gives_the_resistance_back():
    resistance = np.array([[3_000.0, 12_000.0, 40_000.0]])
    across_sensor = 1024 * resistance / (resistance + 12_000)
    across_series = 1024 * 12_000 / (resistance + 12_000)
    wanted = resistance / 12_000
    assert relative_resistance(across_sensor, 1024, True) == pytest.approx(wanted)
    assert relative_resistance(across_series, 1024, False) == pytest.approx(wanted)


def test_volts_and_counts_say_the_same():
    counts = np.array([[300.0, 512.0, 900.0]])
    volts = counts * 5 / 1024
    np.testing.assert_allclose(
        relative_resistance(volts, 5.0, True), relative_resistance(counts, 1024, True)
    )


def test_a_press_changes_the_resistance_alike_wherever_the_sensor_rests():
    rests = np.array([8_000.0, 12_000.0, 16_000.0])
    resistance = np.stack([rests, rests - 500], axis=1)
    readings = 1024 * resistance / (resistance + 12_000)
    steps = -np.diff(relative_resistance(readings, 1024, True), axis=1)
    np.testing.assert_allclose(steps, 500 / 12_000)
    # The readings themselves change by a tenth more or less.
    assert np.ptp(np.diff(readings, axis=1)) > 0.1 * np.abs(np.diff(readings, axis=1)).min()


def test_readings_of_no_divider_stay_as_they_are():
    readings = np.array([[-3.0, 0.5, np.nan, 2000.0]])
    np.testing.assert_array_equal(relative_resistance(readings, 1024, True), readings)
    np.testing.assert_array_equal(relative_resistance(readings, 1024, False), -readings)


def test_the_ends_of_the_converter_and_missing_samples_stay_finite_and_missing():
    given = relative_resistance(np.array([[0.0, 1023.0, np.nan]]), 1024, True)
    assert np.isfinite(given[0, :2]).all()
    assert np.isnan(given[0, 2])
    assert given[0, 0] < given[0, 1]
