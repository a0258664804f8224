import pytest

import files
from capsule.errors import CapsuleError


def test_a_file_appears_only_when_it_is_whole(tmp_path):
    target = tmp_path / "new" / "table.csv"
    with pytest.raises(RuntimeError), files.write_whole(target) as stream:
        stream.write("half")
        raise RuntimeError
    assert list(target.parent.iterdir()) == []
    with files.write_whole(target) as stream:
        stream.write("whole\n")
        assert not target.exists()
    assert target.read_bytes() == b"whole\n"
    assert list(target.parent.iterdir()) == [target]


def test_tables_keep_full_precision_and_leave_unknown_cells_empty(tmp_path):
    rows = [{"a": 0.1 + 0.2, "b": float("nan"), "c": None}, {"a": 3.0, "b": "x,y", "c": 1}]
    files.write_csv(tmp_path / "t.csv", ["a", "b", "c"], rows)
    assert (tmp_path / "t.csv").read_text() == 'a,b,c\n0.30000000000000004,,\n3.0,"x,y",1\n'
    assert files.read_csv(tmp_path / "t.csv")[1] == {"a": "3.0", "b": "x,y", "c": "1"}


def test_json_with_nan_is_refused(tmp_path):
    with pytest.raises(ValueError, match="not JSON compliant"):
        files.write_json(tmp_path / "x.json", {"rmse": float("nan")})
    assert list(tmp_path.iterdir()) == []


def test_only_accepted_recordings_are_read(tmp_path):
    rows = [
        {"recording": "3mm/a", "status": "accepted"},
        {"recording": "3mm/b", "status": "rejected"},
    ]
    files.write_csv(tmp_path / "index.csv", ["recording", "status"], rows)
    assert files.accepted_recordings(tmp_path / "index.csv") == ["3mm/a"]


def test_the_archive_is_listed_from_the_disk(tmp_path):
    (tmp_path / "3mm" / "d.csv").mkdir(parents=True)
    (tmp_path / "3mm" / "a.csv").touch()
    (tmp_path / "3mm" / "gone.csv").symlink_to("nowhere.csv")
    archive = files.list_archive(tmp_path)
    assert archive.recordings == ("3mm/a",)
    assert archive.refused == {
        "3mm/d.csv": "a folder, not a file",
        "3mm/gone.csv": "a link that leads nowhere",
    }
    with pytest.raises(CapsuleError, match="does not exist"):
        files.list_archive(tmp_path / "none")


def test_a_users_fault_ends_in_one_line(capsys):
    def main():
        raise CapsuleError("raw/3mm/r01.csv: say why")

    with pytest.raises(SystemExit) as stop:
        files.run(main)
    assert stop.value.code == "error: raw/3mm/r01.csv: say why"


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(SystemExit) as stop:
        files.run(lambda: files.read_csv(tmp_path / "none.csv"))
    assert str(stop.value.code).startswith(f"error: {tmp_path / 'none.csv'}: No such file")
