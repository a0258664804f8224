"""Records name the files that a result was made from, and show when it does not fit."""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

from capsule.files import read_limited, read_whole
from edges import records
from support.project import ROOT

OUTPUT = "results/fits/3mm/r01.json"
SCRIPT = """
import sys
sys.path.insert(0, {scripts!r})
from pathlib import Path
from capsule import files

def main():
    text = Path("results/matrices/a").read_text()
    with files.write_whole(Path({output!r})) as stream:
        stream.write(text.upper())

files.run(main)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    source = Path("results/matrices/a")
    source.parent.mkdir(parents=True)
    source.write_text("wave")
    return tmp_path


def run_job(key=f"{OUTPUT}:key"):
    """Run a script as a rule does."""
    code = SCRIPT.format(scripts=str(ROOT / "workflow/scripts"), output=OUTPUT)
    command = [sys.executable, "-c", code, "--record", key]
    return subprocess.run(command, check=True, capture_output=True, text=True)


def told(key=f"{OUTPUT}:key", renew=True):
    """Return the parameter that a new call of snakemake gets."""
    records.parameter.cache_clear()
    records.CHECKSUMS.forget()
    return records.parameter(key, (OUTPUT,), renew=renew)


def sha256(text):
    return hashlib.sha256(text.encode()).hexdigest()


def test_a_job_records_what_it_has_read_and_written(folder):
    run_job()
    assert json.loads(records.record_path(OUTPUT).read_text()) == {
        "format": records.FORMAT,
        "made_from": f"{OUTPUT}:key",
        "read": {"results/matrices/a": sha256("wave")},
        "written": {OUTPUT: sha256("WAVE")},
    }


def test_a_result_that_fits_and_one_that_was_never_made_keep_their_parameter(folder):
    assert told() == f"{OUTPUT}:key"
    run_job()
    assert told() == f"{OUTPUT}:key"


@pytest.mark.parametrize("damaged", ["results/matrices/a", OUTPUT, "record"])
@pytest.mark.parametrize("damage", ["missing", "another content"])
def test_what_does_not_fit_gets_another_parameter_and_an_old_time_stamp(folder, damaged, damage):
    run_job()
    path = records.record_path(OUTPUT) if damaged == "record" else Path(damaged)
    path.unlink() if damage == "missing" else path.write_text("{}")
    again = told()
    assert again.startswith(f"{OUTPUT}:key-")
    assert not Path(OUTPUT).exists() or Path(OUTPUT).stat().st_mtime == 1
    # Until it is made again, and then it fits.
    Path("results/matrices/a").write_text("wave")
    run_job(again)
    assert told() == again


def test_another_key_does_not_fit(folder):
    run_job(f"{OUTPUT}:another")
    assert told().startswith(f"{OUTPUT}:key-")


def test_the_jobs_of_a_cluster_and_calls_beside_a_run_change_nothing(folder):
    run_job()
    Path(OUTPUT).write_text("damaged")
    assert told(renew=False) == f"{OUTPUT}:key"
    assert not list(Path("results/records").rglob("*.again"))


def read_with_a_stream(path):
    return path.read_bytes()


@pytest.mark.parametrize("read", [read_with_a_stream, read_whole])
def test_however_a_file_is_read_its_checksum_is_recorded(folder, read):
    record = records.Record(f"{OUTPUT}:key")
    with record.watch():
        assert read(Path("results/matrices/a")) == b"wave"
        with pytest.raises(FileNotFoundError, match="missing"):
            read(Path("results/missing"))
    assert record.read == {"results/matrices/a": sha256("wave"), "results/missing": None}


def test_a_file_above_the_limit_is_recorded_though_it_is_not_read(folder):
    record = records.Record(f"{OUTPUT}:key")
    with record.watch():
        assert read_limited("results/matrices/a", 3) is None
    assert record.read == {"results/matrices/a": sha256("wave")}


def test_a_job_that_fails_leaves_no_record(folder):
    run_job()
    Path("results/matrices/a").unlink()
    with pytest.raises(subprocess.CalledProcessError):
        run_job()
    assert not records.record_path(OUTPUT).exists()


def test_all_that_a_result_rests_on_is_followed(folder):
    run_job()
    assert records.files_that_do_not_fit(OUTPUT) == []
    Path("results/matrices/a").write_text("another")
    assert records.files_that_do_not_fit(OUTPUT) == ["results/matrices/a"]


@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("raw/3mm/r01.csv", "raw/3mm/r01.csv"),
        ("workflow/weights/scorer.npz", "workflow/weights/scorer.npz"),
        ("workflow/scripts/fit.py", None),
        ("results/logs/fit.log", None),
        ("results/records/a.json", None),
        ("./results/../raw/3mm/r01.csv", "raw/3mm/r01.csv"),
        ("raw//3mm/r01.csv", "raw/3mm/r01.csv"),
        ("../raw/3mm/r01.csv", None),
        ("/etc/hosts", None),
        (3, None),
    ],
)
def test_recordings_results_and_what_ships_are_followed(folder, path, name):
    assert records.followed(path) == name
