"""The workflow gives the same bytes on a Slurm cluster as on this computer, also after mishaps."""

import os
import re
import secrets
import shutil
import socket
import subprocess
import sys
import time

import pytest

from capsule.store.results import BATCH_COLUMNS
from support.command import output_of
from support.marks import needs
from support.project import ROOT

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
# All steps but those that draw.
THROUGH_SLURM = ["--profile=profiles/slurm", *WITHOUT_ACCOUNTING]
THROUGH_SLURM += ["--", "results/recordings.csv", "results/detections.csv"]


def _find(name):
    return shutil.which(name, path=os.pathsep.join([*os.get_exec_path(), "/usr/sbin"]))


MISSING = [name for name in PROGRAMS if not _find(name)]
pytestmark = [
    pytest.mark.slow,
    pytest.mark.workflow,
    pytest.mark.waits,
    pytest.mark.packages,
    pytest.mark.takes(30),
    needs(f"not installed (slurm-wlm, munge): {', '.join(MISSING)}" if MISSING else ""),
    needs("slurmd must run as root" if os.geteuid() != 0 else ""),
]


class SingleNodeSlurm:
    """A Slurm cluster of one node with four processors, in a folder, until `end` is called."""

    def __init__(self, folder):
        self.folder, self.node = folder, socket.gethostname().split(".")[0]
        path = os.pathsep.join([str(folder / "bin"), *os.get_exec_path()])
        # With these, a client finds this cluster.
        self.environment = {"SLURM_CONF": str(folder / "slurm.conf"), "PATH": path}
        # munged requires that no other user can write to its folder or to a folder above it.
        key, munge = folder / "munge.key", folder / "munge.socket"
        for name in ("bin", "state", "spool"):
            (folder / name).mkdir(parents=True)
        key.write_bytes(secrets.token_bytes(1024))
        key.chmod(0o400)
        (folder / "slurm.conf").write_text(self._configuration(munge))
        # An srun for jobs that finds this cluster; variables named SLURM_ do not reach a job.
        found = f"SLURM_CONF={folder / 'slurm.conf'} exec {_find('srun')}"
        (folder / "bin/srun").write_text(f'#!/bin/sh\n{found} "$@"\n')
        (folder / "bin/srun").chmod(0o755)
        self._daemons = []
        files = [f"--key-file={key}", f"--socket={munge}", f"--seed-file={folder}/munged.seed"]
        files += [f"--pid-file={folder}/munged.pid", f"--log-file={folder}/munged.log"]
        self._start("munged", "--foreground", "--force", *files)
        self.wait_for(munge.exists, "munged")
        for daemon in ("slurmctld", "slurmd"):
            self._start(daemon, "-D", "-f", str(folder / "slurm.conf"))
        self.wait_for(lambda: "idle" in self.ask("sinfo", "-ho%t"), "slurmd")

    def end(self):
        """End the jobs and the daemons."""
        self.ask("scancel", *self.jobs())
        self.wait_for(lambda: not self.jobs(), "the end of the jobs")
        for daemon in reversed(self._daemons):
            daemon.terminate()
        for daemon in self._daemons:
            daemon.wait(timeout=60)

    def ask(self, *command):
        """Return what a command of Slurm prints, such as ``squeue``; "" if it fails."""
        environment = os.environ | self.environment
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        return done.stdout if done.returncode == 0 else ""

    def jobs(self):
        """Return the numbers of the jobs that have not ended."""
        return self.ask("squeue", "--noheader", "--format=%A", "--sort=i").split()

    def wait_for(self, condition, what):
        """Wait until a condition holds, and return it; the error shows the daemons' logs."""
        deadline = time.monotonic() + 60
        while not (held := condition()):
            if time.monotonic() > deadline:
                logs = [path.read_text(errors="replace") for path in self.folder.glob("*.out")]
                raise RuntimeError(f"{what} did not come up:\n{''.join(logs)}")
            time.sleep(0.2)
        return held

    def _start(self, program, *arguments):
        call, environment = [_find(program), *arguments], os.environ | self.environment
        with (self.folder / f"{program}.out").open("ab") as to:
            self._daemons.append(subprocess.Popen(call, stdout=to, stderr=to, env=environment))

    def _configuration(self, munge):
        servers = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]
        ports = [each.getsockname()[1] for each in servers]
        for each in servers:
            each.close()
        return f"""ClusterName=test
SlurmctldHost={self.node}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmUser=root
AuthInfo=socket={munge}
StateSaveLocation={self.folder / "state"}
SlurmdSpoolDir={self.folder / "spool"}
SlurmctldPidFile={self.folder / "slurmctld.pid"}
SlurmdPidFile={self.folder / "slurmd.pid"}
ProctrackType=proctrack/linuxproc
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=1,sched_min_interval=0
KillWait=1
SlurmdParameters=config_overrides
NodeName={self.node} NodeAddr=127.0.0.1 CPUs=4 RealMemory=2000
PartitionName=test Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


@pytest.fixture
def cluster(tmp_path, monkeypatch):
    """Return a cluster, which the calls of this test find."""
    cluster = SingleNodeSlurm(tmp_path / "slurm")
    for name, value in cluster.environment.items():
        monkeypatch.setenv(name, value)
    yield cluster
    cluster.end()


@pytest.fixture
def plugin(tmp_path):
    """Install Snakemake's plugin, which all other starts of Snakemake would import as well."""
    lock = "--no-deps", "--require-hashes", "--requirement", ROOT / "requirements-slurm.lock"
    pip = sys.executable, "-m", "pip", "install", "-q", "--target", tmp_path / "plugin"
    output_of(*pip, *lock)
    return {"environment": {"PYTHONPATH": str(tmp_path / "plugin")}}


def test_slurm_gives_the_same_results_in_few_jobs_after_those_of_a_killed_run_have_ended(
    cluster, plugin, new, finished
):
    node = f"NodeName={cluster.node}"
    # All jobs wait until the node takes jobs again.
    cluster.ask("scontrol", "update", node, "State=DRAIN", "Reason=test")
    with new.start(*THROUGH_SLURM, **plugin) as killed:
        jobs = cluster.wait_for(lambda: (found := cluster.jobs())[3:] and found, "four jobs")
        killed.kill()
    refused = new.snakemake(*THROUGH_SLURM, **plugin)
    assert refused.status != 0
    assert f"still use this folder ({', '.join(jobs)})" in refused.output
    remedy = re.search(r"scancel [\d ]*\d", refused.output)
    cluster.ask(*remedy[0].split())
    cluster.wait_for(lambda: not cluster.jobs(), "the end of the jobs")
    cluster.ask("scontrol", "update", node, "State=RESUME")
    run = new.snakemake(*THROUGH_SLURM, **plugin)
    assert run.status == 0, run.output
    for name in ("templates.npz", "templates.json"):
        assert (new.results / name).read_bytes() == (finished.results / name).read_bytes()
    rows = [*zip(new.table("recordings.csv"), finished.table("recordings.csv"), strict=True)]
    differing = {name for one, other in rows for name in one if one[name] != other[name]}
    assert differing <= {*BATCH_COLUMNS}
    # A job for each folder's batch of recordings, and one for the fits of a size; all other steps
    # run beside Snakemake.
    assert run.output.count("has been submitted with SLURM jobid") == 4 + 2
