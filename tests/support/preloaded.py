"""Calls of snakemake by forks of a process that has imported it: a second less for each call.

For tests that call it a hundred times. A fork runs the same program in a session of its own, and
can be killed like any other. Not on Windows, which knows no forks.
"""

import contextlib
import gc
import json
import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from support.preloaded_jobs import PreloadedJobs, start_of


class ForkedCall:
    """A call of snakemake that is at work, as far as it is like `subprocess.Popen`.

    Attributes
    ----------
    pid : int
        Of Snakemake, and of the process group of it and its jobs.
    stdout : file
        What it prints, errors too.
    returncode : int or None
        Known when it has been waited for; the negative signal where one has ended it.
    """

    def __init__(
        self, server: "PreloadedSnakemake", connection: socket.socket, output: int
    ) -> None:
        self._server, self._connection = server, connection
        self._replies = connection.makefile()
        self.pid = int(self._replies.readline())
        self.stdout = os.fdopen(output, encoding="utf-8", errors="replace")
        self.returncode: int | None = None

    def __enter__(self) -> "ForkedCall":
        return self

    def __exit__(self, *_: object) -> None:
        self.stdout.close()
        self.wait()

    def wait(self) -> int:
        """Wait for its end."""
        if self.returncode is None:
            self.returncode = int(self._replies.readline())
            self._replies.close()
            self._server.take_back(self._connection)
        return self.returncode

    def poll(self) -> int | None:
        """Give its exit status, None while it is at work."""
        ended = self.returncode is None and select.select([self._connection], [], [], 0)[0]
        return self.wait() if ended else self.returncode

    def kill(self) -> None:
        """Kill Snakemake alone."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGKILL)


class PreloadedSnakemake:
    """Processes that have imported Snakemake, one for each call at work at the same time.

    Parameters
    ----------
    measured : bool
        Whether `coverage` counts which branches the jobs run.
    """

    def __init__(self, *, measured: bool = False) -> None:
        self._measured = measured
        self._idle: list[socket.socket] = []
        self._servers: list[tuple[subprocess.Popen[bytes], socket.socket]] = []
        self._jobs: PreloadedJobs | None = None

    def __enter__(self) -> "PreloadedSnakemake":
        return self

    def __exit__(self, *_: object) -> None:
        for server, connection in self._servers:
            connection.close()
            server.wait()
        if self._jobs:
            self._jobs.close()

    def start(
        self, arguments: Sequence[str], folder: Path, environment: Mapping[str, str]
    ) -> ForkedCall:
        """Call snakemake in a folder; on Linux its jobs are forks of a preloaded process, too."""
        connection = self._idle.pop() if self._idle else self._new(environment)
        if sys.platform == "linux" and self._jobs is None:
            self._jobs = PreloadedJobs(environment, measured=self._measured)
        call = {
            "arguments": list(arguments),
            "folder": str(folder),
            "environment": {**environment},
            "python": str(self._jobs.python) if self._jobs else sys.executable,
        }
        reading, writing = os.pipe()
        socket.send_fds(connection, [json.dumps(call).encode() + b"\n"], [writing])
        os.close(writing)
        return ForkedCall(self, connection, reading)

    def take_back(self, connection: socket.socket) -> None:
        """Use a process for the next call; its last one has ended."""
        self._idle.append(connection)

    def _new(self, environment: Mapping[str, str]) -> socket.socket:
        ours, theirs = socket.socketpair()
        with theirs:
            handle = theirs.fileno()
            server = subprocess.Popen(
                start_of(__name__, handle), pass_fds=[handle], env={**environment}
            )
        self._servers.append((server, ours))
        return ours


def serve(connection: socket.socket) -> None:
    """Fork for each call that comes; tell its process, and at its end its exit status."""
    # What Snakemake imports when it opens the first Snakefile, and what that one imports.
    import jsonschema  # noqa: F401
    import smart_open  # noqa: F401
    import snakemake.cli

    # Finds and imports the plug-ins.
    snakemake.cli.get_argument_parser()
    # A fork need not look through what was there before it for garbage, nor copy its pages.
    gc.collect()
    gc.freeze()
    while message := _receive(connection):
        call, output = message
        process = os.fork()
        if process == 0:
            connection.close()
            os.setsid()
            for stream in (1, 2):
                os.dup2(output, stream)
            os.close(output)
            os.chdir(call["folder"])
            os.environ.clear()
            os.environ.update(call["environment"])
            # Where `python -m snakemake` looks first.
            sys.path[0] = call["folder"]
            # The workflow's jobs run the Python that runs Snakemake.
            sys.executable = call["python"]
            sys.exit(snakemake.cli.main(call["arguments"]))
        os.close(output)
        connection.sendall(f"{process}\n".encode())
        status = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
        connection.sendall(f"{status}\n".encode())


def _receive(connection: socket.socket) -> tuple[dict[str, Any], int] | None:
    """Wait for a call and for where its output goes; None when no more will come."""
    content, handles, _, _ = socket.recv_fds(connection, 2**16, 1)
    if not content:
        return None
    while not content.endswith(b"\n"):
        content += connection.recv(2**16)
    return json.loads(content), handles[0]
