"""Recordings on disk: no sample is lost, and no incomplete file has its final name."""

import errno
import os
import shutil
from pathlib import Path

import pytest

from capsule.bench import growing_file
from capsule.bench.bench_errors import AcquisitionError, DiskFullError, NameExistsError
from capsule.bench.recorder import head_of
from capsule.recordings.recording import format_sample, read_recording

HEADER = {"source": "the tests", "rate_hz": "10"}


@pytest.fixture
def final(tmp_path):
    return tmp_path / "raw" / "3mm" / "r01.csv"


def fill(part, count):
    for index in range(count):
        missing = index % 5 == 3
        part.add(format_sample(index / 10, None if missing else (index, 2, 3, 4)))


def test_a_recording_appears_whole(final):
    part = growing_file.GrowingFile(final, head_of(HEADER, 4))
    fill(part, 10)
    part.flush()
    assert not final.exists()
    assert part.finish() == final
    with final.open("rb") as stream:
        recording = read_recording(stream, 4)
    assert recording.time_s.size == 10
    assert recording.header["source"] == "the tests"
    assert list(final.parent.iterdir()) == [final]


# Kills: an entry that is written where the samples are, and one that a killed recorder loses.
def test_an_entry_is_amended_in_its_place_at_any_moment(final):
    part = growing_file.GrowingFile(final, head_of(HEADER | {"wave_until_s": "end"}, 4))
    for number, until in enumerate(("44.8", "end", "123456.7")):
        part.add(format_sample(number / 10, (number, 2, 3, 4)))
        part.flush()
        part.amend(head_of(HEADER | {"wave_until_s": until}, 4))
        with part.path.open("rb") as stream:
            assert read_recording(stream, 4).header["wave_until_s"] == until
    with pytest.raises(ValueError, match="length of the former first lines"):
        part.amend(head_of(HEADER | {"source": "another"}, 4))
    part.finish()
    assert final.read_text().endswith("\n0,0,2,3,4\n0.1,1,2,3,4\n0.2,2,2,3,4\n")


def test_samples_are_in_the_file_once_flushed(final):
    part = growing_file.GrowingFile(final, head_of(HEADER, 4))
    fill(part, 7)
    part.flush()
    assert part.path.read_text().endswith("0.6,6,2,3,4\n")
    part.close()


def test_synced_every_second_and_not_more_often(final, monkeypatch):
    synced = []
    now_s = [100.0]
    monkeypatch.setattr(growing_file.os, "fsync", synced.append)
    monkeypatch.setattr(growing_file.time, "monotonic", lambda: now_s[0])
    part = growing_file.GrowingFile(final, head_of(HEADER, 4))
    synced.clear()
    for _ in range(50):
        now_s[0] += 0.1
        part.sync()
    assert len(synced) in (4, 5)
    part.close()


def test_a_name_is_never_taken_twice(final):
    part = growing_file.GrowingFile(final, head_of(HEADER, 4))
    with pytest.raises(NameExistsError, match="unfinished"):
        growing_file.GrowingFile(final, head_of(HEADER, 4))
    fill(part, 3)
    # Somebody copies a recording of that name in while this one runs.
    final.write_text("precious")
    with pytest.raises(NameExistsError, match="samples are kept in r01"):
        part.finish()
    assert final.read_text() == "precious"
    assert part.path.exists()
    with pytest.raises(NameExistsError, match="never overwrites"):
        growing_file.check_free(final)


def test_file_systems_without_links_serve_too(final, monkeypatch):
    def refuse(*names):
        raise OSError(errno.EPERM, "no links here")

    monkeypatch.setattr(growing_file.os, "link", refuse)
    part = growing_file.GrowingFile(final, head_of(HEADER, 4))
    fill(part, 3)
    assert part.finish().exists()
    assert not part.path.exists()
    second = growing_file.GrowingFile(final.with_name("r02.csv"), head_of(HEADER, 4))
    fill(second, 3)
    second.final.write_text("precious")
    with pytest.raises(NameExistsError):
        second.finish()
    assert second.final.read_text() == "precious"


@pytest.mark.parametrize("room", range(0, 48, 5))
def test_a_full_disk_leaves_whole_lines(final, monkeypatch, room):
    part = growing_file.GrowingFile(final, head_of(HEADER, 4))
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

    monkeypatch.setattr(growing_file.os, "write", write)
    fill(part, 5)
    with pytest.raises(DiskFullError, match="disk is full"):
        part.flush()
    part.close()
    after = part.path.read_bytes()
    assert after.startswith(before)
    assert after.endswith(b"\n")
    assert len(before) + room - len(after) < len("0.0,0,2,3,4\n")


def whole_part(final):
    part = growing_file.GrowingFile(final, head_of(HEADER, 4))
    fill(part, 6)
    part.flush()
    part.close()
    return part.path.read_bytes()


def test_unfinished_recordings_are_listed(tmp_path, final):
    whole_part(final)
    whole_part(tmp_path / "raw" / "unlabelled" / "r02.csv")
    names = [part.name for part in growing_file.unfinished(tmp_path / "raw")]
    assert names == ["r01.csv.part", "r02.csv.part"]
    assert growing_file.unfinished(tmp_path / "nowhere") == []


@pytest.fixture
def going_on(final, monkeypatch, tmp_path):
    """Return a recording of three samples that checks its path at every sync."""
    monkeypatch.setattr(growing_file, "SYNC_EVERY_S", 0)
    monkeypatch.setattr(growing_file.tempfile, "gettempdir", lambda: str(tmp_path / "elsewhere"))
    told = []
    part = growing_file.GrowingFile(final, head_of(HEADER, 4), tell=told.append)
    fill(part, 3)
    part.flush()
    return part, told


def finish_after(going_on, expected):
    part, told = going_on
    part.sync()
    assert part.path == expected.with_name(expected.name + ".part")
    part.add(format_sample(0.3, (3, 2, 3, 4)))
    part.flush()
    part.sync()
    assert part.finish() == expected
    with expected.open("rb") as stream:
        assert read_recording(stream, 4).values[0].tolist() == [0, 1, 2, 3]
    (text,) = told
    assert f"all samples so far were copied to {expected}.part, and go on there" in text


@pytest.mark.parametrize("what", ["file", "folder", "raw"])
def test_what_was_deleted_is_written_anew(final, going_on, what):
    part, _ = going_on
    if what == "file":
        part.path.unlink()
    else:
        shutil.rmtree(final.parent if what == "folder" else final.parents[1])
    finish_after(going_on, final)


@pytest.mark.parametrize("what", ["file", "folder"])
def test_what_was_renamed_is_written_anew_and_kept(final, going_on, what):
    part, _ = going_on
    renamed = final.with_name("other.part") if what == "file" else final.parents[1] / "4mm"
    (part.path if what == "file" else final.parent).rename(renamed)
    finish_after(going_on, final)
    kept = renamed if what == "file" else renamed / "r01.csv.part"
    assert kept.read_text().endswith("0.2,2,2,3,4\n")


def test_another_file_in_the_place_is_left_alone(final, going_on):
    part, _ = going_on
    part.path.rename(final.with_name("other"))
    part.path.write_text("precious")
    finish_after(going_on, final.with_name("r01-2.csv"))
    assert final.with_name("r01.csv.part").read_text() == "precious"


def test_where_the_folder_cannot_be_made_again_another_disk_serves(final, going_on, tmp_path):
    shutil.rmtree(final.parent)
    final.parent.write_text("a file in place of the folder")
    finish_after(going_on, tmp_path / "elsewhere" / "capsule-recordings" / "3mm" / "r01.csv")


def test_where_recordings_have_all_its_names_the_fault_says_so(final, going_on, tmp_path):
    part, _ = going_on
    part.path.unlink()
    for folder in (final.parent, tmp_path / "elsewhere" / "capsule-recordings" / "3mm"):
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("r01.csv", *(f"r01-{number}.csv" for number in range(2, 10))):
            (folder / name).touch()
    with pytest.raises(AcquisitionError, match=r"cannot be written: recordings of this name"):
        part.sync()


def test_deleted_just_before_the_end(final, going_on):
    part, told = going_on
    part.path.unlink()
    assert part.finish() == final
    assert final.exists()
    assert told


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full to stand for a full disk")
def test_a_log_whose_disk_is_full_is_told_once_and_holds_nothing_up():
    told = []
    log = growing_file.FrameLog(Path("/dev/full"), told.append)
    log.note("one")
    log.note("two")
    log.close()
    (text,) = told
    assert "continues without its log /dev/full: No space left" in text


def resumed(final, *lines):
    """Return the file that a killed survey left, and that repeats these lines."""
    file = growing_file.GrowingFile(final, "a\n", growing_file.RESUME, resumed=True)
    for line in lines:
        file.add(line)
    return file


# Kills: a replay that loses what the disk had lost, or keeps the lines of a judgement cut off.
@pytest.mark.parametrize("left", [b"a\nb\nc\nd", b"a\nb\n", b"a\nb\nc\nother\n", b""])
def test_a_resumed_file_goes_on_behind_the_lines_that_it_repeats(tmp_path, left):
    (tmp_path / "stream.csv.part").write_bytes(left)
    file = resumed(tmp_path / "stream.csv", "b\n", "c\n")
    with pytest.raises(AcquisitionError, match="another program is writing"):
        resumed(tmp_path / "stream.csv")
    file.go_on(file.repeated())
    file.add("e\n")
    assert file.finish().read_bytes() == b"a\nb\nc\ne\n"


def test_a_resumed_file_with_other_lines_is_left_as_it_is(tmp_path):
    (tmp_path / "stream.csv.part").write_bytes(b"a\nB\nc\n")
    file = resumed(tmp_path / "stream.csv", "b\n")
    with pytest.raises(AcquisitionError, match=r"differs in the resumed session.*--out"):
        file.repeated()
    file.close()
    assert file.path.read_bytes() == b"a\nB\nc\n"
