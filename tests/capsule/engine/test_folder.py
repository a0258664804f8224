"""The folder of the runs: what it must allow, which results are known, and the mark of the page."""

import os
import shutil
import time
from pathlib import Path

import pytest

from capsule.engine import run as folder
from capsule.errors import CapsuleError
from capsule.store.files import UNFINISHED


def test_what_killed_writers_left_is_removed_and_dates_in_the_future_become_now(tmp_path):
    left, ahead, past = (tmp_path / name for name in (f".a.123{UNFINISHED}", "ahead", "past"))
    for path, date_s in ((left, 1e9), (ahead, 4e9), (past, 1e9)):
        path.touch()
        os.utime(path, (date_s, date_s))
    (tmp_path / "gone").symlink_to(tmp_path / "none")
    folder.tidy(tmp_path)
    assert not left.exists()
    assert abs(ahead.stat().st_mtime - time.time()) < 60
    assert past.stat().st_mtime == 1e9


def test_a_page_is_marked_as_out_of_date_once_and_is_then_as_before(tmp_path):
    page = tmp_path / "report.html"
    before = b"<head>\n</head>\n<body>\n<p>one</p>\n<pre><body>\n</pre>\n"
    page.write_bytes(before)
    marked = before.replace(b"<body>\n", b"<body>\n" + folder.OUTDATED, 1)
    for outdated, content in ((True, marked), (False, before)):
        folder.mark_outdated(page, outdated=outdated)
        # A mark that is there already does not write the page again.
        os.utime(page, (1, 1))
        folder.mark_outdated(page, outdated=outdated)
        assert (page.read_bytes(), page.stat().st_mtime) == (content, 1)
    folder.mark_outdated(tmp_path / "none.html", outdated=True)
    assert list(tmp_path.iterdir()) == [page]


def test_only_the_head_of_a_page_tells_what_it_was_made_from(tmp_path):
    page, key = tmp_path / "report.html", "0123456789abcdef"
    for before, made_from in ((0, True), (1000, True), (5000, False)):
        page.write_text(" " * before + key)
        assert folder.is_made_from(page, key) == made_from
        assert not folder.is_made_from(page, key[::-1])


def test_results_that_the_last_run_has_not_left_are_refused(tmp_path):
    results, notes = tmp_path / "results", tmp_path / "notes"
    table = results / "recordings.csv"
    for path in (table, notes / "metadata/a"):
        path.parent.mkdir(parents=True)
        path.touch()
    # Results of a version without signs.
    folder.refuse_unknown_results(results, notes)
    for run in ("first", "second"):
        folder.sign_results(results, notes)
        folder.refuse_unknown_results(results, notes)
        for source in (results, notes):
            shutil.copytree(source, tmp_path / run / source.name)
    for one, other in (("first", "second"), ("second", "first")):
        put_back, beside = tmp_path / one / "results", tmp_path / other / "notes"
        (beside / folder.SIGN).write_text(
            (beside / folder.SIGN).read_text().replace(str(results), str(put_back))
        )
        with pytest.raises(CapsuleError, match=f"remove {put_back}/ and run again, or put back"):
            folder.refuse_unknown_results(put_back, beside)
    shutil.rmtree(results)
    folder.refuse_unknown_results(results, notes)


@pytest.mark.parametrize("written", [0, 1, 2])
def test_a_run_that_is_killed_at_its_sign_leaves_results_that_are_known(
    tmp_path, monkeypatch, written
):
    results, notes = tmp_path / "results", tmp_path / "notes"
    (notes / "metadata/a").mkdir(parents=True)
    folder.sign_results(results, notes)
    (results / "recordings.csv").touch()
    left, write = written, folder.write_whole

    def killed(path):
        nonlocal left
        if not left:
            raise KeyboardInterrupt
        left -= 1
        return write(path)

    monkeypatch.setattr(folder, "write_whole", killed)
    with pytest.raises(KeyboardInterrupt):
        folder.sign_results(results, notes)
    folder.refuse_unknown_results(results, notes)


@pytest.mark.parametrize(
    ("results", "notes", "refused"),
    [
        ([], [], False),
        (["logs/list.log"], [], False),
        (["recordings.csv"], ["metadata/a"], False),
        (["recordings.csv"], ["incomplete/a"], False),
        (["recordings.csv"], [], True),
        # A run that has just begun.
        (["checks/3mm/"], [], False),
        (["checks/3mm/r01.json"], [], True),
        (["recordings.csv"], ["log/a", "metadata/"], True),
    ],
)
def test_results_without_snakemakes_notes_on_them_are_refused(tmp_path, results, notes, refused):
    for name in (*(f"results/{each}" for each in results), *(f"notes/{each}" for each in notes)):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).mkdir() if name.endswith("/") else (tmp_path / name).touch()
    if refused:
        with pytest.raises(CapsuleError, match=r"remove .*results/ and run again"):
            folder.refuse_unknown_results(tmp_path / "results", tmp_path / "notes")
    else:
        folder.refuse_unknown_results(tmp_path / "results", tmp_path / "notes")


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (CapsuleError("say why"), "say why"),
        # Results that another user may not read.
        (PermissionError(13, "Permission denied", "results"), "error: results: Permission denied"),
    ],
)
def test_an_error_of_the_input_or_of_the_disk_is_one_line_of_snakemakes_own(error, told):
    with pytest.raises(KeyError) as caught, folder.told_as(KeyError):
        raise error
    assert caught.value.args == (told,)
    assert caught.value.__suppress_context__


def test_a_folder_with_braces_in_its_name_is_refused(tmp_path):
    (tmp_path / "{run}").mkdir()
    folder.refuse_folders(tmp_path, tmp_path)
    with pytest.raises(CapsuleError, match=r"/\{run\}: rename this folder"):
        folder.refuse_folders(tmp_path, tmp_path / "{run}")


# Permissions do not bind the administrator, who runs some of these tests.
@pytest.mark.parametrize(
    "name", ["", ".snakemake", ".snakemake/metadata", ".snakemake/iocache/latest.pkl"]
)
def test_what_cannot_be_written_is_named_with_the_way_out(tmp_path, monkeypatch, name):
    path = tmp_path / name
    path.mkdir(parents=True, exist_ok=True)
    monkeypatch.setattr(os, "access", lambda each, mode: each != path or mode != os.W_OK)
    with pytest.raises(CapsuleError, match=r"cannot be written, .*capsule new NAME") as caught:
        folder.refuse_folders(Path("/"), tmp_path)
    assert str(caught.value).startswith(f"{path} cannot")
