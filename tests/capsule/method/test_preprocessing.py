import numpy as np
import pytest

from capsule.method import preprocessing as method
from capsule.method.preprocessing import normalize, preprocess
from support import literal
from support.synthetic import make_recording


@pytest.mark.parametrize(("sensors", "samples", "window"), [(4, 300, 84), (1, 40, 7), (2, 9, 30)])
def test_preprocessing_equals_the_literal_formulas(sensors, samples, window):
    values = make_recording(3.0, "3mm/r01", samples=samples, sensors=sensors).values
    expected = literal.preprocess(values, window, threshold=0.9, length=samples + 13)
    actual = preprocess(values, window=window, threshold=0.9, length=samples + 13)
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-12)
    # Kills: a time axis of the sensors, or by the rate instead of the interval.
    run = method.preprocess_run("3mm/r01", "", values, rate_hz=8, window=window, threshold=0.9)
    np.testing.assert_array_equal(run.time_s, [0.125 * sample for sample in range(samples)])
    np.testing.assert_allclose(run.matrix, expected[:, :samples], rtol=0, atol=1e-12)


def test_a_constant_sensor_is_not_divided_by_zero_and_no_sample_is_cut_off():
    with pytest.raises(ValueError, match="constant"):
        normalize(np.array([[1.0, 2.0], [0.1, 0.1]]))
    np.testing.assert_array_equal(method.extend(np.ones((1, 4)), 4), np.ones((1, 4)))
    with pytest.raises(ValueError, match="4 samples do not fit into 3"):
        method.extend(np.ones((1, 4)), 3)


def test_missing_samples_take_no_part_and_a_window_without_any_has_no_envelope():
    readings = np.array([[1.0, 5.0, np.nan, 2.0, 9.0, 4.0]])
    known = ~np.isnan(readings)
    normalized = normalize(readings)
    np.testing.assert_allclose(normalized[known], normalize(readings[known][np.newaxis])[0])
    # Around the gap at index 2 only its two neighbours remain.
    expected = np.sqrt((normalized[0, 1] ** 2 + normalized[0, 3] ** 2) / 2)
    assert method.rms_envelope(normalized, window=2)[0, 2] == pytest.approx(expected)
    normalized[:, 1:4] = np.nan
    assert np.isnan(method.rms_envelope(normalized, window=2)[0, 2])
