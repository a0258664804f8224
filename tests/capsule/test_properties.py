"""A damaged recording is a finite matrix or has a reason, and costs bounded memory."""

import io
import tracemalloc

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from capsule.engine.configuration import read_config_file
from capsule.errors import RecordingError
from capsule.method.preprocessing import preprocess
from capsule.recordings.acceptance import accept
from capsule.recordings.recording import format_recording, read_recording
from support.project import ROOT
from support.synthetic import make_recording

pytestmark = pytest.mark.takes(0.5)

SECTION = read_config_file(ROOT / "config/config.yaml")["recording"]
RULES = {
    "rules": SECTION | {"max_gap_s": 0.4, "max_rail_fraction": 0.5},
    "window": 8,
    "length": 40,
}
GOOD = format_recording(make_recording(3.0, "properties", samples=30, sensors=2))


def matrix_of(content):
    """Return the matrix of a recording's bytes as in the workflow; None if it is rejected."""
    try:
        recording = read_recording(io.BytesIO(content), 2, max_bytes=100_000)
        values = accept(recording, **RULES)
    except RecordingError as reason:
        assert str(reason)
        assert str(reason).isprintable()
        return None
    return preprocess(values, window=8, threshold=1.0, length=40)


edits = st.lists(
    st.tuples(st.integers(0, len(GOOD)), st.integers(0, 3), st.binary(max_size=4)), max_size=4
)


@given(edits)
@example([(len(GOOD) - 10, 0, b"e300")])
def test_a_damaged_recording_is_a_finite_matrix_or_has_a_reason(changes):
    content = bytearray(GOOD)
    for place, cut, insert in changes:
        content[place : place + cut] = insert
    matrix = matrix_of(bytes(content))
    assert matrix is None or np.all(np.isfinite(matrix))


numbers = st.sampled_from(
    ["0", "-0", "1", "512", "1023", "1e20", "-1e20", "1e-320", "5e-324", "0.1", "", "nan", "1e999"]
) | st.floats(allow_nan=False).map(repr)
headers = st.dictionaries(
    st.sampled_from(["adc_bits", "vref_v", "rate_hz", "source", "format_version"]),
    st.sampled_from(["10", "0", "1", "5.0", "-1", "1e9", "9" * 5000, "ten", "", "²", "<b>"]),
)


@given(
    headers,
    st.lists(st.tuples(numbers, numbers), min_size=20, max_size=45),
    st.integers(0, 44),
    st.sampled_from([0.0, 0.1, 1e-300, 1e17, -5.0]),
)
def test_wild_numbers_are_a_finite_matrix_or_have_a_reason(header, cells, place, jump):
    lines = [f"# {key}: {value}" for key, value in header.items()]
    lines.append("time_s,sensor_1,sensor_2")
    for index, pair in enumerate(cells):
        lines.append(",".join([repr(index * 0.1 + jump * (index >= place)), *pair]))
    matrix = matrix_of(("\n".join(lines) + "\n").encode())
    assert matrix is None or np.all(np.isfinite(matrix))


SIXTEEN_MB = 16_000_000


@pytest.mark.slow
@pytest.mark.parametrize(
    "content",
    [
        b"," * SIXTEEN_MB,
        b"# a: b\n" * (SIXTEEN_MB // 7),
        b"time_s,sensor_1,sensor_2\n" + b"0,1,2\n" * (SIXTEEN_MB // 7),
        b"time_s,sensor_1,sensor_2\n" + b"0,1,2\n" * 199_000,
    ],
    ids=["commas", "header", "samples", "many samples"],
)
def test_a_file_of_the_largest_size_costs_bounded_memory(content):
    tracemalloc.start()
    try:
        recording = read_recording(io.BytesIO(content), 2, SIXTEEN_MB)
        with pytest.raises(RecordingError, match="time repeats"):
            accept(recording, **RULES)
    except RecordingError as reason:
        assert len(str(reason)) < 300
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 150_000_000
