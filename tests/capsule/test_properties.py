"""Laws that hold for any input: from bytes to the matrix, and for the comparison."""

import io
import tracemalloc

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from capsule.errors import RecordingError
from capsule.method.nearest_template import nearest_size, template_distances
from capsule.method.preprocessing import preprocess, rms_envelope
from capsule.recordings.acceptance import accept
from capsule.recordings.recording import Recording, format_recording, read_recording
from support.sliding import smallest_rmse
from support.synthetic import make_recording

pytestmark = pytest.mark.takes(0.5)

SECTION = {
    "rate_hz": 10,
    "rate_tolerance": 0.05,
    "max_gap_s": 0.4,
    "max_missing_fraction": 0.2,
    "max_rail_fraction": 0.5,
    "max_constant_fraction": 0.8,
    "max_sensor_correlation": 0.95,
}
RULES = {"rules": SECTION, "window": 8, "length": 40}
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


@given(st.binary(max_size=400))
def test_bytes_are_a_matrix_or_have_a_reason(content):
    assert matrix_of(content) is None


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


@given(
    arrays(np.float64, (3, 12), elements=st.floats(-1e19, 1e19)),
    st.lists(st.booleans(), min_size=12, max_size=12),
    st.floats(-1e9, 1e9),
)
def test_what_is_written_is_read_again_with_its_gaps(values, missing, start):
    values[:, np.array(missing)] = np.nan
    written = Recording(start + np.arange(12) / 10, values, {"source": "x"})
    read = read_recording(io.BytesIO(format_recording(written)), 3)
    np.testing.assert_array_equal(read.values, written.values)
    np.testing.assert_array_equal(read.time_s, written.time_s)
    assert format_recording(Recording(read.time_s, read.values, {"source": "x"})) == (
        format_recording(written)
    )


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


@given(arrays(np.float64, (2, 30), elements=st.floats(-1e3, 1e3)), st.integers(2, 40))
def test_the_envelope_lies_between_the_smallest_and_the_largest_magnitude(values, window):
    envelope = rms_envelope(values, window)
    slack = 1e-4
    assert np.all(envelope >= np.abs(values).min() - slack)
    assert np.all(envelope <= np.abs(values).max() + slack)


matrices = arrays(np.float64, (2, 20), elements=st.floats(0, 100))


@given(matrices, matrices)
def test_the_distance_is_never_negative_and_never_more_than_without_a_particle(one, other):
    rmse, lag = smallest_rmse(one, other)
    energy = np.sqrt((np.sum(one**2) + np.sum(other**2)) / (3 * one.size))
    assert 0.0 <= rmse <= energy + 1e-9
    assert 1 <= lag <= 40


@given(matrices, matrices)
def test_the_distance_is_the_same_both_ways(one, other):
    forward, _ = smallest_rmse(one, other)
    backward, _ = smallest_rmse(other, one)
    # The lags 1..2L reach one column farther to the left, where nothing overlaps.
    assert forward == pytest.approx(backward, abs=1e-9)


@given(st.lists(matrices, min_size=1, max_size=3), matrices)
def test_a_template_that_is_the_recording_wins(templates, matrix):
    sizes = [float(index) for index in range(len(templates) + 1)]
    distances = template_distances(matrix, [*templates, matrix])
    assert distances[-1] == pytest.approx(0.0, abs=1e-9)
    assert distances[int(nearest_size(distances, sizes))] == distances.min()
