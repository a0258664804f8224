"""Recovery of the unfinished recording of a killed recorder, which stays unchanged."""

import io
import re

import numpy as np
import pytest

from capsule.bench import growing_file, recovery
from capsule.bench.bench_errors import AcquisitionError, NameExistsError
from capsule.recordings.recording import format_header, format_sample, read_recording

HEADER = {"source": "the tests", "rate_hz": "10"}
HEAD = format_header(HEADER, 4).encode()
LINES = [
    format_sample(index / 10, None if index % 5 == 3 else (index, 2, 3, 4)).encode()
    for index in range(500)
]
WHOLE = HEAD + b"".join(LINES)
READINGS = np.random.default_rng(1).normal(2.5, 1.0, (525, 4))
READINGS[7] = [1e-7, -0.25, 3.0, 12345.678901234567]
VOLTS = format_header(HEADER | {"unit": "V"}, 4).encode() + b"".join(
    format_sample(index / 10, tuple(values)).encode() for index, values in enumerate(READINGS)
)


@pytest.fixture
def final(tmp_path):
    (tmp_path / "raw" / "3mm").mkdir(parents=True)
    return tmp_path / "raw" / "3mm" / "r01.csv"


def left(final, content):
    """Write the unfinished file of a killed recorder; return its path."""
    part = final.with_name("r01.csv.part")
    part.write_bytes(content)
    return part


def recovered(final, content):
    """Recover an unfinished file; return samples, dropped bytes and the recording's content."""
    part = left(final, content)
    said = recovery.recover(part, 4)
    samples = re.match(rf"recovered {re.escape(str(final))}: (\d+) samples", said)[1]
    dropped = re.search(r"(\d+) bytes at its end left out: not a whole line", said)
    assert said.endswith("; the original is kept as r01.csv.part.recovered")
    original = part.with_name("r01.csv.part.recovered")
    assert original.read_bytes() == content
    original.unlink()
    assert list(final.parent.iterdir()) == [final]
    return int(samples), int(dropped[1]) if dropped else 0, final.read_bytes()


# Kills: a reader of ADC counts alone.
@pytest.mark.parametrize(
    ("content", "tail", "samples"),
    [
        *((WHOLE, tail, 500) for tail in (b"", b"50.0,1,2", b"\x00" * 500, b"50.0,1,,3,4\n")),
        (VOLTS, b"", 525),
    ],
)
def test_every_whole_line_is_recovered(final, content, tail, samples):
    assert recovered(final, content + tail) == (samples, len(tail), content)
    # Line ends of an editor are survived.
    edited = content.replace(b"\n", b"\r\n")
    final.unlink()
    assert recovered(final, edited) == (samples, 0, content)


@pytest.mark.parametrize("length", range(len(HEAD + LINES[0]), len(HEAD) + 80, 3))
def test_every_whole_line_before_a_cut_is_recovered(final, length):
    samples, dropped, after = recovered(final, WHOLE[:length])
    assert samples == WHOLE[len(HEAD) : length].count(b"\n")
    assert after == WHOLE[: length - dropped]


@pytest.mark.parametrize(
    "bad",
    [b"25.0,2\xff0,2,3,4", b"25.0,2", b"", b"\x00" * 70, b"95.0,250,2,3,4", b"25.0,1,,3,4",
     b"\r25.0,1,2,3,4,5", b"24.9,249,2,3,4"],
)  # fmt: skip
def test_one_bad_line_costs_one_sample(final, bad):
    content = HEAD + b"".join([*LINES[:250], bad + b"\n", *LINES[251:]])
    samples, dropped, after = recovered(final, content)
    assert (samples, dropped) == (499, 0)
    recording = read_recording(io.BytesIO(after), 4)
    kept = np.delete(np.arange(500), 250)
    np.testing.assert_allclose(recording.time_s, kept / 10)
    np.testing.assert_array_equal(recording.values[0], np.where(kept % 5 == 3, np.nan, kept))
    assert recording.header["recovered"] == "lines skipped because they could not be read: 1"


@pytest.mark.parametrize("place", range(0, 80, 3))
def test_a_bad_byte_in_the_header_costs_an_entry_at_most(final, place):
    samples, dropped, after = recovered(final, WHOLE[:place] + b"\xff" + WHOLE[place + 1 :])
    assert (samples, dropped) == (500, 0)
    header = read_recording(io.BytesIO(after), 4).header
    assert header["recovered"].endswith(": 1")
    # A line end joins two entries.
    assert len(set(HEADER) - header.keys()) <= (2 if WHOLE[place : place + 1] == b"\n" else 1)


@pytest.mark.parametrize(
    ("content", "taken", "error", "said"),
    [
        *((no, None, AcquisitionError, "holds no sample") for no in (b"", b"# a: b\n", b"\x00")),
        (WHOLE, "r01.csv", NameExistsError, "exists; rename it"),
        (WHOLE, "r01.csv.part.recovered", NameExistsError, r"part\.recovered exists; rename it"),
    ],
)
def test_what_cannot_be_recovered_is_left_alone_and_overwrites_nothing(
    final, content, taken, error, said
):
    part = left(final, content)
    if taken:
        final.with_name(taken).write_bytes(b"precious")
    with pytest.raises(error, match=said):
        recovery.recover(part, 4)
    files = {path.name: path.read_bytes() for path in final.parent.iterdir()}
    assert files == {part.name: content} | ({taken: b"precious"} if taken else {})


def test_a_running_recording_is_not_recovered(final):
    part = growing_file.GrowingFile(final, HEAD.decode())
    part.add(format_sample(0.0, (1, 2, 3, 4)))
    part.flush()
    with pytest.raises(AcquisitionError, match=r"another program is writing .*stop"):
        recovery.recover(part.path, 4)
    part.close()
    recovery.recover(part.path, 4)
    with pytest.raises(AcquisitionError, match="not an unfinished recording"):
        recovery.recover(final, 4)
