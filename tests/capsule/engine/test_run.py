"""Start and end of a run: what the terminal says, and when the page is marked as out of date."""

import atexit
import os
import shutil
from collections import namedtuple
from pathlib import Path

import pytest

from capsule.engine import run
from capsule.engine.jobs import RUN_LOCK, STATES, hold_run_lock
from capsule.engine.run import SIGN
from capsule.errors import CapsuleError
from capsule.store import files
from capsule.store.results import divide
from capsule.survey.listed import Surveys

KEY = "0123456789" * 2
PAGE = f'<head>\n<meta name="made-from" content="{KEY}">\n</head>\n<body>\n<p>page</p>\n'.encode()
REPORT = Path("results/report.html")
COLUMNS = ["recording", "status", "reason", "near_copies", "source"]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch, request):
    """Work in an empty folder; end the locks with each test, and do nothing after the last."""

    def hold():
        stream = hold_run_lock()
        request.addfinalizer(stream.close)
        return stream

    monkeypatch.setattr(run, "hold_run_lock", hold)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CAPSULE_RUN", "")
    monkeypatch.setattr(atexit, "register", lambda function: None)
    Path("results").mkdir()


def run_of(names=("3mm/r01",), wanted="auto", surveys=None, held_out=(), **more):
    """Return a run with these recordings."""
    config = {"recordings_per_job": wanted, "evaluation": {"held_out": held_out}}
    surveys = surveys or Surveys([], {})
    return run.Run("raw", "results", "sessions", config, divide(names, wanted), surveys, **more)


def write_lists(*rows, passed_over=()):
    """Write the list of the recordings, and that of the other files."""
    written = [dict.fromkeys(COLUMNS, "") | dict(zip(COLUMNS, row, strict=False)) for row in rows]
    files.write_csv(Path("results/recordings.csv"), COLUMNS, written)
    others = [{"path": path, "reason": reason} for path, reason in passed_over]
    files.write_csv(Path("results/passed_over.csv"), ["path", "reason"], others)


def test_a_run_takes_the_lock_tidies_signs_and_tells_of_keys_without_effect(capsys):
    left = Path(f"results/.table.csv.1{files.UNFINISHED}")
    left.touch()
    without_effect = ["evaluation.bootstrap has no effect any more; remove it"]
    states = {"fit.py": {"a.py": [1, 2, 3, 4]}}
    run_of(without_effect=without_effect, states=states).begin()
    assert not left.exists()
    assert files.read_json(STATES) == states
    # Results that are put back later have another sign.
    assert (RUN_LOCK.parent / SIGN).read_text().split()[0] == Path(
        "results", SIGN
    ).read_text().strip()
    assert RUN_LOCK.read_text().startswith(f"process {os.getpid()} on ")
    assert capsys.readouterr().err.splitlines() == without_effect
    with pytest.raises(CapsuleError, match="another run uses this folder"):
        run_of().begin()


# Another key: as after `snakemake results/templates.npz`.
@pytest.mark.parametrize(("key", "marked"), [(KEY, False), (KEY[::-1], True), (None, None)])
def test_from_its_start_on_the_page_is_marked_until_it_fits_again(capsys, key, marked):
    if key:
        REPORT.write_bytes(PAGE)
    started = run_of()
    started.begin()
    assert bool(key) == (REPORT.exists() and b'<p class="outdated"' in REPORT.read_bytes())
    started.succeed(key or KEY)
    told = {
        False: "The report: results/report.html\n",
        True: f"{REPORT} is out of date; make it again: snakemake -c2 {REPORT}\n",
        None: "",
    }
    assert capsys.readouterr().err == told[marked]
    assert REPORT.exists() == bool(key)
    assert not key or (REPORT.read_bytes() != PAGE) == marked


def test_the_end_of_a_run_lists_what_was_rejected_alike_and_passed_over(capsys):
    surveys = Surveys(["1-gut", "2-gut"], {"3-gut": "not finished"})
    started = run_of(["3mm/r01", "3mm/r02", "3mm/r03"], surveys=surveys, held_out=["spring"])
    write_lists(
        ("3mm/r01", "accepted", "", "3mm/r02"),
        ("3mm/r02", "accepted", "", "3mm/r01"),
        ("3mm/r03", "rejected", "the file is empty"),
        passed_over=[("notes.txt", "not in a folder")],
    )
    files.write_json(Path("results/surveys/1-gut/survey.json"), {"problem": "no track"})
    files.write_json(Path("results/surveys/2-gut/survey.json"), {"name": "2-gut"})
    started.succeed(KEY)
    assert capsys.readouterr().err.splitlines() == [
        "2 recordings accepted, 1 rejected.",
        "  rejected: raw/3mm/r03: the file is empty",
        "  nearly the same as 3mm/r02: raw/3mm/r01",
        "  nearly the same as 3mm/r01: raw/3mm/r02",
        "  evaluation.held_out: no labelled recording names the session 'spring'",
        "  passed over: raw/notes.txt: not in a folder",
        "  survey passed over: sessions/1-gut: cannot be read: no track",
        "  survey passed over: sessions/3-gut: not finished",
    ]


def test_the_end_of_a_run_says_that_the_nodule_follows_from_the_source(capsys):
    names = [f"{size}mm/r{run}" for size in (0, 3) for run in range(4)]
    write_lists(*((name, "accepted", "", "", f"bench {name[0]}") for name in names))
    run_of(names).succeed(KEY)
    told = "among the recordings that teach, whether there is a nodule follows from the source"
    assert capsys.readouterr().err.splitlines()[1:] == [f"  confounded: {told}"]


@pytest.mark.parametrize(
    ("left", "gone"),
    [
        ([f"checks/3mm/r0{run}.json" for run in (1, 2, 3)], "checks/3mm/r02.json"),
        # Tables of an earlier version.
        ([f"evaluation/{name}.csv" for name in ("brier", "auc", "summary", "learning")],
         "evaluation/auc.csv"),
    ],
)  # fmt: skip
def test_results_of_what_is_gone_are_counted(capsys, left, gone):
    for name in left:
        files.write_json(Path("results", name), {})
    run_of().succeed(KEY)
    told = "2 files are of recordings, batches or tables that are gone, and are not used"
    assert capsys.readouterr().err == f"{told}, such as results/{gone}\n"


@pytest.mark.parametrize(
    ("earlier", "now", "wanted", "told"),
    [
        (500, 500, "auto", ""),
        (500, 501, "auto", "501 recordings: each job now takes up to 16 instead of 1, "),
        (501, 500, "auto", "500 recordings: each job now takes up to 1 instead of 16, "),
        (500, 501, 1, ""),
    ],
)
def test_an_archive_that_passes_a_limit_is_told_that_all_is_made_again(
    capsys, earlier, now, wanted, told
):
    write_lists(*((f"3mm/r{run}", "accepted") for run in range(earlier)))
    run_of([f"3mm/r{run}" for run in range(now)], wanted).begin()
    assert capsys.readouterr().err == told + ("so everything is made once more.\n" if told else "")


def test_a_full_disk_stops_a_run_before_its_first_job_and_is_told_at_the_end(monkeypatch, capsys):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage(10**9, 10**9, 300_000))
    at_end = []
    monkeypatch.setattr(atexit, "register", at_end.append)
    REPORT.write_bytes(PAGE)
    with pytest.raises(CapsuleError, match="no space left on device, nothing was started"):
        run_of().begin()
    assert REPORT.read_bytes() == PAGE
    (tell,) = at_end
    tell()
    assert "The disk is full: only 0.3 MB are free." in capsys.readouterr().err


def test_beside_slurms_jobs_of_a_killed_run_no_run_begins(monkeypatch):
    monkeypatch.setattr(run, "unfinished_jobs", lambda folder: ("11", "12"))
    with pytest.raises(CapsuleError, match=r"use this folder \(11, 12\); .*: scancel 11 12$"):
        run_of().begin()


def test_only_jobs_of_snakemake_in_this_folder_count(tmp_path):
    name = "7a07c6ef-c924-48fb-9bf6-6c09dcf75936"
    answer = (
        f"11 {name} {tmp_path}\n12 study_{name} {tmp_path}\n12 study_{name} {tmp_path}\n"
        f"13 {name} {tmp_path}/other\n14 bash {tmp_path}\n15 my own {tmp_path}\n"
    )
    assert run.jobs_in_answer(answer, tmp_path) == ("11", "12")


@pytest.mark.skipif(os.name == "nt", reason="the squeue of this test is a shell script")
def test_a_silent_slurm_is_told_and_does_not_stop_a_run(tmp_path, monkeypatch, capsys):
    squeue = tmp_path / "bin/squeue"
    squeue.parent.mkdir()
    squeue.write_text("#!/bin/sh\necho tried >&2\necho no controller >&2\nexit 1\n")
    squeue.chmod(0o755)
    monkeypatch.setenv("PATH", str(squeue.parent), prepend=os.pathsep)
    assert run.unfinished_jobs(tmp_path) == ()
    assert capsys.readouterr().err == "", "nothing was submitted from this folder"
    (tmp_path / run.LOGS).mkdir(parents=True)
    assert run.unfinished_jobs(tmp_path) == ()
    assert "squeue does not answer (no controller); make sure" in capsys.readouterr().err
