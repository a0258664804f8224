"""Readings mean the same in counts of any ADC, in volts and in ohms."""

import numpy as np
import pytest

from capsule.converter import on_full_scale
from capsule.divider import relative_resistance
from capsule.errors import RecordingError

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
