"""The workflow gives the same bytes on a Slurm cluster as on this computer, also after mishaps."""

import importlib.util
import os
import re
import secrets
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from capsule.store.results import Results
from support.marks import needs
from support.project import Project

PROGRAMS = ["munged", "slurmctld", "slurmd", "sbatch", "srun"]
PROGRAMS += ["sinfo", "squeue", "scontrol", "scancel", "sdiag"]
# This cluster has no accounting, and it answers at once.
WITHOUT_ACCOUNTING = [
    "--slurm-status-command=squeue",
    "--slurm-no-account",
    "--slurm-init-seconds-before-status-checks=1",
    "--seconds-between-status-checks=1",
    "--max-status-checks-per-second=10",
    "--latency-wait=5",
]
RECORDINGS = ["0mm/r01", "1mm/r01", "1mm/r02"]
# The last steps that a cluster could change; all after them run beside Snakemake.
TABLES = ["results/templates.npz", "results/recordings.csv"]
FITS = ["results/fits/1mm/r01.json", "results/fits/1mm/r02.json"]
THROUGH_SLURM = ["--profile=profiles/slurm", *WITHOUT_ACCOUNTING]
# A Slurm job for each recording, so that a test can stop one of two.
ONE_BY_ONE = [*THROUGH_SLURM, "--config", "recordings_per_job=1"]


def _find(name: str) -> str | None:
    return shutil.which(name, path=os.pathsep.join([*os.get_exec_path(), "/usr/sbin"]))


MISSING = [name for name in PROGRAMS if not _find(name)]
pytestmark = [
    pytest.mark.slow,
    pytest.mark.workflow,
    pytest.mark.waits,
    pytest.mark.takes(18),
    needs(f"not installed (slurm-wlm, munge): {', '.join(MISSING)}" if MISSING else ""),
    needs("slurmd must run as root" if os.geteuid() != 0 else ""),
    pytest.mark.skipif(
        importlib.util.find_spec("snakemake_executor_plugin_slurm") is None,
        reason="snakemake-executor-plugin-slurm is not installed",
    ),
]


class SingleNodeSlurm:
    """A Slurm cluster in a folder: munged, slurmctld and slurmd, which are stopped at the end."""

    def __init__(self, folder: Path, slots: int) -> None:
        self.folder, self.slots = folder, slots
        self.node = socket.gethostname().split(".")[0]
        path = os.pathsep.join([str(folder / "bin"), *os.get_exec_path()])
        # With these, a client finds this cluster.
        self.environment = {"SLURM_CONF": str(folder / "slurm.conf"), "PATH": path}
        self._daemons: list[subprocess.Popen] = []

    def __enter__(self) -> "SingleNodeSlurm":
        self.folder.mkdir(parents=True)
        # munged requires that no other user can write to its folder or to a folder above it.
        socket_path = self.folder / "munge.socket"
        key = self.folder / "munge.key"
        key.write_bytes(secrets.token_bytes(1024))
        key.chmod(0o400)
        ports = _free_ports(2)
        (self.folder / "slurm.conf").write_text(self._configuration(socket_path, ports))
        self._wrap_srun()
        self._start(
            "munged", "--foreground", "--force", f"--key-file={key}", f"--socket={socket_path}",
            f"--pid-file={self.folder}/munged.pid", f"--log-file={self.folder}/munged.log",
            f"--seed-file={self.folder}/munged.seed",
        )  # fmt: skip
        self.wait_for(socket_path.exists, "munged")
        for daemon in ("slurmctld", "slurmd"):
            self._start(daemon, "-D", "-f", str(self.folder / "slurm.conf"))
        self.wait_for(self._is_idle, "slurmd")
        return self

    def __exit__(self, *_: object) -> None:
        self.end_jobs()
        for daemon in reversed(self._daemons):
            daemon.terminate()
        for daemon in self._daemons:
            try:
                daemon.wait(timeout=20)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()

    def ask(self, *command: str) -> str:
        """Return what a command of Slurm prints, such as ``squeue``."""
        environment = os.environ | self.environment
        return subprocess.run(
            command, env=environment, capture_output=True, text=True, check=True
        ).stdout

    def jobs(self, *states: str) -> list[str]:
        """Return the numbers of the jobs in these states; by default, of those not ended."""
        chosen = [f"--states={','.join(states)}"] if states else []
        return self.ask("squeue", "--noheader", "--format=%A", "--sort=i", *chosen).split()

    def wait_for(self, condition: Callable[[], Any], what: str, seconds: float = 60) -> Any:
        """Wait until a condition holds, and return it; the error shows the daemons' logs."""
        deadline = time.monotonic() + seconds
        while not (held := condition()):
            if time.monotonic() > deadline:
                logs = "".join(
                    path.read_text(errors="replace") for path in self.folder.glob("*.out")
                )
                raise RuntimeError(f"{what} did not come up in {seconds:g} s:\n{logs}")
            time.sleep(0.2)
        return held

    def update(self, what: str, *changes: str) -> None:
        """Change a job or the node, for example ``update("NodeName=...", "State=DRAIN")``."""
        self.ask("scontrol", "update", what, *changes)

    def end_jobs(self) -> None:
        """Cancel all jobs, and wait until they have ended."""
        if jobs := self.jobs():
            self.ask("scancel", *jobs)
            self.wait_for(lambda: not self.jobs(), "the end of the jobs")

    def processes(self, job: str) -> list[int]:
        """Return the processes of a job, once this node has begun to run it."""

        def listed() -> list[int]:
            # A job that is said to run may have no process yet, which is an error for Slurm.
            try:
                lines = self.ask("scontrol", "listpids", job).splitlines()[1:]
            except subprocess.CalledProcessError:
                return []
            # Slurm lists a step that has no process yet as process -1, which for `kill` means all.
            return [process for line in lines if (process := int(line.split()[0])) > 0]

        return self.wait_for(listed, f"the processes of job {job}")

    def _wrap_srun(self) -> None:
        """Write an srun for jobs that finds this cluster; SLURM_ variables do not reach a job."""
        wrapper = self.folder / "bin" / "srun"
        wrapper.parent.mkdir()
        configuration = self.environment["SLURM_CONF"]
        wrapper.write_text(
            f'#!/bin/sh\nSLURM_CONF={configuration} exec {_find("srun")} "$@"\n', encoding="utf-8"
        )
        wrapper.chmod(0o755)

    def _start(self, program: str, *arguments: str) -> None:
        with (self.folder / f"{program}.out").open("ab") as output:
            command = [_find(program), *arguments]
            environment = os.environ | self.environment
            self._daemons.append(
                subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT, env=environment)
            )

    def _is_idle(self) -> bool:
        try:
            return self.ask("sinfo", "--noheader", "--format=%t").strip() == "idle"
        except subprocess.CalledProcessError:
            return False

    def _configuration(self, socket_path: Path, ports: list[int]) -> str:
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        settings = {
            "ClusterName": "test",
            "SlurmctldHost": f"{self.node}(127.0.0.1)",
            "SlurmctldPort": ports[0],
            "SlurmdPort": ports[1],
            "SlurmUser": "root",
            "AuthType": "auth/munge",
            "AuthInfo": f"socket={socket_path}",
            "CredType": "cred/munge",
            "StateSaveLocation": self.folder / "state",
            "SlurmdSpoolDir": self.folder / "spool",
            "SlurmctldPidFile": self.folder / "slurmctld.pid",
            "SlurmdPidFile": self.folder / "slurmd.pid",
            "ProctrackType": "proctrack/linuxproc",
            "TaskPlugin": "task/none",
            "JobAcctGatherType": "jobacct_gather/none",
            "AccountingStorageType": "accounting_storage/none",
            "SelectType": "select/cons_tres",
            "SelectTypeParameters": "CR_Core",
            "SchedulerParameters": "sched_interval=1,sched_min_interval=0",
            "ReturnToService": 2,
            "KillWait": 1,
            "MinJobAge": 3600,
            "MpiDefault": "none",
            "SlurmdParameters": "config_overrides",
        }
        lines = [f"{key}={value}" for key, value in settings.items()]
        lines.append(f"NodeName={self.node} NodeAddr=127.0.0.1 CPUs={self.slots} RealMemory=2000")
        lines.append("PartitionName=test Nodes=ALL Default=YES MaxTime=INFINITE State=UP")
        return "\n".join(lines) + "\n"


def _free_ports(count: int) -> list[int]:
    sockets = [socket.socket() for _ in range(count)]
    for each in sockets:
        each.bind(("127.0.0.1", 0))
    ports = [each.getsockname()[1] for each in sockets]
    for each in sockets:
        each.close()
    return ports


@pytest.fixture(scope="module")
def started_cluster(tmp_path_factory):
    """Return a cluster of one node with four processors."""
    with SingleNodeSlurm(tmp_path_factory.mktemp("cluster") / "slurm", slots=4) as cluster:
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


def test_after_a_killed_run_the_next_names_the_jobs_that_slurm_still_runs(
    cluster, before_fits, local
):
    node = f"NodeName={cluster.node}"
    cluster.update(node, "State=DRAIN", "Reason=test")
    with before_fits.start(*ONE_BY_ONE, "--", *FITS) as killed:
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
    again = before_fits.snakemake(*ONE_BY_ONE, "--", *FITS)
    assert again.status == 0, again.output
    for name in FITS:
        assert (before_fits.folder / name).read_bytes() == (local.folder / name).read_bytes()
