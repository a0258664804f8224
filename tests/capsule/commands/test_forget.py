"""What `capsule forget` removes, what it refuses, and what it names because it cannot know it."""

import os
from pathlib import Path

import pytest

from capsule.commands import cli
from capsule.engine.locks import hold_run_lock
from capsule.store import files
from capsule.store.results import files_of
from support.synthetic import write_archive

NAMES = ["0mm/r01", "3mm/r07", "3mm/r07b", "unlabelled/p1"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Work in a folder with recordings and results."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CAPSULE_RUN", "")
    write_archive(tmp_path / "raw", NAMES, samples=30)
    made = [*files_of(NAMES, 1), "recordings.csv", "report.html", "logs/fit/3mm/r07.log"]
    for name in [*made, "surveys/gut-7/survey.json", "surveys/gut-8/survey.json"]:
        path = tmp_path / "results" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"made for {name}\n")
    for name in ("gut-7", "gut-8"):
        path = tmp_path / "sessions" / name / "stream.csv"
        path.parent.mkdir(parents=True)
        path.write_text(f"1.0,2.0,3.0,4.0 of {name}\n")
    return tmp_path


def forget(*words):
    """Call the command; return its exit status."""
    with pytest.raises(SystemExit) as ended:
        cli.main(["forget", *words])
        raise SystemExit(0)
    return ended.value.code


def present(folder):
    return {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "run.lock"
    }


def test_what_is_its_own_goes_and_what_is_the_others_own_stays(folder):
    (folder / "raw/3mm/r07.csv.part").touch()
    for name in ("r07", "r07b"):
        log = folder / f"logs/acquisition/3mm/{name}.log"
        log.parent.mkdir(parents=True, exist_ok=True)
        log.write_text("damaged, a wrong checksum\n")
    assert forget("raw/3mm/r07.csv", "--yes") == 0
    left = present(folder)
    assert {name for name in left if "r07." in name} == set()
    assert {f"raw/{name}.csv" for name in NAMES} - left == {"raw/3mm/r07.csv"}
    assert {"results/fits/3mm/r07b.json", "logs/acquisition/3mm/r07b.log"} <= left
    assert not {"results/recordings.csv", "results/report.html"} & left
    assert "results/surveys/gut-7/survey.json" in left


def test_a_survey_goes_with_its_pictures(folder):
    assert forget("sessions/gut-7", "--yes") == 0
    assert {name for name in present(folder) if "gut-" in name} == {
        "sessions/gut-8/stream.csv",
        "results/surveys/gut-8/survey.json",
    }
    assert not (folder / "sessions/gut-7").exists()


def test_a_recording_that_was_deleted_by_hand_leaves_its_traces_too(folder):
    (folder / "raw/3mm/r07.csv").unlink()
    assert forget("3mm/r07", "--yes") == 0
    assert {name for name in present(folder) if "r07." in name} == set()


@pytest.mark.parametrize("key", ["session", "site"])
def test_all_recordings_of_a_session_or_a_site_go(folder, key, capsys):
    for name in NAMES[:2]:
        path = folder / f"raw/{name}.csv"
        path.write_text(f"# {key}: ward 3\n{path.read_text()}")
    torn = folder / "raw/3mm/torn.csv"
    torn.write_text(f"# {key}: ward 3\n# {key}: ward 4\n")
    assert forget(f"--{key}", "ward 3", "--yes") == 0
    assert files.list_archive(folder / "raw").recordings == (*NAMES[2:3], "3mm/torn", NAMES[3])
    assert "3mm/torn is not removed, unless you name it" in capsys.readouterr().out


def test_a_file_of_300_gigabytes_is_removed_unread(folder, capsys):
    path = folder / "raw/3mm/huge.csv"
    path.touch()
    os.truncate(path, 300_000_000_000)
    for _ in range(2):
        assert forget("3mm/huge", "--dry-run") == 0
    assert forget("3mm/huge", "--yes") == 0
    assert not path.exists()


def test_copies_and_exports_that_stay_are_named(folder, capsys):
    original = folder / "raw/3mm/r07.csv"
    copy, export = folder / "mine/renamed.csv", folder / "export/all.mat"
    for path in (copy, export):
        path.parent.mkdir()
    copy.write_bytes(original.read_bytes())
    export.touch()
    (folder / "disk.img").touch()
    os.truncate(folder / "disk.img", 300_000_000_000)
    (folder / "notes.txt").write_text("repeat 3mm/r07 on Monday, not 3mm/r07b")
    assert forget("3mm/r07", "--yes") == 1
    told = capsys.readouterr().out
    for path in ("mine/renamed.csv", "notes.txt"):
        assert f"{path} still names it, or holds its readings" in told
    for path in ("disk.img", "export/all.mat"):
        assert f"{path} may hold it, and is packed or large" in told
    assert "Git keeps what was committed" in told
    assert copy.exists()


@pytest.mark.parametrize(
    ("words", "status", "told"),
    [
        (["3mm/r70", "--yes"], 1, "nothing here names 3mm/r70; give a name such as 3mm/r07"),
        (["3mm/r07"], 2, "nothing was removed; to remove all this, add --yes"),
        (["../r07", "--yes"], 2, "no name such as 3mm/r07"),
        (["/etc/passwd", "--yes"], 2, "no name such as 3mm/r07"),
        (["3mm/..", "--yes"], 2, "no name such as 3mm/r07"),
        (["--site", "elsewhere", "--yes"], 2, "no recording was found"),
        ([], 2, "no recording was found"),
    ],
)
def test_what_is_refused_removes_nothing(folder, words, status, told, capsys):
    before = present(folder)
    assert forget(*words) == status
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1
    assert present(folder) == before


@pytest.mark.parametrize(("answer", "gone"), [("y", True), ("", False), ("n", False)])
def test_at_a_terminal_it_asks(folder, monkeypatch, answer, gone):
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("builtins.input", lambda question: answer)
    assert forget("3mm/r07") == (0 if gone else 2)
    assert (folder / "raw/3mm/r07.csv").exists() is not gone


def test_beside_a_run_nothing_is_removed(folder, capsys):
    before = present(folder)
    with hold_run_lock():
        assert forget("3mm/r07", "--yes") == 1
    assert "another run uses this folder" in capsys.readouterr().err
    assert present(folder) == before


def test_after_a_kill_the_same_command_goes_on(folder, monkeypatch):
    removed, truly = [], Path.unlink

    def unlink(path, missing_ok=False):
        if len(removed) == 9:
            raise KeyboardInterrupt
        removed.append(path)
        truly(path)

    with monkeypatch.context() as patched:
        patched.setattr("pathlib.Path.unlink", unlink)
        assert forget("3mm/r07", "--yes") == 130
    assert (folder / "raw/3mm/r07.csv").exists()
    assert forget("3mm/r07", "--yes") == 0
    assert {name for name in present(folder) if "r07." in name} == set()
