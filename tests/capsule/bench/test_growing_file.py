"""Recordings on disk: no sample is lost, only whole files have names, kills are recovered."""

import errno
import io
import os
import re
import shutil
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from capsule.bench import growing_file, recovery
from capsule.bench.bench_errors import AcquisitionError, NameExistsError
from capsule.bench.recorder import head_of
from capsule.interface.archive import read_recording
from capsule.recordings.recording import format_header, format_sample

HEADER = {"source": "the tests", "rate_hz": "10"}
HEAD = format_header(HEADER, 4).encode()
SAMPLES = [None if number % 5 == 3 else (number, 2, 3, 4) for number in range(500)]
LINES = [format_sample(number / 10, sample).encode() for number, sample in enumerate(SAMPLES)]
WHOLE = HEAD + b"".join(LINES)
READINGS = np.random.default_rng(1).normal(2.5, 1.0, (525, 4))
READINGS[7] = [1e-7, -0.25, 3.0, 12345.678901234567]
VOLTS = format_header(HEADER | {"unit": "V"}, 4).encode() + b"".join(
    format_sample(index / 10, tuple(values)).encode() for index, values in enumerate(READINGS)
)
ORIGINAL = "r01.csv.part.recovered"


@pytest.fixture
def final(tmp_path):
    return tmp_path / "raw" / "3mm" / "r01.csv"


def part_of(final, count, **options):
    part = growing_file.GrowingFile(final, head_of(HEADER, 4), **options)
    for line in LINES[:count]:
        part.add(line.decode())
    part.flush()
    return part


@pytest.mark.parametrize("link", [os.link, Mock(side_effect=OSError(errno.EPERM, "no links"))])
def test_a_recording_appears_whole_and_no_name_is_taken_twice(final, monkeypatch, link):
    monkeypatch.setattr(growing_file.os, "link", link)
    part = part_of(final, 10)
    assert growing_file.unfinished(final.parents[1]) == [part.path]
    assert not final.exists()
    with pytest.raises(NameExistsError, match="complete it first: capsule record --recover"):
        part_of(final, 0)
    assert part.finish() == final
    recording = read_recording(final, 4)
    assert (recording.time_s.size, recording.header["source"]) == (10, "the tests")
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
        part.add(LINES[number].decode())
        part.flush()
        part.amend(head_of(HEADER | {"wave_until_s": until}, 4))
        assert read_recording(part.path, 4).header["wave_until_s"] == until
    with pytest.raises(ValueError, match="length of the former first lines"):
        part.amend(head_of(HEADER | {"source": "another"}, 4))
    part.finish()
    assert final.read_text().endswith("\n0,0,2,3,4\n0.1,1,2,3,4\n0.2,2,2,3,4\n")


def test_synced_every_second_and_not_more_often(final, monkeypatch):
    synced, now_s = [], [100.0]
    monkeypatch.setattr(growing_file.time, "monotonic", lambda: now_s[0])
    part = part_of(final, 0)
    monkeypatch.setattr(growing_file.os, "fsync", synced.append)
    for now_s[0] in 100 + np.arange(1, 51) / 10:
        part.sync()
    assert len(synced) in (4, 5)


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
        (lambda path: path.parent.rename(path.parents[1] / "4mm"), "raw/3mm/r01",
         {"raw/4mm/r01.csv.part": "0.2,2,2,3,4\n"}),
        (replace_file, "raw/3mm/r01-2", {"raw/3mm/r01.csv.part": "precious"}),
        (replace_folder, "elsewhere/capsule-recordings/3mm/r01", {}),
    ],
)  # fmt: skip
def test_what_was_lost_is_written_anew(tmp_path, final, monkeypatch, disturb, goes_on_as, kept):
    monkeypatch.setattr(growing_file, "SYNC_EVERY_S", 0)
    monkeypatch.setattr(growing_file.tempfile, "gettempdir", lambda: str(tmp_path / "elsewhere"))
    told, expected = [], tmp_path / f"{goes_on_as}.csv"
    part = part_of(final, 3, tell=told.append)
    disturb(part.path)
    part.sync()
    part.add(format_sample(0.3, (3, 2, 3, 4)))
    part.flush()
    part.path.unlink()  # just before the end
    assert part.finish() == expected
    assert read_recording(expected, 4).values[0].tolist() == [0, 1, 2, 3]
    assert f"all samples so far were copied to {expected}.part, and go on there" in told[0]
    assert told[1].startswith(f"warning: {expected}.part was deleted")
    for name, end in kept.items():
        assert (tmp_path / name).read_text().endswith(end)


def take_all_names(path):
    path.unlink()
    for name in ("r01.csv", *(f"r01-{number}.csv" for number in range(2, 10))):
        path.with_name(name).touch()


@pytest.mark.parametrize(
    ("disturb", "reason"),
    [(replace_folder, "File exists"), (take_all_names, "recordings of this name")],
)
def test_where_no_file_can_take_its_place_the_fault_says_why(final, monkeypatch, disturb, reason):
    elsewhere = final.parents[1] / "capsule-recordings"
    monkeypatch.setattr(growing_file, "SYNC_EVERY_S", 0)
    monkeypatch.setattr(growing_file.tempfile, "gettempdir", lambda: str(elsewhere.parent))
    part = part_of(final, 3)
    disturb(part.path)
    elsewhere.symlink_to(final.parents[1])  # the same names are taken there
    with pytest.raises(AcquisitionError, match=f"cannot be written: {reason}"):
        part.sync()


# Kills: a replay that loses what the disk had lost, or keeps the lines of a judgement cut off.
@pytest.mark.parametrize(
    "left", [b"a\nb\nc\nd", b"a\nb\n", b"a\nb\nx", b"a\nb\nc\nother\n", b"", b"a\nB\nc\n"]
)
def test_a_resumed_file_goes_on_behind_the_lines_that_it_repeats_or_stays_as_it_is(part, left):
    part.write_bytes(left)
    file = growing_file.GrowingFile(part.with_suffix(""), "a\n", growing_file.RESUME, resumed=True)
    for line in ("b\n", "c\n"):
        file.add(line)
    if b"B" in left:
        with pytest.raises(AcquisitionError, match=r"differs in the resumed session.*--out"):
            file.repeated()
        file.close()
        assert file.path.read_bytes() == left
    else:
        file.go_on(file.repeated())
        file.add("e\n")
        assert file.finish().read_bytes() == b"a\nb\nc\ne\n"


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
def test_one_bad_line_costs_one_sample_or_one_entry(part, bad):
    head = HEAD.replace(b"source", b"so\xffrce")
    content = head + b"".join([*LINES[:250], bad + b"\n", *LINES[251:]])
    samples, dropped, after = recovered(part, content)
    assert (samples, dropped) == (499, 0)
    recording = read_recording(io.BytesIO(after), 4)
    kept = np.delete(np.arange(500), 250)
    np.testing.assert_allclose(recording.time_s, kept / 10)
    np.testing.assert_array_equal(recording.values[0], np.where(kept % 5 == 3, np.nan, kept))
    assert recording.header["recovered"] == "lines skipped because they could not be read: 2"
    assert HEADER.keys() - recording.header.keys() == {"source"}


def test_what_cannot_be_recovered_is_left_alone_and_overwrites_nothing(part):
    part.write_bytes(b"# a: b\n")
    with pytest.raises(AcquisitionError, match="holds no sample"):
        recovery.recover(part, 4)
    assert (part.read_bytes(), list(part.parent.iterdir())) == (b"# a: b\n", [part])
    part.write_bytes(WHOLE)
    for taken in (part.with_suffix(""), part.with_name(ORIGINAL)):
        taken.write_bytes(b"precious")
        with pytest.raises(NameExistsError, match=f"{taken} exists; rename it"):
            recovery.recover(part, 4)
        assert (part.read_bytes(), taken.read_bytes()) == (WHOLE, b"precious")
        taken.unlink()
    assert list(part.parent.iterdir()) == [part]
    part.unlink()
    file = growing_file.GrowingFile(part.with_suffix(""), WHOLE.decode())
    with pytest.raises(AcquisitionError, match=r"another program is writing .*stop"):
        recovery.recover(part, 4)
    with pytest.raises(AcquisitionError, match=r"another program is writing .*stop"):
        growing_file.GrowingFile(file.final, "", resumed=True)
    file.close()
    recovery.recover(part, 4)  # it runs no more
    with pytest.raises(AcquisitionError, match="not an unfinished recording"):
        recovery.recover(part.with_suffix(""), 4)
