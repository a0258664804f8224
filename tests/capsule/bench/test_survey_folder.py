"""The files of a survey on a disk that is full."""

import errno
import os

import pytest

from capsule.bench import survey_folder
from capsule.bench.bench_errors import AcquisitionError, DiskFullError
from capsule.bench.survey_folder import SessionFolder, read_about


def no_room(path, *_):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), path)


def test_a_full_disk_at_the_beginning_leaves_no_folder_in_the_way(tmp_path, monkeypatch):
    folder = tmp_path / "tuesday"

    def make_only_the_folder(path, _):
        path.parent.mkdir()
        no_room(path)

    monkeypatch.setattr(survey_folder, "write_json", make_only_the_folder)
    with pytest.raises(DiskFullError, match=r"session\.json.*run: the same command again"):
        SessionFolder(folder, {}, 4, resumed=False)
    assert not folder.exists()


@pytest.mark.parametrize(
    ("writer", "act"),
    [
        ("write_csv", lambda disk: disk.write_places([])),
        ("write_json", lambda disk: disk.note_index(1.0)),
    ],
)
def test_a_disk_that_gets_full_is_named_with_the_way_to_go_on(tmp_path, monkeypatch, writer, act):
    disk = SessionFolder(tmp_path / "tuesday", {}, 4, resumed=False)
    monkeypatch.setattr(survey_folder, writer, no_room)
    with pytest.raises(DiskFullError, match=r"the disk is full at .*capsule survey --resume"):
        act(disk)
    disk.discard()


def test_another_fault_of_the_disk_is_told_as_it_is(tmp_path, monkeypatch):
    disk = SessionFolder(tmp_path / "tuesday", {}, 4, resumed=False)

    def refuse(*_):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(survey_folder, "write_csv", refuse)
    with pytest.raises(AcquisitionError, match="cannot be written: Permission denied") as refused:
        disk.write_places([])
    assert not isinstance(refused.value, DiskFullError)
    disk.discard()


@pytest.mark.parametrize("content", [b"", b'{"boards": ', b"\xff"])
def test_a_session_whose_settings_are_damaged_is_not_resumed_and_stays(tmp_path, content):
    path = tmp_path / "session.json"
    path.write_bytes(content)
    with pytest.raises(AcquisitionError, match="cannot be resumed; its samples stay") as refused:
        read_about(tmp_path)
    assert str(path) in str(refused.value)
    assert path.read_bytes() == content
