"""The file of a set: its job makes what does not fit, and the main process can replace the job."""

import hashlib
import os
import sys
from functools import partial
from pathlib import Path

import pytest
from edges.recording_files import reasons_to_make
from edges.set_files import (
    forget_notes,
    forget_recordings,
    leave_other_sets,
    stand_in,
    take_over,
)
from edges.set_jobs import make_set

from capsule import files, records

RESULTS = Path("results")
FIT = "results/fits/3mm/r01.json"
SET_FILE = "results/sets/2/fit/3mm/set.sha256"


def sha256(text):
    return hashlib.sha256(text.encode()).hexdigest()


@pytest.fixture
def recording(tmp_path, monkeypatch):
    """Return the only recording of an archive."""
    monkeypatch.chdir(tmp_path)
    path = Path("raw/3mm/r01.csv")
    path.parent.mkdir(parents=True)
    path.write_text("wave")
    return path


def make(made, raw, results, name, settings):
    """Make a "fit" that is the recording in capital letters."""
    made.append(name)
    print(f"{name}: fitted")
    with files.write_whole(results / "fits" / f"{name}.json") as stream:
        stream.write((raw / f"{name}.csv").read_text().upper())


def run_job(monkeypatch, key="key"):
    """Run the job of a set in this process; return the recordings it made, and its record."""
    records.CHECKSUMS.forget()
    command = ["fit_set.py", "3mm/r01", "--raw", "raw", "--results", "results", "--settings", "{}"]
    monkeypatch.setattr(sys, "argv", [*command, "--key", key, "--output", SET_FILE])
    made = []
    job = partial(make_set, "fit", partial(make, made), "")
    return made, files.make_recorded(f"{SET_FILE}:{key}", job)


def reasons(key="key"):
    """Return what another call of snakemake finds."""
    records.CHECKSUMS.forget()
    return reasons_to_make(RESULTS, "fit", key, ["3mm/r01"])


def test_a_job_records_the_files_of_its_recordings_and_writes_a_log_for_each(
    recording, monkeypatch
):
    made, job = run_job(monkeypatch)
    assert made == ["3mm/r01"]
    assert job.read == {"raw/3mm/r01.csv": sha256("wave"), FIT: sha256("WAVE")}
    assert Path(SET_FILE).read_text() == f"{sha256('WAVE')}  fits/3mm/r01.json\n"
    assert list(job.written) == [SET_FILE]
    log = Path("results/logs/fit/3mm/r01.log").read_text()
    assert log.startswith("3mm/r01: fitted\nfinished in ")


def test_what_is_up_to_date_is_not_made_again_but_recorded_all_the_same(recording, monkeypatch):
    _, first = run_job(monkeypatch)
    assert run_job(monkeypatch) == ([], first)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ("content", "raw/3mm/r01.csv has changed"),
        ("result", f"{FIT} has changed"),
        ("lost result", "its results are missing"),
        ("lost record", "the record of its results is missing"),
        ("key", "its settings or the code have changed"),
    ],
)
def test_what_does_not_fit_is_made_again(recording, monkeypatch, change, reason):
    run_job(monkeypatch)
    assert reasons() == {}
    if change == "content":
        recording.write_text("another")
    elif change == "result":
        Path(FIT).write_text("damaged")
    elif change == "lost result":
        Path(FIT).unlink()
    elif change == "lost record":
        forget_recordings(RESULTS, "fit", ["3mm/r01"])
    key = "another" if change == "key" else "key"
    assert reasons(key) == {"3mm/r01": reason}
    made, job = run_job(monkeypatch, key)
    assert made == ["3mm/r01"]
    assert job.read[FIT] == sha256(recording.read_text().upper())


def test_a_failed_recording_has_its_error_in_its_log_and_no_record(recording, monkeypatch):
    recording.unlink()
    with pytest.raises(FileNotFoundError):
        run_job(monkeypatch)
    log = Path("results/logs/fit/3mm/r01.log").read_text()
    assert "error: raw/3mm/r01.csv: No such file" in log
    assert not records.record_path(FIT).exists()
    assert not Path(SET_FILE).exists()


def test_a_set_without_changes_is_taken_over_as_its_job_would_leave_it(recording, monkeypatch):
    run_job(monkeypatch)
    paths = [Path(SET_FILE), records.record_path(SET_FILE)]
    left = [path.read_bytes() for path in paths]
    for path in paths:
        path.unlink()
    os.utime(FIT, (1000, 1000))
    take_over(Path(SET_FILE), f"{SET_FILE}:key", RESULTS, "fit", ["3mm/r01"])
    assert [path.read_bytes() for path in paths] == left
    assert Path(SET_FILE).stat().st_mtime == 1000


def test_an_empty_file_stands_in_for_a_set_only_if_there_are_results(recording, monkeypatch):
    path = Path(SET_FILE)
    stand_in(path, RESULTS)
    assert not path.exists()
    run_job(monkeypatch)
    content = path.read_text()
    stand_in(path, RESULTS)
    assert path.read_text() == content
    path.unlink()
    stand_in(path, RESULTS)
    assert path.read_text() == ""
    records.CHECKSUMS.forget()
    assert records.reason_to_make(f"{SET_FILE}:key", [SET_FILE]) == f"{SET_FILE} has changed"


@pytest.mark.parametrize(("most", "kept"), [(2, True), (3, False), (1, False)])
def test_sets_of_another_size_are_removed_and_snakemakes_notes_with_them(
    recording, monkeypatch, most, kept
):
    run_job(monkeypatch)
    forgotten = []
    leave_other_sets(RESULTS, most)
    forget_notes(RESULTS, forgotten.append)
    assert Path(SET_FILE).exists() == kept
    assert (FIT in forgotten) == (not kept)
    assert not any("records" in path or "logs" in path for path in forgotten)
    forgotten.clear()
    forget_notes(RESULTS, forgotten.append)
    assert forgotten == []
    assert (RESULTS / "sets").exists() == (most > 1)
