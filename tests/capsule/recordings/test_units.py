"""Readings mean the same in counts of any ADC, in volts and in ohms."""

import numpy as np
import pytest

from capsule.errors import RecordingError
from capsule.recordings.units import (
    adc_ends,
    on_full_scale,
    pressed_and_period,
    reading_unit,
    relative_resistance,
    share_between,
    shares_at_ends,
)

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
        (lambda scale, lowers: reading(0.9, lowers), {"unit": "V", "vref_v": "0.9"}),
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
    # Those of a good conductor are resistances, too.
    assert np.isfinite(on_full_scale(np.array([[0.5, 2.0]]), {"unit": "ohm"}, 1024, True)).all()


def test_counts_of_the_configured_converter_stay_and_a_scale_in_volts_takes_counts_too():
    counts = reading(1024).round()
    for header in ({}, {"adc_bits": "10"}, {"adc_bits": "10", "vref_v": "5"}):
        np.testing.assert_array_equal(on_full_scale(counts, header, 1024, True), counts)
    given = on_full_scale(counts, {"adc_bits": "10"}, 5, True)
    np.testing.assert_array_equal(given, counts * 5 / 1024)


def test_the_bands_at_the_ends_follow_from_bits_and_reference():
    counts = np.array([[1.0, 2.0, 700.0]])
    whole, bands = adc_ends({"adc_bits": "10"}, counts)
    assert whole and bands == [(0.0, 0.0), (1023.0, 1023.0)]
    for bits in (1, 32):
        assert adc_ends({"adc_bits": str(bits)}, counts)[1][1] == (2.0**bits - 1, 2.0**bits - 1)
    whole, bands = adc_ends({}, counts)
    assert whole and bands[1:] == [(2.0**n - 1, 2.0**n - 1) for n in (8, 10, 12, 14, 16)]
    step = 5 / 2**12
    whole, bands = adc_ends({"vref_v": "5", "adc_bits": "12"}, counts / 204.6)
    assert not whole
    assert bands == [(0.0, step / 2), (5 - 1.5 * step, 5 + step)]
    # Without bits, volts are taken for those of 10 bits; without a reference there is no upper end.
    _, bands = adc_ends({"vref_v": "5"}, counts / 204.6)
    assert bands[0] == (0.0, 5 / 2**11)
    assert adc_ends({}, counts / 204.6) == (False, [(0.0, 0.0)])
    # A unit that the header names decides: resistances have no ends, and bits make no counts.
    assert adc_ends({"unit": "ohm", "adc_bits": "10"}, counts * 100) == (False, [])
    assert shares_at_ends(counts, {"unit": "kohm"}) == [0.0]
    for unit, is_counts in (("V", False), ("counts", True)):
        assert adc_ends({"unit": unit, "adc_bits": "10"}, counts / 204.6)[0] == is_counts
    # Readings above twice the reference are averaged counts.
    for highest, counted in ((10.0, False), (10.1, True)):
        assert adc_ends({"vref_v": "5"}, np.array([[0.25, 3.0, highest]]))[0] == counted


@pytest.mark.parametrize(
    ("header", "readings", "reason"),
    [
        ({"unit": "psi"}, [1.0, 2.0], "unit: 'psi'; allowed are counts, V, ohm and kohm"),
        ({"unit": "x" * 61}, [1.0, 2.0], "unit: 'x{60}'; allowed"),
        ({"unit": "ohm"}, [1.0, -1.0], "a reading is -1; every resistance must be above 0"),
        ({"unit": "kohm"}, [12.0, 0.0], "a reading is 0; every resistance must be above 0"),
        ({"unit": "V", "vref_v": "5"}, [470.5, 541.0], "go up to 541, above vref_v: 5"),
        ({"unit": "V", "vref_v": "5"}, [2.5, 5.6], "go up to 5.6, above vref_v: 5"),
        ({"unit": "V", "vref_v": "5"}, [1.0, 5.0], "go up to 5, all whole numbers"),
        ({"unit": "V"}, [470.0, np.nan, 541.0], "go up to 541, all whole numbers"),
        ({"unit": "V", "vref_v": "5"}, [1.0, 4.0], "go up to 4, all whole numbers"),
    ],
)
def test_a_unit_in_which_the_readings_cannot_be_is_refused(header, readings, reason):
    with pytest.raises(RecordingError, match=reason):
        on_full_scale(np.array([readings]), header, 1024, True)


def test_a_unit_is_refused_before_its_readings_are_compared_with_the_converter():
    with pytest.raises(RecordingError, match="unit: 'mv'; allowed"):
        adc_ends({"unit": "mV", "adc_bits": "10"}, np.array([[2392.5, 2600.0]]))


def test_readings_are_shown_in_the_unit_to_which_they_were_brought():
    volts = np.array([[0.5, 1.2]])
    assert reading_unit({}, np.array([[1.0, 2.0]])) == "counts"
    assert reading_unit({}, volts) == reading_unit({"unit": "V"}, volts) == "V"
    # These are brought to the scale of the configured converter.
    for header in ({"vref_v": "5"}, {"unit": "ohm"}, {"unit": "counts"}):
        assert reading_unit(header, volts) == "counts"


def test_a_share_counts_both_limits_and_the_larger_end_is_told():
    values = np.array([[0.0, 0.0, 1023.0, 500.0, np.nan], [1023.0, 1023.0, 0.0, 1023.0, np.nan]])
    assert shares_at_ends(values, {"adc_bits": "10"}) == [0.5, 0.75]
    assert share_between(np.array([1.0, 2.0, 3.0, 4.0]), 2.0, 3.0) == 0.5


def test_the_scale_is_that_of_the_configured_converter_by_hand():
    header = {"unit": "kohm", "series_ohm": "12000"}
    for lowers, expected in ((True, [500.0, 250.0]), (False, [500.0, 750.0])):
        made = on_full_scale(np.array([[12.0, 4.0]]), header, 1000.0, lowers)
        np.testing.assert_allclose(made, [expected])
    # A supply may be a tenth higher than stated.
    given = on_full_scale(np.array([[2.5, 4.4]]), {"unit": "V", "vref_v": "4"}, 1024, True)
    np.testing.assert_allclose(given, [[640, 4.4 * 256]])


@pytest.mark.parametrize(("lowers", "sign"), [(True, -1), (False, 1)])
def test_pressing_raises_what_is_returned_and_a_wave_lasts_length_over_speed(lowers, sign):
    bench = {"wavelength_mm": 80, "wave_speed_mm_s": 25, "full_scale": 1024}
    bench["pressing_lowers_reading"] = lowers
    pressed, period = pressed_and_period(np.array([[300.0, 400.0, 600.0]]), 10.0, bench)
    assert period == 32.0
    assert (sign * np.diff(pressed) > 0).all()


def test_only_readings_from_the_converters_range_are_converted():
    def converted(low, high):
        readings = np.array([[low, high]])
        return not np.array_equal(relative_resistance(readings, 100.0, True), readings)

    assert converted(0.0, 100.0)
    assert not converted(-0.1, 100.0) and not converted(0.0, 100.1)
    # Two hundredths of the full scale are too near 0 to be counts.
    assert converted(0.0, 2.1) and not converted(0.0, 2.0)
    ends = relative_resistance(np.array([[0.0, 2.0, 98.0, 100.0, np.nan]]), 100.0, True)
    np.testing.assert_allclose(ends, [[2 / 98, 2 / 98, 98 / 2, 98 / 2, np.nan]])
    outside = np.array([[-3.0, 0.5, np.nan, 2000.0]])
    np.testing.assert_array_equal(relative_resistance(outside, 100.0, False), -outside)
