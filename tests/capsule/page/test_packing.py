"""Arrays as text: exact where they can be, to half a step otherwise. JSON that is harmless."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.page.packing import pack, to_json, unpack


@pytest.mark.parametrize(
    "values",
    [
        np.array([[0.0, 512.0, np.nan, 1023.0], [3.0, np.nan, 7.0, 65533.0]]),
        *(np.full((2, 3), fill) for fill in (np.nan, 0.0, 2.5)),
    ],
)
def test_counts_of_an_adc_with_gaps_and_a_signal_that_never_changes_come_through_exactly(values):
    assert np.array_equal(unpack(pack(values)), values, equal_nan=True)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=50), st.sampled_from([8, 16]))
def test_other_values_come_through_to_half_a_step(values, bits):
    array = np.array([values])
    packed = pack(array, bits)
    assert np.allclose(unpack(packed), array, rtol=0, atol=0.5001 * packed["scale"] + 1e-9)
    assert packed["scale"] <= max(1.0, np.ptp(array) / (2**bits - 3))


def test_json_in_a_script_element_cannot_end_it():
    content = {"source": "</script><!-- & \u2028"}
    text = to_json(content)
    assert "<" not in text and "&" not in text and "\u2028" not in text
    assert json.loads(text) == content
    # What is not known must be None.
    with pytest.raises(ValueError, match="JSON compliant"):
        to_json({"predicted_mm": float("nan")})
