"""Readings mean the same in counts of any ADC, in volts and in ohms."""

import numpy as np
import pytest

from capsule.errors import RecordingError
from capsule.recordings import units

TEN_BITS, KOHM = {"adc_bits": "10"}, {"unit": "kohm", "series_ohm": "12000"}


def test_each_unit_is_brought_to_the_configured_scale():
    for values, header, scale, lowers, expected in (
        *(([12, 700], each, 1024, True, [12, 700])
          for each in ({}, TEN_BITS, TEN_BITS | {"unit": "counts", "vref_v": "5"})),
        ([2048, 4095], {"adc_bits": "12"}, 1024, True, [512, 1023.75]),
        # A scale in volts takes counts, too.
        ([256, 1023], TEN_BITS, 5, True, [1.25, 1023 * 5 / 1024]),
        ([2.5, 0.5], {"vref_v": "5"}, 1024, True, [512, 102.4]),
        # A supply may be a tenth higher than stated.
        ([2.5, 4.4], {"unit": "V", "vref_v": "4"}, 1024, True, [640, 4.4 * 256]),
        ([12, 4], KOHM, 1000, True, [500, 250]),
        ([12, 4], KOHM, 1000, False, [500, 750]),
        ([12000, 4000], KOHM | {"unit": "ohm"}, 1000, True, [500, 250]),
        # Without the resistor in series, the median stands in, also for a good conductor.
        ([4, 12, 36], {"unit": "kohm"}, 1000, True, [250, 500, 750]),
        ([0.5, 2, np.nan], {"unit": "ohm"}, 1000, True, [2000 / 7, 8000 / 13, np.nan]),
    ):  # fmt: skip
        given = units.on_full_scale(np.array([values], dtype=float), header, scale, lowers)
        np.testing.assert_allclose(given, [expected])


ZERO, STEP_V = (0.0, 0.0), 5 / 2**12
OF_5_V = [(0.0, STEP_V / 2), (5 - 1.5 * STEP_V, 5 + STEP_V)]
COUNTS, VOLTS = [1.0, 2.0, 700.0], [0.005, 2.0, 3.4]
BITS = {n: (2.0**n - 1, 2.0**n - 1) for n in (1, 8, 10, 12, 14, 16, 32)}


def test_the_bands_at_the_ends_follow_from_bits_and_reference():
    for header, readings, is_counts, bands in (
        *(({"adc_bits": f"{n}"}, COUNTS, True, [ZERO, BITS[n]]) for n in (1, 10, 32)),
        ({}, COUNTS, True, [ZERO, *(BITS[n] for n in (8, 10, 12, 14, 16))]),
        ({"vref_v": "5", "adc_bits": "12"}, VOLTS, False, OF_5_V),
        # Without bits, volts are those of 10 bits; without a reference there is no upper end.
        ({"vref_v": "5"}, VOLTS, False, [(0.0, 2 * STEP_V), (5 - 6 * STEP_V, 5 + 4 * STEP_V)]),
        ({}, VOLTS, False, [ZERO]),
        # A unit that the header names decides: resistances have no ends, and bits make no counts.
        ({"unit": "ohm", "adc_bits": "10"}, COUNTS, False, []),
        ({"unit": "V", "adc_bits": "10"}, VOLTS, False, [(0.0, 0.0)]),
        ({"unit": "counts", "adc_bits": "10"}, VOLTS, True, [ZERO, BITS[10]]),
        # Averaged counts: with bits, and above twice the reference.
        ({"adc_bits": "10"}, VOLTS, True, [ZERO, BITS[10]]),
        ({"vref_v": "5", "adc_bits": "10"}, [0.25, 10.1], True, [ZERO, BITS[10]]),
        ({"vref_v": "5", "adc_bits": "12"}, [0.25, 10.0], False, OF_5_V),
    ):  # fmt: skip
        assert units.adc_ends(header, np.array([readings])) == (is_counts, bands), header


def test_a_unit_in_which_the_readings_cannot_be_is_refused():
    for header, readings, reason in (
        ({"unit": "psi"}, [1.0, 2.0], "unit: 'psi'; allowed are counts, V, ohm and kohm"),
        ({"unit": "ohm"}, [1.0, -1.0], "a reading is -1; every resistance must be above 0"),
        ({"unit": "kohm"}, [12.0, 0.0], "a reading is 0; every"),
        ({"unit": "V", "vref_v": "5"}, [2.5, 5.6], "go up to 5.6, above vref_v: 5"),
        ({"unit": "V", "vref_v": "5"}, [1.0, 5.0], "go up to 5, all whole numbers"),
        ({"unit": "V"}, [470.0, np.nan, 541.0], "go up to 541, all whole numbers"),
    ):
        with pytest.raises(RecordingError, match=reason):
            units.on_full_scale(np.array([readings]), header, 1024, True)


def test_readings_are_shown_in_the_unit_to_which_they_were_brought():
    volts = np.array([[0.5, 1.2]])
    assert units.reading_unit({}, np.array([[1.0, 2.0]])) == "counts"
    assert units.reading_unit({}, volts) == units.reading_unit({"unit": "V"}, volts) == "V"
    # These are brought to the scale of the configured converter.
    for header in ({"vref_v": "5"}, {"unit": "ohm"}, {"unit": "counts"}):
        assert units.reading_unit(header, volts) == "counts"


def test_the_larger_share_at_an_end_is_told_of_each_sensor():
    values = np.array([[0.0, 0.0, 1023.0, 500.0, np.nan], [1023.0, 1023.0, 0.0, 1023.0, np.nan]])
    assert units.shares_at_ends(values, {"adc_bits": "10"}) == [0.5, 0.75]
    assert units.shares_at_ends(values, {"unit": "kohm"}) == [0.0, 0.0]


def test_pressing_raises_what_is_returned_and_a_wave_lasts_length_over_speed():
    bench = {"wavelength_mm": 80, "wave_speed_mm_s": 25, "full_scale": 1024}
    for lowers, readings in ((True, [[600.0, 400.0, 300.0]]), (False, [[300.0, 400.0, 600.0]])):
        bench["pressing_lowers_reading"] = lowers
        pressed, period = units.pressed_and_period(np.array(readings), 10.0, bench)
        assert period == 32.0 and (np.diff(pressed) > 0).all()


def test_only_readings_from_the_converters_range_are_converted():
    converted = {(0.0, 2.0, 75.0, 98.0, 100.0, np.nan): (2 / 98, 2 / 98, 3, 49, 49, np.nan)}
    converted |= {(0.0, 2.1): (2 / 98, 2.1 / 97.9)}
    # Two hundredths of the full scale are too near 0 to be counts.
    outside = ((-0.1, 100.0), (0.0, 100.1), (0.0, 2.0), (0.5, np.nan, 2000.0))
    for lowers, sign in ((True, 1), (False, -1)):
        for readings, expected in converted.items():
            given = units.relative_resistance(np.array([readings]), 100.0, lowers)
            np.testing.assert_allclose(given, [np.power(expected, sign)])
        for readings in outside:
            given = units.relative_resistance(np.array([readings]), 100.0, lowers)
            np.testing.assert_array_equal(given, [np.multiply(sign, readings)])
