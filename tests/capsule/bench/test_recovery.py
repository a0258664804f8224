"""Recovery of the unfinished recording of a killed recorder, which stays unchanged."""

import io

import numpy as np
import pytest

from capsule.bench import growing_file, recovery
from capsule.bench.bench_errors import AcquisitionError, NameExistsError
from capsule.recordings.recording import format_header, format_sample, read_recording

HEADER = {"source": "the tests", "rate_hz": "10"}


@pytest.fixture
def final(tmp_path):
    return tmp_path / "raw" / "3mm" / "r01.csv"


def whole_part(final, count=6):
    part = growing_file.GrowingFile(final, format_header(HEADER, 4))
    for index in range(count):
        part.add(format_sample(index / 10, None if index % 5 == 3 else (index, 2, 3, 4)))
    part.flush()
    part.close()
    return part.path.read_bytes()


def recovered(final, content):
    """Recover an unfinished file; return samples, dropped bytes and the recording's content."""
    part = final.with_name(final.name + ".part")
    part.parent.mkdir(parents=True, exist_ok=True)
    part.write_bytes(content)
    rescued = recovery.recover(part, 4)
    assert (rescued.final, part.exists()) == (final, False)
    assert rescued.original.read_bytes() == content
    return rescued.samples, rescued.dropped, final.read_bytes()


@pytest.mark.parametrize(
    "tail", [b"", b"0.6,1,2", b"\x00" * 500, b"0.6,1,2,3,4,5\n", b"0.6,1,,3,4\n"]
)
def test_what_a_killed_recorder_left_is_recovered(final, tail):
    content = whole_part(final)
    samples, dropped, after = recovered(final, content + tail)
    assert (samples, dropped, after) == (6, len(tail), content)
    assert read_recording(io.BytesIO(after), 4).time_s.size == 6


# Kills: a reader of ADC counts alone.
def test_a_recording_in_volts_is_recovered(final):
    part = growing_file.GrowingFile(final, format_header(HEADER | {"unit": "V"}, 4))
    readings = np.random.default_rng(1).normal(2.5, 1.0, (525, 4))
    readings[7] = [1e-7, -0.25, 3.0, 12345.678901234567]
    for index, values in enumerate(readings):
        part.add(format_sample(index / 10, tuple(values)))
    part.flush()
    part.close()
    content = part.path.read_bytes()
    assert recovered(final, content) == (525, 0, content)
    with final.open("rb") as stream:
        np.testing.assert_array_equal(read_recording(stream, 4).values.T, readings)


def test_every_place_where_a_part_can_be_cut(final):
    content = whole_part(final)
    first_sample = content.index(b"0,0,2,3,4\n")
    for length in range(first_sample + len(b"0,0,2,3,4\n"), len(content) + 1):
        samples, dropped, after = recovered(final, content[:length])
        assert samples == content[first_sample:length].count(b"\n")
        assert after == content[: length - dropped]
        final.unlink()
        final.with_name("r01.csv.part.recovered").unlink()


@pytest.mark.parametrize("content", [b"", b"# a: b\n", b"holiday pictures", b"\x00" * 100])
def test_a_part_without_samples_is_left_alone(final, content):
    part = final.with_name(final.name + ".part")
    part.parent.mkdir(parents=True)
    part.write_bytes(content)
    with pytest.raises(AcquisitionError, match="holds no sample"):
        recovery.recover(part, 4)
    assert part.read_bytes() == content


def test_recovery_overwrites_nothing(final):
    whole_part(final)
    final.write_text("precious")
    with pytest.raises(NameExistsError):
        recovery.recover(final.with_name("r01.csv.part"), 4)
    assert final.read_text() == "precious"
    with pytest.raises(AcquisitionError, match="not an unfinished recording"):
        recovery.recover(final, 4)


def test_a_running_recording_is_not_recovered(final):
    part = growing_file.GrowingFile(final, format_header(HEADER, 4))
    part.add(format_sample(0.0, (1, 2, 3, 4)))
    part.flush()
    with pytest.raises(AcquisitionError, match=r"a recorder is writing .* at this moment"):
        recovery.recover(part.path, 4)
    part.close()
    recovery.recover(part.path, 4)


def line_of(content, number):
    """Return the start and the end of the line of a sample, in bytes."""
    first = content.index(b"0,0,2,3,4\n")
    lines = content[first:].split(b"\n")
    start = first + sum(len(line) + 1 for line in lines[:number])
    return start, start + len(lines[number])


@pytest.mark.parametrize(
    "bad",
    [
        b"25.0,2\xff0,2,3,4",
        b"25.0,2",
        b"",
        b"\x00" * 700,
        b"95.0,250,2,3,4",
        b"\r25.0,1,2,3,4,5",
        b"25.0,1,,3,4",
    ],
    ids=["bad byte", "short", "empty", "zeros", "time far ahead", "one cell more", "empty cell"],
)
def test_one_bad_line_costs_one_sample(final, bad):
    content = whole_part(final, count=500)
    start, end = line_of(content, 250)
    final.with_name("r01.csv.part").unlink()
    samples, dropped, after = recovered(final, content[:start] + bad + content[end:])
    assert (samples, dropped) == (499, 0)
    recording = read_recording(io.BytesIO(after), 4)
    kept = np.delete(np.arange(500), 250)
    np.testing.assert_allclose(recording.time_s, kept / 10)
    np.testing.assert_array_equal(recording.values[0], np.where(kept % 5 == 3, np.nan, kept))
    assert recording.header["recovered"] == "lines skipped because they could not be read: 1"


@pytest.mark.parametrize("place", range(0, 80, 3))
def test_a_bad_byte_in_the_header_costs_an_entry_at_most(final, place):
    content = bytearray(whole_part(final))
    final.with_name("r01.csv.part").unlink()
    content[place] = 0xFF
    samples, dropped, after = recovered(final, bytes(content))
    assert (samples, dropped) == (6, 0)
    recording = read_recording(io.BytesIO(after), 4)
    assert recording.header["recovered"].endswith(": 1")
    # A line end joins two entries.
    lost = 2 if whole_part(final.with_name("r02.csv"))[place : place + 1] == b"\n" else 1
    assert len(set(HEADER) - recording.header.keys()) <= lost


def test_line_ends_of_an_editor_are_survived(final):
    content = whole_part(final)
    final.with_name("r01.csv.part").unlink()
    samples, dropped, after = recovered(final, content.replace(b"\n", b"\r\n"))
    assert (samples, dropped, after) == (6, 0, content)


def test_an_original_that_was_kept_before_is_not_overwritten(final):
    content = whole_part(final)
    earlier = final.with_name("r01.csv.part.recovered")
    earlier.write_text("precious")
    with pytest.raises(NameExistsError, match=r"part\.recovered exists; rename it"):
        recovery.recover(final.with_name("r01.csv.part"), 4)
    assert earlier.read_text() == "precious"
    assert final.with_name("r01.csv.part").read_bytes() == content
    assert not final.exists()


def test_what_was_skipped_is_said(final):
    content = whole_part(final, count=50)
    start, end = line_of(content, 20)
    part = final.with_name("r01.csv.part")
    part.write_bytes(content[:start] + b"?" + content[end:] + b"5.0,1")
    summary = recovery.recover(part, 4).summary()
    assert "r01.csv: 49 samples" in summary
    assert "could not be read: 1; 5 bytes at its end left out: not a whole line" in summary
    assert summary.endswith("the original is kept as r01.csv.part.recovered")
    assert growing_file.unfinished(final.parent.parent) == []
