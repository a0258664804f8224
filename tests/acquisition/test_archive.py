"""Recordings on disk: nothing lost, nothing half written under its final name."""

import errno
import io
import os

import pytest

from acquisition import archive
from acquisition.bench_errors import AcquisitionError, DiskFullError, NameExistsError
from capsule.recording import read_recording

HEADER = {"source": "the tests", "rate_hz": "10"}


@pytest.fixture
def final(tmp_path):
    return tmp_path / "raw" / "3mm" / "r01.csv"


def fill(part, count):
    for index in range(count):
        missing = index % 5 == 3
        part.add(index / 10, None if missing else (index, 2, 3, 4))


def test_a_recording_appears_whole(final):
    part = archive.PartFile(final, HEADER, 4)
    fill(part, 10)
    part.flush()
    assert not final.exists()
    assert part.finish() == final
    with final.open("rb") as stream:
        recording = read_recording(stream, 4)
    assert recording.time_s.size == 10
    assert recording.header["source"] == "the tests"
    assert list(final.parent.iterdir()) == [final]


def test_samples_are_in_the_file_once_flushed(final):
    part = archive.PartFile(final, HEADER, 4)
    fill(part, 7)
    part.flush()
    assert part.path.read_text().endswith("0.6,6,2,3,4\n")
    part.close()


def test_synced_every_second_and_not_more_often(final, monkeypatch):
    synced = []
    now_s = [100.0]
    monkeypatch.setattr(archive.os, "fsync", synced.append)
    monkeypatch.setattr(archive.time, "monotonic", lambda: now_s[0])
    part = archive.PartFile(final, HEADER, 4)
    synced.clear()
    for _ in range(50):
        now_s[0] += 0.1
        part.sync()
    assert len(synced) in (4, 5)
    part.close()


def test_a_name_is_never_taken_twice(final):
    part = archive.PartFile(final, HEADER, 4)
    with pytest.raises(NameExistsError, match="unfinished"):
        archive.PartFile(final, HEADER, 4)
    fill(part, 3)
    # Somebody copies a recording of that name in while this one runs.
    final.write_text("precious")
    with pytest.raises(NameExistsError, match="samples are kept in r01"):
        part.finish()
    assert final.read_text() == "precious"
    assert part.path.exists()
    with pytest.raises(NameExistsError, match="never overwritten"):
        archive.check_free(final)


def test_file_systems_without_links_serve_too(final, monkeypatch):
    def refuse(*names):
        raise OSError(errno.EPERM, "no links here")

    monkeypatch.setattr(archive.os, "link", refuse)
    part = archive.PartFile(final, HEADER, 4)
    fill(part, 3)
    assert part.finish().exists()
    assert not part.path.exists()
    second = archive.PartFile(final.with_name("r02.csv"), HEADER, 4)
    fill(second, 3)
    second.final.write_text("precious")
    with pytest.raises(NameExistsError):
        second.finish()
    assert second.final.read_text() == "precious"


@pytest.mark.parametrize("room", range(0, 48, 5))
def test_a_full_disk_leaves_whole_lines(final, monkeypatch, room):
    part = archive.PartFile(final, HEADER, 4)
    fill(part, 5)
    part.flush()
    before = part.path.read_bytes()
    really_write = os.write
    left = [room]

    def write(descriptor, content):
        if not left[0]:
            raise OSError(errno.ENOSPC, "No space left on device")
        written = really_write(descriptor, content[: left[0]])
        left[0] -= written
        return written

    monkeypatch.setattr(archive.os, "write", write)
    fill(part, 5)
    with pytest.raises(DiskFullError, match="disk is full"):
        part.flush()
    part.close()
    after = part.path.read_bytes()
    assert after.startswith(before)
    assert after.endswith(b"\n")
    assert len(before) + room - len(after) < len("0.0,0,2,3,4\n")


def recovered(final, content):
    """Recover a part of that content; gives samples, dropped bytes and what is in the file."""
    part = final.with_name(final.name + ".part")
    part.parent.mkdir(parents=True, exist_ok=True)
    part.write_bytes(content)
    found, samples, dropped = archive.recover(part, 4)
    assert (found, part.exists()) == (final, False)
    return samples, dropped, final.read_bytes()


def whole_part(final):
    part = archive.PartFile(final, HEADER, 4)
    fill(part, 6)
    part.flush()
    part.close()
    return part.path.read_bytes()


@pytest.mark.parametrize(
    "tail", [b"", b"0.6,1,2", b"\x00" * 500, b"0.6,1,2,3,4,5\n", b"0.6,1,,3,4\n"]
)
def test_what_a_killed_recorder_left_is_recovered(final, tail):
    content = whole_part(final)
    samples, dropped, after = recovered(final, content + tail)
    assert (samples, dropped, after) == (6, len(tail), content)
    assert read_recording(io.BytesIO(after), 4).time_s.size == 6


def test_every_place_where_a_part_can_be_cut(final):
    content = whole_part(final)
    first_sample = content.index(b"0,0,2,3,4\n")
    for length in range(first_sample + len(b"0,0,2,3,4\n"), len(content) + 1):
        samples, dropped, after = recovered(final, content[:length])
        assert samples == content[first_sample:length].count(b"\n")
        assert after == content[: length - dropped]
        final.unlink()


@pytest.mark.parametrize("content", [b"", b"# a: b\n", b"holiday pictures", b"\x00" * 100])
def test_a_part_without_samples_is_left_alone(final, content):
    part = final.with_name(final.name + ".part")
    part.parent.mkdir(parents=True)
    part.write_bytes(content)
    with pytest.raises(AcquisitionError, match="holds no sample"):
        archive.recover(part, 4)
    assert part.read_bytes() == content


def test_recovery_overwrites_nothing(final):
    whole_part(final)
    final.write_text("precious")
    with pytest.raises(NameExistsError):
        archive.recover(final.with_name("r01.csv.part"), 4)
    assert final.read_text() == "precious"
    with pytest.raises(AcquisitionError, match="no unfinished recording"):
        archive.recover(final, 4)


def test_a_running_recording_is_not_recovered(final):
    part = archive.PartFile(final, HEADER, 4)
    fill(part, 3)
    part.flush()
    with pytest.raises(AcquisitionError, match="being recorded at this moment"):
        archive.recover(part.path, 4)
    part.close()
    archive.recover(part.path, 4)


def test_unfinished_recordings_are_listed(tmp_path, final):
    whole_part(final)
    whole_part(tmp_path / "raw" / "unlabelled" / "r02.csv")
    names = [part.name for part in archive.unfinished(tmp_path / "raw")]
    assert names == ["r01.csv.part", "r02.csv.part"]
    assert archive.unfinished(tmp_path / "nowhere") == []
