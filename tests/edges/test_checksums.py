"""Checksums of files, at the start of a run and at its end."""

import hashlib
import os
import time
from pathlib import Path

import pytest
from edges.checksums import Checksums, checksum, checksum_of

from edges import checksums


def sha256(text):
    return hashlib.sha256(text.encode()).hexdigest()


@pytest.fixture
def file(tmp_path, monkeypatch):
    """Return a file that was written long ago, as the clock says."""
    path = tmp_path / "r01.csv"
    path.write_text("one")
    later = time.time_ns() + 60_000_000_000
    monkeypatch.setattr(time, "time_ns", lambda: later)
    return path


@pytest.mark.parametrize("largest", [2, 100])
def test_a_content_that_was_read_has_the_checksum_of_its_file(file, monkeypatch, largest):
    monkeypatch.setattr(checksums, "_LARGEST_BYTES", largest)
    assert checksum(file) == checksum_of(b"one") == ("3 bytes" if largest == 2 else sha256("one"))


def test_the_first_checksum_is_kept_and_the_later_one_follows_the_file(file):
    found = Checksums()
    assert found.first(str(file)) == found.now(str(file)) == sha256("one")
    file.write_text("two")
    assert (found.first(str(file)), found.now(str(file))) == (sha256("one"), sha256("two"))
    found.forget()
    assert found.first(str(file)) == sha256("two")


def test_a_file_that_did_not_change_is_read_once(file, monkeypatch):
    found = Checksums()
    found.first(str(file))
    monkeypatch.setattr(checksums, "checksum", lambda name: pytest.fail(f"{name} is read again"))
    assert found.now(str(file)) == sha256("one")


def test_a_change_is_seen_even_if_the_time_stamp_is_set_back(file):
    found, stamp = Checksums(), file.stat()
    found.first(str(file))
    file.write_text("two")
    os.utime(file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    assert found.now(str(file)) == sha256("two")


def test_a_file_that_changed_a_moment_ago_is_read_again(tmp_path, monkeypatch):
    path, found = tmp_path / "r01.csv", Checksums()
    path.write_text("one")
    found.first(str(path))
    # A change within the same tick of the clock would leave the stamp as it is.
    stamp = path.stat()
    path.write_text("two")
    monkeypatch.setattr(os, "stat", lambda name: stamp)
    assert found.now(str(path)) == sha256("two")


def test_a_missing_file_and_one_that_appears(tmp_path):
    path, found = tmp_path / "r01.csv", Checksums()
    assert found.first(str(path)) is found.now(str(path)) is None
    path.write_text("one")
    assert (found.first(str(path)), found.now(str(path))) == (None, sha256("one"))


def test_of_a_huge_file_only_the_size_counts(tmp_path):
    huge = Path(tmp_path / "huge")
    with huge.open("wb") as stream:
        stream.truncate(2_000_000_000)
    assert checksum(huge) == "2000000000 bytes"
