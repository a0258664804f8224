"""A damaged text file is read, or refused with an error of one line."""

import io

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import checked_keys
from capsule.importing.runs import read_columns, runs_of
from capsule.importing.text import read_text
from capsule.recordings.recording import format_recording, read_recording
from support.importing import ODD, SETTINGS

FILES = [path.read_bytes() for path in sorted(ODD.iterdir())]
SAID = [{}, {"unit": "V"}, {"rate": 10.0, "time": "none"}, {"run_gap_s": 0.5}, {"time": 1}]
PIECES = [b"nan", b"inf", b"1e400", b"-", b'"', b"\n\n", b"\x00", b"\xff", b",,", b"00:00:00"]
damage = st.tuples(
    st.integers(0, 400), st.integers(0, 20), st.sampled_from(PIECES) | st.binary(max_size=4)
)


ROW = b"0,%d;2.004,0;2.444,0;1.688,0;%s"


def table(certain: bytes) -> bytes:
    """Return a table whose last column holds a number that needs no question, and a whole one."""
    rows = [ROW % (number, b"20" if number == 3 else certain) for number in range(9)]
    return b"\n".join([b"time;S1;S2;S3;S4", *rows])


@settings(max_examples=300, deadline=None)
@example(table(b"2.120,0"), [], {})
@example(table(b"1.002.120"), [], {})
@given(st.sampled_from(FILES), st.lists(damage, max_size=5), st.sampled_from(SAID))
def test_a_damaged_file_is_read_or_refused_in_a_line(content, damages, said):
    for at, length, piece in damages:
        content = content[:at] + piece + content[at + length :]
    keys = checked_keys(said, SETTINGS)
    try:
        runs = list(runs_of(read_columns(read_text(content, keys), keys), {}, keys))
    except CapsuleError as refusal:
        assert "\n" not in str(refusal)
        return
    for _, recording, _ in runs:
        back = read_recording(io.BytesIO(format_recording(recording)), 4)
        np.testing.assert_array_equal(back.values, recording.values)
