"""Recordings on disk: no sample is lost, and no incomplete file has its final name."""

import errno
import os
import shutil
from pathlib import Path

import pytest

from capsule.bench import growing_file
from capsule.bench.bench_errors import AcquisitionError, NameExistsError
from capsule.bench.recorder import head_of
from capsule.recordings.recording import format_sample, read_recording

HEADER = {"source": "the tests", "rate_hz": "10"}


@pytest.fixture
def final(tmp_path):
    return tmp_path / "raw" / "3mm" / "r01.csv"


def part_of(final, count, **options):
    part = growing_file.GrowingFile(final, head_of(HEADER, 4), **options)
    for index in range(count):
        missing = index % 5 == 3
        part.add(format_sample(index / 10, None if missing else (index, 2, 3, 4)))
    part.flush()
    return part


def refuse(*names):
    raise OSError(errno.EPERM, "no links here")


@pytest.mark.parametrize("link", [os.link, refuse], ids=["links", "a file system without links"])
def test_a_recording_appears_whole_and_no_name_is_taken_twice(final, monkeypatch, link):
    monkeypatch.setattr(growing_file.os, "link", link)
    part = part_of(final, 10)
    assert part.path.read_text().endswith("0.9,9,2,3,4\n")
    assert growing_file.unfinished(final.parents[1]) == [part.path]
    assert growing_file.unfinished(final.parents[2] / "nowhere") == []
    assert not final.exists()
    with pytest.raises(NameExistsError, match="unfinished"):
        part_of(final, 0)
    assert part.finish() == final
    with final.open("rb") as stream:
        recording = read_recording(stream, 4)
    assert recording.time_s.size == 10
    assert recording.header["source"] == "the tests"
    assert list(final.parent.iterdir()) == [final]
    with pytest.raises(NameExistsError, match="never overwrites"):
        growing_file.check_free(final)
    second = part_of(final.with_name("r02.csv"), 3)
    # Somebody copies a recording of that name in while this one runs.
    second.final.write_text("precious")
    with pytest.raises(NameExistsError, match="samples are kept in r02"):
        second.finish()
    assert second.final.read_text() == "precious"
    assert second.path.exists()


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


@pytest.fixture
def going_on(final, monkeypatch, tmp_path):
    """Return a recording of three samples that checks its path at every sync."""
    monkeypatch.setattr(growing_file, "SYNC_EVERY_S", 0)
    monkeypatch.setattr(growing_file.tempfile, "gettempdir", lambda: str(tmp_path / "elsewhere"))
    told = []
    return part_of(final, 3, tell=told.append), told


def replace_file(path):
    path.rename(path.with_name("other"))
    path.write_text("precious")


def replace_folder(path):
    shutil.rmtree(path.parent)
    path.parent.write_text("a file in place of the folder")


@pytest.mark.parametrize(
    ("disturb", "goes_on_as", "kept"),
    [
        (Path.unlink, "raw/3mm/r01", {}),
        (lambda path: shutil.rmtree(path.parents[1]), "raw/3mm/r01", {}),
        (lambda path: path.rename(path.with_name("other.part")), "raw/3mm/r01",
         {"raw/3mm/other.part": "0.2,2,2,3,4\n"}),
        (lambda path: path.parent.rename(path.parents[1] / "4mm"), "raw/3mm/r01",
         {"raw/4mm/r01.csv.part": "0.2,2,2,3,4\n"}),
        (replace_file, "raw/3mm/r01-2", {"raw/3mm/r01.csv.part": "precious"}),
        (replace_folder, "elsewhere/capsule-recordings/3mm/r01", {}),
    ],
    ids=["file deleted", "raw deleted", "file renamed", "folder renamed",
         "another file in its place", "a file in place of the folder"],
)  # fmt: skip
def test_what_was_lost_is_written_anew_and_nothing_overwritten(
    tmp_path, going_on, disturb, goes_on_as, kept
):
    part, told = going_on
    expected = tmp_path / f"{goes_on_as}.csv"
    disturb(part.path)
    part.sync()
    assert part.path == expected.with_name(expected.name + ".part")
    part.add(format_sample(0.3, (3, 2, 3, 4)))
    part.flush()
    part.path.unlink()  # just before the end
    assert part.finish() == expected
    with expected.open("rb") as stream:
        assert read_recording(stream, 4).values[0].tolist() == [0, 1, 2, 3]
    text, again = told
    assert again.startswith(f"warning: {expected}.part was deleted")
    assert f"all samples so far were copied to {expected}.part, and go on there" in text
    for name, end in kept.items():
        assert (tmp_path / name).read_text().endswith(end)


def test_where_recordings_have_all_its_names_the_fault_says_so(final, going_on, tmp_path):
    part, _ = going_on
    part.path.unlink()
    for folder in (final.parent, tmp_path / "elsewhere" / "capsule-recordings" / "3mm"):
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("r01.csv", *(f"r01-{number}.csv" for number in range(2, 10))):
            (folder / name).touch()
    with pytest.raises(AcquisitionError, match=r"cannot be written: recordings of this name"):
        part.sync()


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
@pytest.mark.parametrize("left", [b"a\nb\nc\nd", b"a\nb\n", b"a\nb\nx", b"a\nb\nc\nother\n", b""])
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
