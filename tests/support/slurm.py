"""Run a Slurm cluster of one node on loopback, in its own folder, during a test."""

import os
import secrets
import shutil
import socket
import subprocess
import time
from pathlib import Path

PROGRAMS = ["munged", "slurmctld", "slurmd", "sbatch", "srun", "sinfo", "squeue"]


def missing_reason() -> str | None:
    """Return the reason why Slurm cannot start here; None if it can."""
    missing = [name for name in PROGRAMS if not _find(name)]
    if missing:
        return f"Slurm cannot start: {', '.join(missing)} not installed (slurm-wlm, munge)"
    if os.geteuid() != 0:
        return "Slurm cannot start: slurmd must run as root"
    return None


def _find(name: str) -> str | None:
    return shutil.which(name, path=os.pathsep.join([*os.get_exec_path(), "/usr/sbin"]))


class SingleNodeSlurm:
    """A Slurm cluster: munged, slurmctld and slurmd, which are stopped at the end.

    Parameters
    ----------
    folder : Path
        Folder of the configuration, the key, the state and the logs.

    Attributes
    ----------
    environment : dict of str to str
        Environment variables with which a client finds this cluster.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        path = os.pathsep.join([str(folder / "bin"), *os.get_exec_path()])
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
        _wait_for(socket_path.exists, "munged", self.folder)
        self._start("slurmctld", "-D", "-f", str(self.folder / "slurm.conf"))
        self._start("slurmd", "-D", "-f", str(self.folder / "slurm.conf"))
        _wait_for(self._is_idle, "slurmd", self.folder)
        return self

    def __exit__(self, *_: object) -> None:
        for daemon in reversed(self._daemons):
            daemon.terminate()
        for daemon in reversed(self._daemons):
            try:
                daemon.wait(timeout=20)
            except subprocess.TimeoutExpired:
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
        with (self.folder / f"{program}.out").open("wb") as output:
            command = [_find(program), *arguments]
            environment = os.environ | self.environment
            daemon = subprocess.Popen(
                command, stdout=output, stderr=subprocess.STDOUT, env=environment
            )
        self._daemons.append(daemon)

    def _is_idle(self) -> bool:
        command = ["sinfo", "--noheader", "--format=%t"]
        environment = os.environ | self.environment
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        return done.stdout.strip() == "idle"

    def _configuration(self, socket_path: Path, ports: list[int]) -> str:
        host = socket.gethostname().split(".")[0]
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        settings = {
            "ClusterName": "test",
            "SlurmctldHost": f"{host}(127.0.0.1)",
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
            "MinJobAge": 3600,
            "MpiDefault": "none",
            "SlurmdParameters": "config_overrides",
        }
        lines = [f"{key}={value}" for key, value in settings.items()]
        cores = os.cpu_count()
        lines.append(f"NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory=2000")
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


def _wait_for(condition: object, what: str, folder: Path, seconds: float = 60) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            logs = "".join(path.read_text(errors="replace") for path in folder.glob("*.out"))
            raise RuntimeError(f"{what} did not come up in {seconds:g} s:\n{logs}")
        time.sleep(0.2)
