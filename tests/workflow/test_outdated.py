"""The same call of snakemake makes results again that do not fit their inputs."""

import os
import time

import pytest

from support.marks import needs_process_groups
from support.mishaps import TABLES, FreshResults, create_project, deal, try_sequence

pytestmark = [
    pytest.mark.slow,
    pytest.mark.workflow,
    needs_process_groups,
]


@pytest.fixture(scope="module")
def finished(tmp_path_factory, preloaded_snakemake):
    """Return a project after one run; tests copy it and do not change it."""
    folder = tmp_path_factory.mktemp("finished") / "project"
    return create_project(folder, preloaded_snakemake)


@pytest.fixture
def project(finished, tmp_path):
    return finished.copy(tmp_path / "project")


@pytest.mark.takes(25)
def test_after_any_mishaps_the_results_are_those_of_a_fresh_run(finished, tmp_path):
    """Each kind of mishap happens; `try_mishaps.py` tries hundreds of sequences by hand."""
    # Of a few states, since each costs a fresh run.
    fresh = FreshResults(finished, editions=3, settings=2, sizes=[1, 100])
    for number, mishaps in enumerate(deal(seed=1, size=3)):
        told, fault = try_sequence(fresh, tmp_path / f"sequence-{number}", number, mishaps)
        assert not fault, (number, told, fault)


def test_a_failed_job_leaves_nothing_that_counts_as_done(project, finished):
    recording = project.raw / "3mm/r02.csv"
    recording.write_bytes((project.raw / "3mm/r01.csv").read_bytes()[:-40])
    script = project.folder / "workflow/scripts/preprocess.py"
    whole = script.read_text(encoding="utf-8")
    failing = whole.replace(
        "def main() -> None:\n", "def main() -> None:\n    raise SystemExit(1)\n"
    )
    times = script.stat()
    script.write_text(failing, encoding="utf-8")
    assert project.snakemake(*TABLES).status != 0
    script.write_text(whole, encoding="utf-8")
    os.utime(script, ns=(times.st_atime_ns, times.st_mtime_ns))
    run = project.snakemake(*TABLES)
    assert run.status == 0, run.output
    assert run.jobs["fit"] and run.jobs["evaluate"] and run.jobs["detect"]
    before, after = finished.result_bytes(), project.result_bytes()
    assert after["fits/3mm/r02.json"] != before["fits/3mm/r02.json"]


def test_a_run_for_some_results_makes_what_they_need_again(project, finished):
    matrix = project.results / "matrices/3mm/r02.npy"
    matrix.unlink()
    assert project.snakemake(*TABLES).did_nothing
    project.configure(evaluation={"tolerance_mm": 2.0})
    run = project.snakemake(*TABLES)
    assert run.status == 0, run.output
    assert matrix.read_bytes() == (finished.results / "matrices/3mm/r02.npy").read_bytes()


def test_a_recording_dated_ahead_is_taken_as_it_is(project):
    recording = project.raw / "3mm/r02.csv"
    recording.write_bytes((project.raw / "3mm/r01.csv").read_bytes()[:-40])
    ahead = time.time() + 600
    os.utime(recording, (ahead, ahead))
    run = project.snakemake(*TABLES)
    assert run.status == 0, run.output
    assert (run.jobs["preprocess"], run.jobs["fit"], run.jobs["evaluate"]) == (1, 1, 1)
    assert project.snakemake(*TABLES).did_nothing


def test_a_report_whose_successor_fails_says_that_it_is_out_of_date(project):
    report = project.results / "report.html"
    report.write_text("<html><body>\nthe old report</body></html>", encoding="utf-8")
    (project.raw / "3mm/r02.csv").write_bytes(b"")
    project.configure(on_rejected="fail")
    assert project.snakemake().status != 0
    assert '<p class="outdated" role="alert">This report is out of date' in report.read_text(
        "utf-8"
    )
