"""Run a Slurm cluster of one node on loopback, in its own folder, during a test."""

import contextlib
import os
import re
import secrets
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

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


def missing_reason() -> str:
    """Return the reason why Slurm cannot start here; empty if it can."""
    missing = [name for name in PROGRAMS if not _find(name)]
    if missing:
        return f"Slurm cannot start: {', '.join(missing)} not installed (slurm-wlm, munge)"
    if os.geteuid() != 0:
        return "Slurm cannot start: slurmd must run as root"
    return ""


def _find(name: str) -> str | None:
    return shutil.which(name, path=os.pathsep.join([*os.get_exec_path(), "/usr/sbin"]))


class SingleNodeSlurm:
    """A Slurm cluster: munged, slurmctld and slurmd, which are stopped at the end.

    Parameters
    ----------
    folder : Path
        Folder of the configuration, the key, the state and the logs.
    slots : int, optional
        Number of processors that the node declares; the default is those of this machine.

    Attributes
    ----------
    environment : dict of str to str
        Environment variables with which a client finds this cluster.
    node : str
        Name of the only node.
    """

    def __init__(self, folder: Path, slots: int | None = None) -> None:
        self.folder, self.slots = folder, slots or os.cpu_count()
        self.node = socket.gethostname().split(".")[0]
        path = os.pathsep.join([str(folder / "bin"), *os.get_exec_path()])
        self.environment = {"SLURM_CONF": str(folder / "slurm.conf"), "PATH": path}
        self._daemons: dict[str, subprocess.Popen] = {}

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
        _wait_for(socket_path.exists, "munged", self.folder)
        self.start_controller()
        self._start("slurmd", "-D", "-f", str(self.folder / "slurm.conf"))
        _wait_for(self._is_idle, "slurmd", self.folder)
        return self

    def __exit__(self, *_: object) -> None:
        self.end_jobs()
        daemons = list(reversed(self._daemons.values()))
        for daemon in daemons:
            daemon.terminate()
        for daemon in daemons:
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

    def steps(self) -> list[str]:
        """Return the steps that run, such as ``3.0``: the calls of srun inside the jobs."""
        listed = self.ask("squeue", "--steps", "--noheader", "--format=%i").split()
        return [step for step in listed if step.rpartition(".")[2].isdigit()]

    def wait_for(self, condition: Callable[[], Any], what: str) -> Any:
        """Wait until a condition holds, and return it; the error shows the daemons' logs."""
        return _wait_for(condition, what, self.folder)

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

    def start_controller(self) -> None:
        """Start slurmctld; it continues with the state that an earlier one has left."""
        self._start("slurmctld", "-D", "-f", str(self.folder / "slurm.conf"))

    def kill_controller(self) -> None:
        """Kill slurmctld without a warning, as soon as it has saved the jobs.

        It saves a change after some seconds; until then a kill would take the job with it.
        """
        saved = self.folder / "state" / "job_state"
        before = saved.stat().st_mtime_ns if saved.exists() else 0
        for job in self.jobs():
            self.update(f"JobId={job}", "Comment=saved")
        self.wait_for(
            lambda: saved.exists() and saved.stat().st_mtime_ns > before, "the saved jobs"
        )
        self._kill("slurmctld")

    def lose_node(self) -> None:
        """Kill slurmd and all processes of its jobs, as a node that goes down."""
        doomed = {process for job in self.jobs("RUNNING") for process in self.processes(job)}
        # slurmd has a process for each step of a job, which is no process of the job itself.
        doomed |= {parent for process in doomed for parent in _parents(process)}
        self._kill("slurmd")
        for process in doomed:
            _kill_if_alive(process)
        self.update(f"NodeName={self.node}", "State=DOWN", "Reason=test")
        # The controller tells the node to end the jobs. If that came after the node is back, it
        # would end the jobs that have begun again.
        self.wait_for(self._has_told_all, "the last message to the node")

    def return_node(self) -> None:
        """Start slurmd again; jobs that have lost their node start now, not in two minutes."""
        self._start("slurmd", "-D", "-f", str(self.folder / "slurm.conf"))
        self.update(f"NodeName={self.node}", "State=RESUME")
        for job in self.jobs("PENDING"):
            self.update(f"JobId={job}", "StartTime=now")

    def _has_told_all(self) -> bool:
        """Return whether the controller has no message under way."""
        counts = re.findall(r"^Agent (?:queue size|count): *(\d+)", self.ask("sdiag"), re.MULTILINE)
        return len(counts) == 2 and not any(map(int, counts))

    def _kill(self, program: str) -> None:
        daemon = self._daemons.pop(program)
        daemon.kill()
        daemon.wait()

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
            self._daemons[program] = subprocess.Popen(
                command, stdout=output, stderr=subprocess.STDOUT, env=environment
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


def _parents(process: int) -> Iterator[int]:
    """Give the parent of a process; none if the process has ended meanwhile."""
    with contextlib.suppress(FileNotFoundError, ProcessLookupError):
        status = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
        yield int(status.rpartition(")")[2].split()[1])


def _kill_if_alive(process: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, signal.SIGKILL)


def _wait_for(condition: Callable[[], Any], what: str, folder: Path, seconds: float = 60) -> Any:
    deadline = time.monotonic() + seconds
    while not (held := condition()):
        if time.monotonic() > deadline:
            logs = "".join(path.read_text(errors="replace") for path in folder.glob("*.out"))
            raise RuntimeError(f"{what} did not come up in {seconds:g} s:\n{logs}")
        time.sleep(0.2)
    return held
