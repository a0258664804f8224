"""Recordings on disk: nothing lost, nothing half written under its final name."""

import errno
import os

import pytest

from acquisition import archive
from acquisition.bench_errors import DiskFullError, NameExistsError
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


def whole_part(final):
    part = archive.PartFile(final, HEADER, 4)
    fill(part, 6)
    part.flush()
    part.close()
    return part.path.read_bytes()


def test_unfinished_recordings_are_listed(tmp_path, final):
    whole_part(final)
    whole_part(tmp_path / "raw" / "unlabelled" / "r02.csv")
    names = [part.name for part in archive.unfinished(tmp_path / "raw")]
    assert names == ["r01.csv.part", "r02.csv.part"]
    assert archive.unfinished(tmp_path / "nowhere") == []
