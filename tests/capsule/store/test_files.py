import errno
import os
from pathlib import Path
from unittest.mock import Mock

import pytest

from capsule.errors import CapsuleError
from capsule.recordings.names import Entry, classify
from capsule.store import files


def test_a_file_appears_only_when_it_is_whole(tmp_path):
    target = tmp_path / "new" / "table.csv"
    with pytest.raises(RuntimeError), files.write_whole(target) as stream:
        stream.write("half")
        raise RuntimeError
    with pytest.raises(ValueError, match="not JSON compliant"):
        files.write_json(target, [float("nan")])
    assert list(target.parent.iterdir()) == []
    with files.write_whole(target) as stream:
        stream.write("1 µm\r\n\n")
        assert not target.exists()
    assert target.read_bytes() == "1 µm\r\n\n".encode()
    assert list(target.parent.iterdir()) == [target]


def test_tables_keep_full_precision_and_leave_unknown_cells_empty(tmp_path):
    rows = [{"a": 0.1 + 0.2, "b": float("nan"), "c": None}, {"a": -3.0, "b": "x,y", "c": "=1+1"}]
    files.write_csv(tmp_path / "t.csv", ["a", "b", "c"], rows)
    # No text is a formula.
    assert (tmp_path / "t.csv").read_text() == 'a,b,c\n0.30000000000000004,,\n-3.0,"x,y", =1+1\n'
    assert files.read_csv(tmp_path / "t.csv")[1] == {"a": "-3.0", "b": "x,y", "c": " =1+1"}


# What lies under 3mm/: what makes it, and the kind of entry that it is.
LISTED = {
    "a.csv": (Path.touch, "file"),
    os.fsdecode(b"\xff.csv"): (Path.touch, "file"),
    "d.csv": (Path.mkdir, "folder"),
    "b.csv": ("a.csv", "file"),
    "dots.csv": ("../../elsewhere/secret.csv", "link out"),
    "twice.csv": ("dots.csv", "link out"),
    "gone.csv": ("nowhere.csv", "dead link"),
    "loop.csv": ("loop.csv", "dead link"),
    "zero.csv": ("/dev/zero", "device"),
}


def test_the_archive_is_listed_and_links_that_lead_out_of_it_are_refused(tmp_path):
    raw, elsewhere = tmp_path / "raw", tmp_path / "elsewhere"
    for folder in (raw / "3mm", elsewhere):
        folder.mkdir(parents=True)
    (elsewhere / "secret.csv").write_text("secret")
    for name, (made, _) in LISTED.items():
        path = raw / "3mm" / name
        path.symlink_to(made) if isinstance(made, str) else made(path)
    for name, target in (("4mm", elsewhere), ("5mm", "3mm")):
        (raw / name).symlink_to(target)
    archive = files.list_archive(raw)
    # A link within the archive leads to as many recordings.
    listed = [(f"{at}/{name}", kind) for at in ("3mm", "5mm") for name, (_, kind) in LISTED.items()]
    assert archive == classify(Entry(*each) for each in (("4mm", "link out"), *listed))
    # The archive itself may lie anywhere.
    (tmp_path / "linked").symlink_to(raw)
    assert files.list_archive(tmp_path / "linked") == archive
    with pytest.raises(CapsuleError, match="does not exist"):
        files.list_archive(tmp_path / "none")


def test_without_hard_links_a_full_disk_leaves_no_half_of_a_new_file(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "link", Mock(side_effect=OSError(errno.EPERM, "no links here")))
    files.write_new(tmp_path / "r01.csv", b"whole")
    with pytest.raises(FileExistsError):
        files.write_new(tmp_path / "r01.csv", b"other")
    truly = Path.replace

    def replace(path, target):
        if target.suffix == ".csv":
            raise OSError(errno.ENOSPC, "No space left on device")
        return truly(path, target)

    monkeypatch.setattr(Path, "replace", replace)
    with pytest.raises(OSError, match="No space left"):
        files.write_new(tmp_path / "r02.csv", b"other")
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"whole"]


def test_a_fingerprint_goes_by_the_content_and_not_by_the_time_stamp(tmp_path):
    one, told = tmp_path / "one", []
    for content, date_s in ((b"1", 1), (b"2", 1), (b"1", 2)):
        one.write_bytes(content)
        os.utime(one, (date_s, date_s))
        told.append(files.fingerprint(one, 10))
    assert told[0] == told[2] != told[1]
    assert files.fingerprint(one, 0) == "too large"
    assert files.read_limited(one, 1) == files.read_limited(one, 10) == b"1"
    assert files.read_limited(one, 0) is None


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with names here")
@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir, lambda path: path.symlink_to("/dev/zero")])
def test_what_is_no_file_any_more_is_neither_waited_for_nor_read(tmp_path, make):
    path = tmp_path / "r01.csv"
    make(path)
    with pytest.raises(OSError, match=r"r01\.csv"):
        files.read_limited(path, 100)
    assert files.fingerprint(path, 100).startswith("unreadable: ")


@pytest.mark.parametrize("content", [b"", b"a,b\n1", b"a,b\n1,2,3\n", b"a,b\n\xff,1\n"])
def test_a_table_that_is_cut_or_no_table_is_refused_with_the_remedy(tmp_path, content):
    (tmp_path / "made").write_bytes(content)
    with pytest.raises(CapsuleError, match=r"made is damaged \(.*delete it, and make it again"):
        files.read_or_explain(tmp_path / "made", files.read_csv)
