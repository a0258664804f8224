"""Readings mean the same in counts of any ADC, in volts and in ohms."""

import numpy as np
import pytest

from capsule.errors import RecordingError
from capsule.units import on_full_scale, relative_resistance

SERIES_OHM = 12_000.0
OHM = SERIES_OHM * np.exp(np.random.default_rng(3).uniform(-1, 1, (4, 50)))


def reading(full_scale, lowers=True):
    across = OHM if lowers else SERIES_OHM
    return full_scale * across / (OHM + SERIES_OHM)


@pytest.mark.parametrize("lowers", [True, False])
@pytest.mark.parametrize(
    ("values", "header"),
    [
        (reading, {"unit": "counts", "adc_bits": "10"}),
        (lambda scale, lowers: reading(4096, lowers), {"unit": "counts", "adc_bits": "12"}),
        (lambda scale, lowers: reading(5.0, lowers), {"vref_v": "5"}),
        (lambda scale, lowers: reading(3.3, lowers), {"unit": "V", "vref_v": "3.3"}),
        (lambda scale, lowers: OHM, {"unit": "ohm", "series_ohm": "12000"}),
        (lambda scale, lowers: OHM / 1000, {"unit": "kohm", "series_ohm": "12000"}),
    ],
)
def test_every_unit_gives_the_same_resistances(values, header, lowers):
    given = on_full_scale(values(1024, lowers), header, 1024, lowers)
    resistance = relative_resistance(given, 1024, lowers)
    np.testing.assert_allclose(resistance, OHM / SERIES_OHM, rtol=1e-9)


def test_ohms_without_the_resistor_in_series_keep_their_ratios():
    given = on_full_scale(OHM / 1000, {"unit": "kohm"}, 1024, True)
    resistance = relative_resistance(given, 1024, True)
    np.testing.assert_allclose(resistance / resistance[0, 0], OHM / OHM[0, 0], rtol=1e-9)


@pytest.mark.parametrize("header", [{}, {"adc_bits": "10"}, {"adc_bits": "10", "vref_v": "5"}])
def test_counts_of_the_configured_converter_stay_as_they_are(header):
    counts = reading(1024).round()
    np.testing.assert_array_equal(on_full_scale(counts, header, 1024, True), counts)


def test_a_scale_in_volts_takes_counts_too():
    counts = reading(1024).round()
    np.testing.assert_allclose(
        on_full_scale(counts, {"adc_bits": "10"}, 5, True), counts * 5 / 1024
    )


def test_volts_and_kilo_ohms_without_a_header_are_taken_as_linear():
    for values in (reading(5.0), OHM / 1000 / 10):
        np.testing.assert_array_equal(relative_resistance(values, 1024, True), values)


@pytest.mark.parametrize(
    ("header", "reason"),
    [
        ({"unit": "psi"}, "unit: 'psi'; allowed are counts, V, ohm and kohm"),
        ({"unit": "ohm"}, "unit: ohm, but a reading is -1; every resistance must be above 0"),
    ],
)
def test_a_unit_that_cannot_be_is_refused(header, reason):
    with pytest.raises(RecordingError, match=reason):
        on_full_scale(np.full((4, 9), -1.0), header, 1024, True)


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
