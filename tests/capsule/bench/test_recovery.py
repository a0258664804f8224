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
ORIGINAL = "r01.csv.part.recovered"


@pytest.fixture
def part(tmp_path):
    """Return the path of the unfinished file of a killed recorder."""
    return tmp_path / "r01.csv.part"


def recovered(part, content):
    """Recover an unfinished file; return samples, dropped bytes and the recording's content."""
    part.write_bytes(content)
    said, final = recovery.recover(part, 4), part.with_suffix("")
    samples = re.match(rf"recovered {re.escape(str(final))}: (\d+) samples", said)[1]
    dropped = re.search(r"(\d+) bytes at its end left out: not a whole line", said)
    assert said.endswith(f"; the original is kept as {ORIGINAL}")
    files = {path.name: path.read_bytes() for path in part.parent.iterdir()}
    assert files.keys() == {ORIGINAL, final.name} and files[ORIGINAL] == content
    return int(samples), int(dropped[1]) if dropped else 0, files[final.name]


# Kills: a reader of ADC counts alone, one that an editor's line ends stop, a tail that costs more.
@pytest.mark.parametrize(
    ("whole", "cut", "tail"),
    [
        *((WHOLE, len(WHOLE), tail) for tail in (b"50.0,1,2", b"\x00" * 500, b"50.0,1,,3,4\n")),
        *((WHOLE, at, b"") for at in range(len(HEAD + LINES[0]), len(HEAD) + 80, 3)),
        (WHOLE.replace(b"\n", b"\r\n"), None, b""),
        (VOLTS, None, b""),
    ],
)
def test_every_whole_line_is_recovered(part, whole, cut, tail):
    kept = whole[:cut][: whole[:cut].rfind(b"\n") + 1]
    samples, dropped, after = recovered(part, whole[:cut] + tail)
    assert samples == sum(line[:1].isdigit() for line in kept.splitlines())
    assert dropped == len(whole[:cut]) - len(kept) + len(tail)
    assert after == kept.replace(b"\r", b"")


@pytest.mark.parametrize(
    "bad",
    [b"25.0,2\xff0,2,3,4", b"25.0,2", b"", b"\x00" * 70, b"95.0,250,2,3,4", b"25.0,1,,3,4",
     b"\r25.0,1,2,3,4,5", b"24.9,249,2,3,4"],
)  # fmt: skip
def test_one_bad_line_costs_one_sample(part, bad):
    content = HEAD + b"".join([*LINES[:250], bad + b"\n", *LINES[251:]])
    samples, dropped, after = recovered(part, content)
    assert (samples, dropped) == (499, 0)
    recording = read_recording(io.BytesIO(after), 4)
    kept = np.delete(np.arange(500), 250)
    np.testing.assert_allclose(recording.time_s, kept / 10)
    np.testing.assert_array_equal(recording.values[0], np.where(kept % 5 == 3, np.nan, kept))
    assert recording.header["recovered"] == "lines skipped because they could not be read: 1"


@pytest.mark.parametrize("place", range(0, 80, 3))
def test_a_bad_byte_in_the_header_costs_an_entry_at_most(part, place):
    samples, dropped, after = recovered(part, WHOLE[:place] + b"\xff" + WHOLE[place + 1 :])
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
        (WHOLE, ORIGINAL, NameExistsError, r"part\.recovered exists; rename it"),
    ],
)
def test_what_cannot_be_recovered_is_left_alone_and_overwrites_nothing(
    part, content, taken, error, said
):
    files = {part.name: content} | ({taken: b"precious"} if taken else {})
    for name, each in files.items():
        part.with_name(name).write_bytes(each)
    with pytest.raises(error, match=said):
        recovery.recover(part, 4)
    assert {path.name: path.read_bytes() for path in part.parent.iterdir()} == files


def test_a_running_recording_is_not_recovered(part):
    file = growing_file.GrowingFile(part.with_suffix(""), WHOLE.decode())
    with pytest.raises(AcquisitionError, match=r"another program is writing .*stop"):
        recovery.recover(part, 4)
    file.close()
    recovery.recover(part, 4)
    with pytest.raises(AcquisitionError, match="not an unfinished recording"):
        recovery.recover(part.with_suffix(""), 4)
