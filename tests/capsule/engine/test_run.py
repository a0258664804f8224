"""A run: the folder that it may use, its start, the mark of the page, and what its end tells."""

import atexit
import os
import re
import shutil
import subprocess
import time
from contextlib import ExitStack, nullcontext
from pathlib import Path
from unittest.mock import Mock

import pytest

from capsule.engine import run
from capsule.engine.jobs import RUN_LOCK, STATES, hold_run_lock
from capsule.errors import CapsuleError
from capsule.store import files
from capsule.store.results import divide
from capsule.survey.listed import Surveys

KEY = "0123456789" * 2
PAGE = f"<head>\n{KEY}\n</head>\n<body>\n<p>one</p>\n<pre><body>\n</pre>\n".encode()
REPORT, RESULTS, NOTES = map(Path, ("results/report.html", "results", "notes"))


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Work in an empty folder; end the locks with each test, and do nothing after the last."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(atexit, "register", Mock())
    RESULTS.mkdir()
    with ExitStack() as held:
        monkeypatch.setattr(run, "hold_run_lock", lambda: held.enter_context(hold_run_lock()))
        yield


def run_of(names=("3mm/r01",), surveys=None, held_out=(), **more):
    """Return a run with these recordings."""
    config = {"recordings_per_job": "auto", "evaluation": {"held_out": held_out}}
    judged = divide(names, "auto"), surveys or Surveys([], {})
    return run.Run("raw", "results", "sessions", config, *judged, **more)


def test_a_run_takes_the_lock_tidies_signs_and_tells_of_keys_without_effect(tmp_path, capsys):
    left, ahead, past = (RESULTS / name for name in (f".a.123{files.UNFINISHED}", "ahead", "past"))
    for path, date_s in ((left, 1e9), (ahead, 4e9), (past, 1e9)):
        path.touch()
        os.utime(path, (date_s, date_s))
    (RESULTS / "gone").symlink_to(tmp_path / "none")
    states = {"fit.py": {"a.py": [1, 2, 3, 4]}}
    # An archive that passed a limit: its jobs are others.
    (RESULTS / "recordings.csv").write_text("recording\n" + 501 * "3mm/r\n")
    run_of(without_effect=["a key has no effect"], states=states).begin()
    assert (left.exists(), past.stat().st_mtime) == (False, 1e9)
    assert abs(ahead.stat().st_mtime - time.time()) < 60
    assert files.read_json(STATES) == states
    # Results that are put back later have another sign.
    sign = (RUN_LOCK.parent / run.SIGN).read_text().split()[0]
    assert sign == (RESULTS / run.SIGN).read_text().strip()
    assert RUN_LOCK.read_text().startswith(f"process {os.getpid()} on ")
    told = r"1 recordings: .* up to 1 instead of 16, so everything .*\na key has no effect\n"
    assert re.fullmatch(told, capsys.readouterr().err)
    with pytest.raises(CapsuleError, match="another run uses this folder"):
        run_of().begin()


# Another key: as after `snakemake results/templates.npz`. Only the head of a page tells its key.
@pytest.mark.parametrize(
    ("key", "before", "fits"),
    [(KEY, 0, True), (KEY, 1000, True), (KEY, 5000, False), (KEY[::-1], 0, False)],
)
def test_from_its_start_on_the_page_is_marked_until_it_fits_again(capsys, key, before, fits):
    page = b" " * before + PAGE
    marked = page.replace(b"<body>\n", b"<body>\n" + run.OUTDATED, 1)
    REPORT.write_bytes(page)
    started = run_of()
    started.begin()
    # A mark that is there already does not write the page again.
    os.utime(REPORT, (1, 1))
    run.mark_outdated(REPORT, outdated=True)
    assert (REPORT.read_bytes(), REPORT.stat().st_mtime) == (marked, 1)
    started.succeed(key)
    assert REPORT.read_bytes() == (page if fits else marked)
    told = "The report: {}\n" if fits else "{0} is out of date; make it again: snakemake -c2 {0}\n"
    assert capsys.readouterr().err == told.format(REPORT)


def test_the_end_of_a_run_lists_what_is_rejected_alike_confounded_passed_over_and_gone(capsys):
    surveys = Surveys(["1-gut", "2-gut"], {"3-gut": "not finished"})
    of_benches = [f"{size}mm/b{number}" for size in (0, 3) for number in range(4)]
    started = run_of(["3mm/r01", *of_benches], surveys=surveys, held_out=["spring"])
    rows = [(name, "accepted", "", "", f"bench {name[0]}") for name in of_benches]
    rows.append(("3mm/r01", "accepted", "", "3mm/r02", "bench 3"))
    rows.append(("3mm/r02", "accepted", "", "3mm/r01", "bench 3"))
    rows.append(("3mm/r03", "rejected", "the file is empty", "", ""))
    columns = ["recording", "status", "reason", "near_copies", "source"]
    files.write_cells(RESULTS / "recordings.csv", columns, rows)
    (RESULTS / "passed_over.csv").write_text("path,reason\nnotes.txt,not in a folder\n")
    files.write_json(RESULTS / "surveys/1-gut/survey.json", {"problem": "no track"})
    files.write_json(RESULTS / "surveys/2-gut/survey.json", {"name": "2-gut"})
    # Two are of a recording that was removed, and a table of an earlier version.
    for name in ("checks/3mm/r01.json", "checks/3mm/r09.json", "evaluation/auc.csv"):
        files.write_json(RESULTS / name, {})
    started.succeed(KEY)
    assert capsys.readouterr().err.splitlines() == [
        "10 recordings accepted, 1 rejected.",
        "  rejected: raw/3mm/r03: the file is empty",
        "  nearly the same as 3mm/r02: raw/3mm/r01",
        "  nearly the same as 3mm/r01: raw/3mm/r02",
        "  evaluation.held_out: no labelled recording names the session 'spring'",
        "  confounded: among the recordings that teach, whether there is a nodule follows from the "
        "source",
        "  passed over: raw/notes.txt: not in a folder",
        "  survey passed over: sessions/1-gut: cannot be read: no track",
        "  survey passed over: sessions/3-gut: not finished",
        "2 files are of recordings, batches or tables that are gone, and are not used, such as "
        "results/checks/3mm/r09.json",
    ]


def test_a_full_disk_stops_a_run_before_its_first_job_and_is_told_at_the_end(monkeypatch, capsys):
    monkeypatch.setattr(shutil, "disk_usage", lambda path: Mock(free=300_000))
    monkeypatch.setattr(atexit, "register", at_end := Mock())
    REPORT.write_bytes(PAGE)
    with pytest.raises(CapsuleError, match="no space left on device, nothing was started"):
        run_of().begin()
    assert REPORT.read_bytes() == PAGE
    at_end.call_args.args[0]()
    assert "The disk is full: only 0.3 MB are free." in capsys.readouterr().err


def test_slurms_jobs_stop_a_run_and_a_silent_slurm_is_told(tmp_path, monkeypatch, capsys):
    name = "7a07c6ef-c924-48fb-9bf6-6c09dcf75936"
    # Only jobs of Snakemake in this folder count.
    answer = (
        f"11 {name} {tmp_path}\n12 study_{name} {tmp_path}\n12 study_{name} {tmp_path}\n"
        f"13 {name} {tmp_path}/other\n14 bash {tmp_path}\n15 my own {tmp_path}\n"
    )
    squeue = Mock(return_value=Mock(stdout=answer))
    monkeypatch.setattr(shutil, "which", lambda name: name)
    monkeypatch.setattr(subprocess, "run", squeue)
    assert run.unfinished_jobs(tmp_path) == (), "nothing was submitted from this folder"
    run.LOGS.mkdir(parents=True)
    with pytest.raises(CapsuleError, match=r"use this folder \(11, 12\); .*: scancel 11 12$"):
        run_of().begin()
    squeue.side_effect = subprocess.CalledProcessError(1, "", stderr="tried\nno controller\n")
    assert run.unfinished_jobs(tmp_path) == ()
    assert "squeue does not answer (no controller); make sure" in capsys.readouterr().err


def make(*paths):
    """Make files, and folders where a path ends with a stroke."""
    for name in paths:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).mkdir() if name.endswith("/") else Path(name).touch()


TABLE, NOTE = "results/recordings.csv", "notes/metadata/a"
GONE = "are gone, so nobody knows .*; remove results/ and run again$"
OTHERS = "so nobody knows .*; remove results/ and run again, or put back what that run has left"


# What is there, the sign in the results, and that beside the notes, with the folder of the results.
@pytest.mark.parametrize(
    ("there", "made_by", "noted_by", "told"),
    [
        ([], "", "", ""),
        (["results/logs/list.log"], "", "", ""),
        ([TABLE, NOTE], "", "", ""),
        ([TABLE, "notes/incomplete/a"], "", "", ""),
        (["results/checks/3mm/r01.json"], "", "", GONE),
        # A run that has just begun.
        (["results/checks/3mm/"], "", "", ""),
        ([TABLE, "notes/log/a", "notes/metadata/"], "", "", GONE),
        ([TABLE, NOTE], "one", "one results", ""),
        # Results that were put back, those of a version without signs, and those of another folder.
        ([TABLE, NOTE], "one", "two results", OTHERS),
        ([TABLE, NOTE], "", "two results", OTHERS),
        ([TABLE, NOTE], "one", "two elsewhere", ""),
        # Results that somebody has removed.
        ([NOTE], "", "one results", ""),
    ],
)
def test_results_that_the_last_run_has_not_left_are_refused(there, made_by, noted_by, told):
    make(*there)
    for folder, sign in ((RESULTS, made_by), (NOTES, noted_by)):
        if sign:
            (folder / run.SIGN).write_text(sign)
    with pytest.raises(CapsuleError, match=told) if told else nullcontext():
        run.refuse_unknown_results(RESULTS, NOTES)


@pytest.mark.parametrize("written", [0, 1, 2])
def test_a_run_that_is_killed_at_its_sign_leaves_results_that_are_known(monkeypatch, written):
    make(TABLE, NOTE)
    run.sign_results(RESULTS, NOTES)
    earlier, outcomes = (RESULTS / run.SIGN).read_text(), iter([None] * written)

    def killed(path):
        next(outcomes)
        return files.write_whole(path)

    with monkeypatch.context() as patched, pytest.raises(StopIteration):
        patched.setattr(run, "write_whole", killed)
        run.sign_results(RESULTS, NOTES)
    run.refuse_unknown_results(RESULTS, NOTES)
    run.sign_results(RESULTS, NOTES)
    (RESULTS / run.SIGN).write_text(earlier)
    with pytest.raises(CapsuleError, match=OTHERS):
        run.refuse_unknown_results(RESULTS, NOTES)


def test_an_error_of_the_input_or_of_the_disk_is_one_line_of_snakemakes_own():
    # The second: results that another user may not read.
    denied = PermissionError(13, "not allowed", "results")
    for error, told in ((CapsuleError("why"), "why"), (denied, "error: results: not allowed")):
        with pytest.raises(KeyError) as caught, run.told_as(KeyError):
            raise error
        assert (caught.value.args, caught.value.__suppress_context__) == ((told,), True)


# Permissions do not bind the administrator, who runs some of these tests.
@pytest.mark.parametrize("name", ["", "metadata", "iocache/latest.pkl"])
def test_what_cannot_be_written_or_has_a_brace_is_named_with_the_way_out(
    tmp_path, monkeypatch, name
):
    (path := tmp_path / ".snakemake" / name).mkdir(parents=True)
    run.refuse_folders(Path("/"), tmp_path)
    for folders in ((tmp_path, Path("/{run}")), (Path("/{run}"), tmp_path)):
        with pytest.raises(CapsuleError, match=r"/\{run\}: rename this folder"):
            run.refuse_folders(*folders)
    monkeypatch.setattr(os, "access", lambda each, mode: each != path or mode != os.W_OK)
    with pytest.raises(CapsuleError, match=f"^{path} cannot be written, .*capsule new NAME"):
        run.refuse_folders(Path("/"), tmp_path)
