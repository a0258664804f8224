import io
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from capsule.errors import RecordingError
from capsule.recordings import recording as form

BARE = b"time_s,sensor_1,sensor_2\n0,512,500\n0.1,513,501\n"


def read(content, sensors=2, **limits):
    return form.read_recording(io.BytesIO(content), sensors, **limits)


def test_a_bare_csv_with_the_column_names_is_a_recording_and_header_lines_are_read():
    # A missing sample keeps its place.
    recording = read(BARE + b"0.2,,\n")
    np.testing.assert_array_equal(recording.time_s, [0.0, 0.1, 0.2])
    np.testing.assert_array_equal(recording.values, [[512, 513, np.nan], [500, 501, np.nan]])
    assert recording.header == {}
    told = b"# source: bench 2\n# unit of the end stop: V\n# note: units: V\n\n"
    recording = read(told + BARE.replace(b"512", b"2.503e0"))
    # A key that only begins like one that decides is a note.
    notes = {"source": "bench 2", "unit of the end stop": "V", "note": "units: V"}
    assert (recording.header, recording.values[0, 0]) == (notes, 2.503)


HARMLESS = {
    "byte order mark": b"\xef\xbb\xbf" + BARE,
    "CRLF": BARE.replace(b"\n", b"\r\n"),
    "CR": BARE.replace(b"\n", b"\r"),
    "a form feed": BARE.replace(b"\n0,", b"\n\x0c0,"),
    "odd line ends in a header": "# source: a\u2028b\x0cc\x85d\n".encode() + BARE,
    "no last line feed": BARE.rstrip(b"\n"),
    "spaces": BARE.replace(b",", b" , "),
    "other order and columns": b"sensor_2,note,time_s,sensor_1\n500,x,0,512\n501,,0.1,513\n",
}


@pytest.mark.parametrize("content", HARMLESS.values(), ids=HARMLESS)
def test_harmless_variants_read_the_same(content):
    np.testing.assert_array_equal(read(content).values, read(BARE).values)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "the file is empty"),
        (b"# source: x\n", "the file ends after its header; column names and samples are missing"),
        (b"time_s,sensor_1,sensor_2\n", "the file ends after its column names"),
        (b"time_s,sensor_1\n0,1\n", "the column 'sensor_2' is missing"),
        (b"time_s,sensor_1,sensor_2,sensor_2\n0,1,2,3\n", "'sensor_2' appears more than once"),
        (b"time_s,sensor_1,sensor_2,sensor_3\n0,1,2,3\n", "recording.sensors is 2"),
        (BARE + b"0.2,nan,1\n", "line 4: 'nan' is not a number"),
        (BARE + b"0.2,1_0,1\n", "line 4: '1_0' is not a number"),
        (BARE + b"0.2,1,\n", "line 4: a cell is empty"),
        (BARE + b"0.2,5\n", "line 4 has 2 cells, but there are 3 columns"),
        (BARE.replace(b",", b";"), "semicolons"),
        (BARE.decode().encode("utf-16-be"), "UTF-16, or binary"),
        ("\u6e2c\u91cf".encode("utf-16"), "UTF-16, or binary"),
        (b"# source: caf\xe9\n" + BARE, "byte 14 is not UTF-8"),
        (BARE + "0.2,٣,1\n".encode(), "line 4: '٣' is not a number"),
        (BARE + b"0.2,-1.0001e20,1\n", "line 4: '-1.0001e20' is too large"),
        (BARE + b"\n" * (200_000 - 2), "has 200001 lines; .* at most 200000"),
        (b"# format_version: 2\n" + BARE, "format_version '2'; this program reads version 1 only"),
        (b"#\n" * 1001 + BARE, "the first 1000 lines hold no column names"),
        (b"# session: a\n# session: b\n" + BARE, "line 2: .* session 'a' above, and 'b' here"),
        (b"#\n# Unit: V\n" + BARE, "line 2: the header says 'Unit'; write 'unit'"),
        (b"# kPa\n# wave 2\n" + BARE, "line 1: '# kPa' can be the unit of the readings"),
        (b"# Set-ups: a\n" + BARE, "says 'Set-ups'; write 'setup'"),
        (b"x" * 10_001, "line 1 has 10001 characters; .* at most 10000"),
        ((b"# note: " + b"x" * 4992 + b"\n") * 2 + b"#\n" + BARE, "line 3: the header lines hold"),
        (b"# format_version: 1\n" + BARE + b"0.2,514,50", "line 5 is cut off"),
        # Three digits are lost, and an earlier reading is as short.
        (BARE + b"0.2,514,9\n0.3,514,1018\n0.4,514,1", "line 6 is cut off"),
        # The reading before is the first.
        (b"time_s,sensor_1,sensor_2\n0,1,1018\n0.1,1,10", "line 3 is cut off"),
        (BARE + b"0.2,514,9\n0.3,514,1018\n0.4,514,10", "line 6 is cut off"),
        # Shorter than all others, if by decimals.
        (b"time_s,sensor_1,sensor_2\n0,1,9.25\n0.1,1,9.5", "line 3 is cut off"),
        (BARE + b"0.2,514,x", "line 4: 'x' is not a number"),
    ],
)
def test_what_cannot_be_read_says_why(content, reason):
    with pytest.raises(RecordingError, match=reason):
        read(content)


def test_a_large_file_is_refused_without_reading_it_all():
    endless = Mock(read=Mock(side_effect=bytes))
    with pytest.raises(RecordingError, match=r"larger than 0\.001 MB"):
        form.read_recording(endless, 4, max_bytes=1000)
    endless.read.assert_called_once_with(1001)


WORDS = st.text(st.characters(categories=["L", "N", "P"]))


@given(arrays(np.float64, (3, 5), elements=st.floats(-1e6, 1e6)), WORDS)
def test_what_is_written_is_read_again(values, note):
    values[:, 2], time_s = np.nan, np.arange(5) / 10
    written = form.format_recording(form.Recording(time_s, values, {"note": note}))
    recording = read(written, sensors=3)
    np.testing.assert_array_equal(recording.values, values)
    np.testing.assert_array_equal(recording.time_s, time_s)
    assert recording.header == {"format_version": "1", "note": note}


def test_a_header_says_what_made_a_recording_and_its_rate_before_an_import():
    for header, source, rate in (
        ({}, "", ""),
        ({"source": "bench 2", "rate_hz": "10.0"}, "bench 2", "10"),
        ({"source": "x", "simulator_seed": "1", "rate_hz": "ten"}, "x, seed 1", "ten"),
        ({"simulator_bench": "3", "simulator_version": "2"}, "version 2, bench 3", ""),
        ({"import_resampled": "from 99.87 Hz to 10 Hz, spline"}, "", "100"),
        ({"rate_hz": "10", "import_resampled": "from 36.4 Hz to 10 Hz, spline"}, "", "36"),
        ({"rate_hz": "10", "import_resampled": "from 100, 50 Hz to 10 Hz"}, "", "10"),
    ):
        assert (form.source_of(header), form.rate_of(header)) == (source, rate)


def test_numbers_are_written_so_that_they_read_as_the_same_and_counts_as_whole_numbers():
    numbers = [1e15, 1e15 - 1, -3.0, 0.1, 123456789.5, 1e-7]
    written = "12.3,1000000000000000.0,999999999999999,-3,0.1,123456789.5,1e-07\n"
    assert form.format_sample(12.3, numbers) == written
    assert list(map(float, written.split(",")[1:])) == numbers
    assert form.format_sample(12.4, None, sensors=2) == "12.4,,\n"
    one_line = form.Recording(np.arange(1), np.ones((2, 1)), {"source": "a\nb"})
    lines = form.format_recording(one_line).splitlines()
    assert lines[1:] == [b"# source: a b", b"time_s,sensor_1,sensor_2", b"0,1,1"]


def test_a_line_a_file_a_header_and_a_number_may_be_exactly_as_large_as_allowed():
    # 10 000 characters in a line, and so in the header lines.
    assert len(read(b"# note: " + b"x" * 9992 + b"\n" + BARE).header["note"]) == 9992
    assert read(b"#\n" * 1000 + BARE).values.shape == (2, 2)
    assert read(BARE, max_bytes=len(BARE)).values.shape == (2, 2)
    assert read(BARE + b"\n" * (200_000 - 3)).values.shape == (2, 2)
    assert read(BARE + b"1,-1e20,1e20\n").values[1, 2] == 1e20
    # With a digit more, the last number would be nearer by exactly four times.
    assert read(b"time_s,sensor_1,sensor_2\n0,1,82\n0.1,1,10").values.shape == (2, 2)
