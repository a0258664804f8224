"""Start and end of a run: what the terminal says, and when the page is marked as out of date."""

import atexit
import os
import shutil
from collections import namedtuple
from pathlib import Path

import pytest

from capsule.engine import run
from capsule.engine.locks import RUN_LOCK, hold_run_lock
from capsule.errors import CapsuleError
from capsule.store import files
from capsule.store.batches import batch_size, batches, described_together
from capsule.survey.listed import Surveys

KEY = "0123456789" * 2
PAGE = f'<head>\n<meta name="made-from" content="{KEY}">\n</head>\n<body>\n<p>page</p>\n'.encode()
MARK = b'<p class="outdated"'
COLUMNS = ["recording", "status", "reason", "near_copies"]


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
    return tmp_path


def run_of(names=("3mm/r01",), wanted="auto", surveys=None, held_out=(), without_effect=()):
    """Return a run with these recordings."""
    config = {"recordings_per_job": wanted, "evaluation": {"held_out": held_out}}
    size = batch_size(len(names), wanted)
    divided = batches(names, size), described_together(names, size)
    surveys = surveys or Surveys([], {})
    more = {"without_effect": without_effect}
    return run.Run("raw", "results", "sessions", config, size, *divided, surveys, **more)


def write_lists(*rows, passed_over=()):
    """Write the list of the recordings, and that of the other files."""
    written = [dict(zip(COLUMNS, row, strict=True)) for row in rows]
    files.write_csv(Path("results/recordings.csv"), COLUMNS, written)
    others = [{"path": path, "reason": reason} for path, reason in passed_over]
    files.write_csv(Path("results/passed_over.csv"), ["path", "reason"], others)


def test_a_run_takes_the_lock_and_removes_unfinished_files(capsys):
    left = Path(f"results/.table.csv.1{files.UNFINISHED}")
    left.touch()
    run_of().begin()
    assert not left.exists()
    assert RUN_LOCK.read_text().startswith(f"process {os.getpid()} on ")
    assert capsys.readouterr().err == ""


def test_a_second_run_of_the_folder_does_not_begin():
    first, second = run_of(), run_of()
    first.begin()
    with pytest.raises(CapsuleError, match="another run uses this folder"):
        second.begin()


def test_from_its_start_on_the_page_is_marked_until_it_fits_again(capsys):
    page = Path("results/report.html")
    page.write_bytes(PAGE)
    started = run_of()
    started.begin()
    assert MARK in page.read_bytes()
    started.succeed(KEY)
    assert page.read_bytes() == PAGE
    assert capsys.readouterr().err == "The report: results/report.html\n"


def test_a_page_that_was_made_from_something_else_stays_marked(capsys):
    page = Path("results/report.html")
    page.write_bytes(PAGE)
    started = run_of()
    started.begin()
    # As after `snakemake results/templates.npz`.
    started.succeed(KEY[::-1])
    assert MARK in page.read_bytes()
    told = "results/report.html is out of date; make it again: snakemake -c2 results/report.html\n"
    assert capsys.readouterr().err == told


def test_without_a_page_nothing_is_marked_and_nothing_told(capsys):
    started = run_of()
    started.begin()
    started.succeed(KEY)
    assert capsys.readouterr().err == ""
    assert list(Path("results").iterdir()) == [Path("results/run.txt")]


def test_the_end_of_a_run_lists_what_was_rejected_alike_and_passed_over(capsys):
    surveys = Surveys(["1-gut", "2-gut"], {"3-gut": "not finished"})
    started = run_of(["3mm/r01", "3mm/r02", "3mm/r03"], surveys=surveys)
    write_lists(
        ("3mm/r01", "accepted", "", "3mm/r02"),
        ("3mm/r02", "accepted", "", "3mm/r01"),
        ("3mm/r03", "rejected", "the file is empty", ""),
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
        "  passed over: raw/notes.txt: not in a folder",
        "  survey passed over: sessions/1-gut: cannot be read: no track",
        "  survey passed over: sessions/3-gut: not finished",
    ]


def test_the_end_of_a_run_says_that_the_nodule_follows_from_the_source(capsys):
    names = [f"{size}mm/r{run}" for size in (0, 3) for run in range(4)]
    sources = {name: "finger on fabric" if name.startswith("0") else "phantom" for name in names}
    rows = [{"recording": name, "status": "accepted", "source": sources[name]} for name in names]
    table = Path("results/recordings.csv")
    files.write_csv(table, [*COLUMNS, "source"], [dict.fromkeys(COLUMNS, "") | row for row in rows])
    files.write_csv(Path("results/passed_over.csv"), ["path", "reason"], [])
    run_of(names).succeed(KEY)
    assert capsys.readouterr().err.splitlines() == [
        "8 recordings accepted, 0 rejected.",
        "  confounded: among the recordings that teach, whether there is a nodule follows from the "
        "source",
    ]


def test_results_of_recordings_that_are_gone_are_counted(capsys):
    for name in ("r01", "r02", "r03"):
        files.write_json(Path(f"results/checks/3mm/{name}.json"), {})
    run_of(["3mm/r01"]).succeed(KEY)
    assert capsys.readouterr().err == (
        "2 files are of recordings, batches or tables that are gone, and are not used, such as "
        "results/checks/3mm/r02.json\n"
    )


def test_tables_that_an_earlier_version_has_left_are_counted(capsys):
    for name in ("brier", "auc", "summary", "predictions", "learning"):
        files.write_csv(Path(f"results/evaluation/{name}.csv"), ["detector"], [])
    run_of([]).succeed(KEY)
    assert capsys.readouterr().err == (
        "2 files are of recordings, batches or tables that are gone, and are not used, such as "
        "results/evaluation/auc.csv\n"
    )


@pytest.mark.parametrize(
    ("earlier", "now", "wanted", "told"),
    [
        (500, 500, "auto", False),
        (500, 501, "auto", True),
        (501, 500, "auto", True),
        (500, 501, 1, False),
    ],
)
def test_an_archive_that_passes_a_limit_is_told_that_all_is_made_again(
    capsys, earlier, now, wanted, told
):
    write_lists(*((f"3mm/r{run}", "accepted", "", "") for run in range(earlier)))
    run_of([f"3mm/r{run}" for run in range(now)], wanted).begin()
    line = (
        f"{now} recordings: each job now takes up to {batch_size(now, 'auto')} instead of "
        f"{batch_size(earlier, 'auto')}, so everything is made once more.\n"
    )
    assert capsys.readouterr().err == (line if told else "")


def test_a_full_disk_stops_a_run_before_its_first_job_and_is_told_at_the_end(monkeypatch, capsys):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage(10**9, 10**9, 300_000))
    at_end = []
    monkeypatch.setattr(atexit, "register", at_end.append)
    page = Path("results/report.html")
    page.write_bytes(PAGE)
    with pytest.raises(CapsuleError, match="no space left on device, nothing was started"):
        run_of().begin()
    assert page.read_bytes() == PAGE
    (tell,) = at_end
    tell()
    assert capsys.readouterr().err == (
        "The disk is full: only 0.3 MB are free. Free some space and run the same command again: "
        "finished results are kept.\n"
    )


def test_a_held_out_session_that_no_recording_names_is_told_at_the_end(capsys):
    write_lists(("3mm/r01", "accepted", "", ""))
    run_of(held_out=["spring"]).succeed("key")
    told = "  evaluation.held_out: no labelled recording names the session 'spring'"
    assert told in capsys.readouterr().err.splitlines()
    run_of().succeed("key")
    assert "held_out" not in capsys.readouterr().err


def test_a_key_without_effect_is_told_at_the_start(capsys):
    run_of(without_effect=["evaluation.bootstrap has no effect any more; remove it"]).begin()
    told = capsys.readouterr().err.splitlines()
    assert told == ["evaluation.bootstrap has no effect any more; remove it"]
