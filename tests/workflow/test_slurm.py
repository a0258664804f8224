"""The workflow gives the same bytes on a Slurm cluster as on this computer, also after mishaps."""

import importlib.util
import os
import re
import signal

import numpy as np
import pytest
import yaml

from capsule.engine import run as workflow_run
from capsule.store.results import Results
from support import slurm
from support.marks import needs
from support.project import ROOT, Project

pytestmark = pytest.mark.slow

RECORDINGS = ["0mm/r01", "1mm/r01", "1mm/r02"]
# The last steps that a cluster could change; all after them run beside Snakemake.
TABLES = ["results/templates.npz", "results/recordings.csv"]
FITS = ["results/fits/1mm/r01.json", "results/fits/1mm/r02.json"]
THROUGH_SLURM = ["--profile=profiles/slurm", *slurm.WITHOUT_ACCOUNTING]
# A Slurm job for each recording, so that a test can stop one of two.
ONE_BY_ONE = [*THROUGH_SLURM, "--config", "recordings_per_job=1"]

needs_slurm = [
    pytest.mark.workflow,
    pytest.mark.waits,
    needs(slurm.missing_reason()),
    pytest.mark.skipif(
        importlib.util.find_spec("snakemake_executor_plugin_slurm") is None,
        reason="snakemake-executor-plugin-slurm is not installed",
    ),
]


def on_cluster(seconds):
    """Return a decorator that marks a test with what it needs and with its processor time."""

    def mark(test):
        for each in [*needs_slurm, pytest.mark.takes(seconds)]:
            test = each(test)
        return test

    return mark


@pytest.fixture(scope="module")
def started_cluster(tmp_path_factory):
    """Return a cluster of one node with four processors."""
    with slurm.SingleNodeSlurm(tmp_path_factory.mktemp("cluster") / "slurm", slots=4) as cluster:
        yield cluster


@pytest.fixture
def cluster(started_cluster, monkeypatch):
    """Return the cluster, which the calls of this test find; its jobs end with the test."""
    for name, value in started_cluster.environment.items():
        monkeypatch.setenv(name, value)
    yield started_cluster
    started_cluster.end_jobs()


@pytest.fixture(scope="module")
def new(tmp_path_factory):
    """Return a project with recordings and without results."""
    folder = tmp_path_factory.mktemp("new") / "project"
    return Project.create(folder, RECORDINGS, particles=20, iterations=20)


@pytest.fixture(scope="module")
def local(new, tmp_path_factory):
    """Return the project after a run on this computer."""
    project = new.copy(tmp_path_factory.mktemp("local") / "project")
    run = project.snakemake(*TABLES)
    assert run.status == 0, run.output
    return project


@pytest.fixture
def before_fits(local, tmp_path):
    """Return the project after a run, with the fits still to make."""
    project = local.copy(tmp_path / "project")
    for name in FITS:
        (project.folder / name).unlink()
    return project


def start_fits(project, *arguments):
    """Start a run that makes each fit in a Slurm job of its own."""
    return project.start(*ONE_BY_ONE, *arguments, "--", *FITS)


def assert_same_fits(project, local):
    """Assert that the fits are those of the local run."""
    for name in FITS:
        assert (project.folder / name).read_bytes() == (local.folder / name).read_bytes()


@on_cluster(25)
def test_slurm_gives_the_same_results_in_few_jobs(cluster, new, local, tmp_path):
    remote = new.copy(tmp_path / "remote")
    run = remote.snakemake(*THROUGH_SLURM, "--", *TABLES)
    assert run.status == 0, run.output
    for name in ("templates.npz", "templates.json"):
        assert (remote.results / name).read_bytes() == (local.results / name).read_bytes()
    ours, theirs = (
        Results.of_table(each.results, each.results / "recordings.csv") for each in (remote, local)
    )
    for name in RECORDINGS:
        np.testing.assert_array_equal(ours.signal(name), theirs.signal(name))
        np.testing.assert_array_equal(ours.matrix(name), theirs.matrix(name))
    assert ours.checks(RECORDINGS) == theirs.checks(RECORDINGS)
    assert ours.fits(RECORDINGS[1:]) == theirs.fits(RECORDINGS[1:])
    # A job for each folder's batch of recordings, and one for the fits of the nodules.
    assert run.output.count("has been submitted with SLURM jobid") == 3


@on_cluster(12)
def test_after_a_killed_run_the_next_names_the_jobs_that_slurm_still_runs(
    cluster, before_fits, local
):
    node = f"NodeName={cluster.node}"
    cluster.update(node, "State=DRAIN", "Reason=test")
    with start_fits(before_fits) as killed:
        cluster.wait_for(lambda: len(cluster.jobs("PENDING")) == 2, "two jobs")
        running, queued = cluster.jobs()
        cluster.ask("scontrol", "hold", queued)
        cluster.update(node, "State=RESUME")
        # It would end before the next run looks.
        for process in cluster.processes(running):
            os.kill(process, signal.SIGSTOP)
        killed.kill()
    for _ in range(2):
        refused = before_fits.snakemake(*ONE_BY_ONE, "--", *FITS)
        assert refused.status != 0
        assert f"still use this folder ({running}, {queued})" in refused.output
    remedy = re.search(r"scancel [\d ]*\d", refused.output)
    cluster.ask(*remedy[0].split())
    cluster.wait_for(lambda: not cluster.jobs(), "the end of the jobs")

    # The controller of Slurm goes down and comes back while the jobs run.
    with start_fits(before_fits) as resumed:
        cluster.wait_for(lambda: len(cluster.steps()) == 2, "the steps of two jobs")
        cluster.kill_controller()
        cluster.start_controller()
        output = resumed.stdout.read()
    assert resumed.returncode == 0, output
    assert_same_fits(before_fits, local)


@on_cluster(12)
def test_a_job_over_its_time_limit_is_named_with_the_remedy(cluster, before_fits, local):
    with start_fits(before_fits) as limited:
        cluster.wait_for(lambda: len(cluster.jobs("RUNNING")) == 2, "two running jobs")
        late, early = cluster.jobs()
        for process in cluster.processes(late):
            os.kill(process, signal.SIGSTOP)
        cluster.update(f"JobId={late}", "EndTime=now")
        output = limited.stdout.read()
    assert limited.returncode != 0
    assert cluster.jobs("TIMEOUT") == [late]
    assert cluster.jobs("COMPLETED")[-1] == early
    assert f"SLURM-job '{late}' failed, SLURM status is: 'TIMEOUT'" in output
    assert sum((before_fits.folder / name).exists() for name in FITS) == 1

    page = (ROOT / "docs/workflow.md").read_text(encoding="utf-8")
    option, *values = re.search(r"--default-resources [\w= ]*runtime=120", page)[0].split()
    again = before_fits.snakemake(*ONE_BY_ONE, option, *values, "--", *FITS)
    assert again.status == 0, again.output
    assert again.jobs == {"fit": 1}
    assert "TimeLimit=02:00:00" in cluster.ask("scontrol", "show", "job", cluster.jobs("CD")[-1])
    assert_same_fits(before_fits, local)


@on_cluster(10)
def test_slurm_starts_the_jobs_of_a_lost_node_again(cluster, before_fits, local):
    with start_fits(before_fits) as run:
        cluster.wait_for(lambda: len(cluster.jobs("RUNNING")) == 2, "two running jobs")
        jobs = cluster.jobs()
        cluster.lose_node()
        cluster.wait_for(lambda: cluster.jobs("PENDING") == jobs, "the jobs in the queue")
        cluster.return_node()
        output = run.stdout.read()
    assert run.returncode == 0, output
    assert cluster.jobs("COMPLETED")[-2:] == jobs
    assert_same_fits(before_fits, local)


def test_only_jobs_of_snakemake_in_this_folder_count(tmp_path):
    run = "7a07c6ef-c924-48fb-9bf6-6c09dcf75936"
    answer = (
        f"11 {run} {tmp_path}\n12 study_{run} {tmp_path}\n12 study_{run} {tmp_path}\n"
        f"13 {run} {tmp_path}/other\n14 bash {tmp_path}\n15 my own {tmp_path}\n"
    )
    assert workflow_run.jobs_in_answer(answer, tmp_path) == ("11", "12")


def test_the_profile_takes_batches_and_every_other_step_runs_beside_snakemake():
    profile = yaml.safe_load((ROOT / "profiles/slurm/config.yaml").read_text(encoding="utf-8"))
    files = {path.name: path.read_text() for path in (ROOT / "workflow/rules").glob("*.smk")}
    named = r"^(?:use )?rule (?:\w+ as )?(\w+)"
    rules = set(re.findall(named, "".join(files.values()), re.MULTILINE))
    assert profile["config"] == ["recordings_per_job=400"]
    listed = re.search(r"localrules:\n((?: +\w+,\n)+)", files["run.smk"])[1]
    beside = set(re.findall(r"\w+", listed))
    assert rules - beside == {"preprocess", "fit"}
    assert beside <= rules


@pytest.mark.skipif(os.name == "nt", reason="the squeue of this test is a shell script")
def test_a_silent_slurm_is_told_and_does_not_stop_a_run(tmp_path, monkeypatch, capsys):
    programs = tmp_path / "bin"
    programs.mkdir()
    (programs / "squeue").write_text("#!/bin/sh\necho tried >&2\necho no controller >&2\nexit 1\n")
    (programs / "squeue").chmod(0o755)
    monkeypatch.setenv("PATH", str(programs), prepend=os.pathsep)
    assert workflow_run.unfinished_jobs(tmp_path) == ()
    assert capsys.readouterr().err == "", "nothing was submitted from this folder"
    submitted = tmp_path / "project"
    (submitted / workflow_run.LOGS).mkdir(parents=True)
    assert workflow_run.unfinished_jobs(submitted) == ()
    assert "squeue does not answer (no controller); make sure" in capsys.readouterr().err
