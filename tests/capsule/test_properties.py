"""A damaged recording is a finite matrix or has a reason, and costs bounded memory."""

import io
import tracemalloc

import numpy as np
import pytest
from hypothesis import example, given, settings
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
RULES = {"rules": SECTION | {"max_gap_s": 0.4, "max_rail_fraction": 0.5}}
RULES |= {"window": 8, "length": 40}
NAMES, SIXTEEN_MB = "time_s,sensor_1,sensor_2", 16_000_000
GOOD = format_recording(make_recording(3.0, "properties", samples=30, sensors=2))


def check(content):
    """Check that a recording's bytes are a finite matrix, or rejected with a reason."""
    try:
        values = accept(read_recording(io.BytesIO(content), 2, max_bytes=100_000), **RULES)
    except RecordingError as reason:
        assert str(reason) and str(reason).isprintable()
    else:
        assert np.isfinite(preprocess(values, window=8, threshold=1.0, length=40)).all()


edits = st.tuples(st.integers(0, len(GOOD)), st.integers(0, 3), st.binary(max_size=4))


@given(st.lists(edits, max_size=4))
@example([(len(GOOD) - 10, 0, b"e300")])
def test_a_damaged_recording_is_a_finite_matrix_or_has_a_reason(changes):
    content = bytearray(GOOD)
    for place, cut, insert in changes:
        content[place : place + cut] = insert
    check(bytes(content))


numbers = st.sampled_from(
    ["0", "-0", "1", "512", "1023", "1e20", "-1e20", "1e-320", "5e-324", "0.1", "", "nan", "1e999"]
) | st.floats(allow_nan=False).map(repr)
headers = st.dictionaries(
    st.sampled_from(["adc_bits", "vref_v", "rate_hz", "source", "format_version"]),
    st.sampled_from(["10", "0", "1", "5.0", "-1", "1e9", "9" * 5000, "ten", "", "²", "<b>"]),
)


cells = st.lists(st.tuples(numbers, numbers), min_size=20, max_size=45)


@settings(max_examples=50)
@given(headers, cells, st.integers(0, 44), st.sampled_from([0.0, 0.1, 1e-300, 1e17, -5.0]))
def test_wild_numbers_are_a_finite_matrix_or_have_a_reason(header, rows, place, jump):
    lines = [*(f"# {key}: {value}" for key, value in header.items()), NAMES]
    for index, pair in enumerate(rows):
        lines.append(",".join([repr(index * 0.1 + jump * (index >= place)), *pair]))
    check(("\n".join(lines) + "\n").encode())


# With numbers in lists, 20,000 samples would take 4.3 MB.
@pytest.mark.parametrize(
    ("content", "reason", "most_mb"),
    [
        (b"," * SIXTEEN_MB, "line 1 has 16000000 characters", 20),
        (b"# a: b\n" * (SIXTEEN_MB // 7), "has 2285714 lines", 20),
        (f"{NAMES}\n".encode() + b"0,1,2\n" * 20_000, "time repeats", 3.5),
    ],
    ids=["commas", "header", "many samples"],
)
def test_a_large_file_costs_bounded_memory(content, reason, most_mb):
    tracemalloc.start()
    with pytest.raises(RecordingError, match=reason) as caught:
        accept(read_recording(io.BytesIO(content), 2, SIXTEEN_MB), **RULES)
    assert len(str(caught.value)) < 300
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < most_mb * 1e6
