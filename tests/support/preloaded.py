"""Call snakemake in forks of a process that has imported it, which saves a second for each call.

Tests that call snakemake a hundred times use this. A fork runs the same program in its own session,
and can be killed like any process. Windows has no forks.
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
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from support.preloaded_jobs import PreloadedJobs

TESTS = Path(__file__).parents[1]
START = (
    "import socket, sys; sys.path[0] = {tests!r}; import support.preloaded as served; "
    "served.serve(socket.socket(fileno={handle}))"
)


class ForkedCall:
    """A running call of snakemake, with a part of the interface of `subprocess.Popen`.

    Attributes
    ----------
    pid : int
        Process of Snakemake, and process group of Snakemake and its jobs.
    stdout : file
        Printed output, including errors.
    returncode : int or None
        Exit status, known after `wait`; negative if a signal has ended the call.
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
        """Wait for the end of the call, and return its exit status."""
        if self.returncode is None:
            self.returncode = int(self._replies.readline())
            self._replies.close()
            self._server.take_back(self._connection)
        return self.returncode

    def poll(self) -> int | None:
        """Return the exit status; None while the call is running."""
        ended = self.returncode is None and select.select([self._connection], [], [], 0)[0]
        return self.wait() if ended else self.returncode

    def kill(self) -> None:
        """Kill only Snakemake, not its jobs."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGKILL)


class PreloadedSnakemake:
    """A group of processes that have imported Snakemake, one for each simultaneous call.

    Parameters
    ----------
    jobs_too : bool
        Whether the jobs are forks, too; otherwise each starts Python.
    """

    def __init__(self, *, jobs_too: bool = True) -> None:
        self._jobs_too = jobs_too and sys.platform == "linux"
        self._jobs: PreloadedJobs | None = None
        self._idle: list[socket.socket] = []
        self._servers: list[tuple[subprocess.Popen[bytes], socket.socket]] = []

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
        """Call snakemake in a folder."""
        # The preloaded processes need no module for it, and Windows cannot import it.
        from support.preloaded_jobs import PreloadedJobs

        connection = self._idle.pop() if self._idle else self._new(environment)
        if self._jobs_too and self._jobs is None:
            self._jobs = PreloadedJobs(environment)
        call = {
            "arguments": list(arguments),
            "folder": str(folder),
            "environment": dict(environment),
            "python": str(self._jobs.python) if self._jobs else sys.executable,
        }
        reading, writing = os.pipe()
        socket.send_fds(connection, [json.dumps(call).encode() + b"\n"], [writing])
        os.close(writing)
        return ForkedCall(self, connection, reading)

    def take_back(self, connection: socket.socket) -> None:
        """Keep a process for the next call, after its last call has ended."""
        self._idle.append(connection)

    def _new(self, environment: Mapping[str, str]) -> socket.socket:
        ours, theirs = socket.socketpair()
        with theirs:
            handle = theirs.fileno()
            server = subprocess.Popen(
                [sys.executable, "-c", START.format(tests=str(TESTS), handle=handle)],
                pass_fds=[handle],
                env={**environment},
            )
        self._servers.append((server, ours))
        return ours


def serve(connection: socket.socket) -> None:
    """Fork for each call; send its process number, and its exit status when it ends."""
    # Snakemake and the Snakefile would import these later, in each fork.
    import jsonschema  # noqa: F401
    import smart_open  # noqa: F401
    import snakemake.cli

    # This finds and imports the plug-ins.
    snakemake.cli.get_argument_parser()
    # Without garbage collection of these objects, a fork copies fewer pages of memory.
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
            # `python -m snakemake` also looks for modules here first.
            sys.path[0] = call["folder"]
            # The workflow's jobs run the Python that runs Snakemake.
            sys.executable = call["python"]
            sys.exit(snakemake.cli.main(call["arguments"]))
        os.close(output)
        connection.sendall(f"{process}\n".encode())
        status = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
        connection.sendall(f"{status}\n".encode())


def _receive(connection: socket.socket) -> tuple[dict[str, Any], int] | None:
    """Return the next call and the file of its output; None if no further call will come."""
    content, handles, _, _ = socket.recv_fds(connection, 2**16, 1)
    if not content:
        return None
    while not content.endswith(b"\n"):
        content += connection.recv(2**16)
    return json.loads(content), handles[0]
