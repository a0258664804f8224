"""The files of a survey on a disk that is full."""

import errno
import os
from dataclasses import replace

import numpy as np
import pytest

from capsule.bench import survey_folder
from capsule.bench.bench_errors import AcquisitionError, DiskFullError, NameExistsError
from capsule.bench.survey_folder import SessionFolder, check_new, read_about
from capsule.survey.files import parse_session
from support.surveys import session_contents


# Kills: a full disk whose remedy is that of a recording, or that leaves a folder in the way.
@pytest.mark.parametrize(
    ("writer", "act", "remedy"),
    [
        ("write_json", None, r"session\.json.*run: the same command again"),
        ("write_csv", lambda disk: disk.write_places([]), "capsule survey --resume"),
        ("write_json", lambda disk: disk.note_index(1.0), "capsule survey --resume"),
    ],
)
def test_a_disk_that_is_full_is_told_with_its_remedy(tmp_path, monkeypatch, writer, act, remedy):
    def begin(_=None):
        return SessionFolder(tmp_path / "tuesday", {}, 4, resumed=False)

    def no_room(path, *_):
        path.parent.mkdir(exist_ok=True)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), path)

    disk = begin() if act else None
    monkeypatch.setattr(survey_folder, writer, no_room)
    with pytest.raises(DiskFullError, match=f"full .*{remedy}"):
        (act or begin)(disk)
    if disk:
        disk.discard()
    assert not (tmp_path / "tuesday").exists()


# Kills: a column that is read and that nobody writes, such as whether a place may be off.
def test_the_places_are_written_as_they_are_read(tmp_path):
    disk, contents = SessionFolder(tmp_path / "tuesday", {}, 4, resumed=False), session_contents()
    first, second = parse_session("tuesday", contents).places
    # An interval of a size without an upper end; a place that may be one wavelength off.
    strange = {"familiar": "no", "unfamiliar_because": "noise", "may_be_off_mm": 80.0}
    places = [replace(first, size_high_mm=np.inf, **strange), second]
    disk.write_places(places)
    disk.close()
    written = {"places.csv": (tmp_path / "tuesday" / "places.csv").read_bytes()}
    again = parse_session("tuesday", contents | written).places
    np.testing.assert_equal([vars(place) for place in again], [vars(place) for place in places])
    assert again[0].verdict == "nodule, 3.1 mm (2.4 mm or more)"


@pytest.mark.parametrize(
    ("files", "said"),
    [
        ({}, "holds no session"),
        ({"session.json": b'{"boards": '}, "cannot be resumed; its samples stay"),
        ({"session.json": b"\xff"}, "cannot be resumed; its samples stay"),
        ({"session.json": b'{"seed": 1}'}, "simulated, and only a session on boards can be"),
        ({"session.json": b'{"boards": {}}', "stream.csv": b""}, "finished; there is nothing"),
    ],
)
def test_what_cannot_be_resumed_is_left_as_it_is(tmp_path, files, said):
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    with pytest.raises(AcquisitionError, match=said) as refused:
        read_about(tmp_path)
    assert str(tmp_path) in str(refused.value)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == files
    with pytest.raises(NameExistsError, match="--resume"):
        check_new(tmp_path)
