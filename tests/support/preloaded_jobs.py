"""Jobs of a workflow as forks of a process that has imported what they import.

For tests that run thousands of jobs. A job then costs a few hundredths of a second instead of half
a second. Each job is still a process of its own with its own streams, folder and environment, and
imports the project's code from its files. Only on Linux, whose jobs end with the one who called.
"""

import atexit
import contextlib
import gc
import importlib
import marshal
import os
import runpy
import socket
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

# What the jobs import, of the packages that the workflow needs.
PACKAGES = [
    "numpy",
    "pandas",
    "scipy.optimize",
    "scipy.signal",
    "scipy.special",
    "scipy.stats",
    "matplotlib.figure",
    "matplotlib.backends.backend_svg",
    "jinja2",
    "jsonschema",
    "yaml",
]
ROOT = Path(__file__).parents[2]
# The server's environment variable that tells it to count the branches that the jobs run.
MEASURED = "MEASURED_JOBS"
# So many calls of each script: they run the same branches again and again.
MEASURED_CALLS = 3
# The jobs' `python`: sends its call to the server, and waits for the exit status. A script that
# raises an error closes the connection without one.
CLIENT = """#!{python} -IS
import marshal, os, sys
if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
    os.execv({python!r}, [{python!r}, *sys.argv[1:]])
import _socket
connection = _socket.socket(_socket.AF_UNIX, _socket.SOCK_STREAM)
connection.connect({address!r})
call = marshal.dumps((sys.argv[1:], os.getcwd(), dict(os.environ)))
handles = b"".join(handle.to_bytes(4, sys.byteorder) for handle in (0, 1, 2))
header = len(call).to_bytes(4, "big")
connection.sendmsg([header], [(_socket.SOL_SOCKET, _socket.SCM_RIGHTS, handles)])
connection.sendall(call)
status = connection.recv(8)
os._exit(int(status) if status else 1)
"""


class PreloadedJobs:
    """A server that runs Python scripts, and the program ``python`` that calls it.

    Parameters
    ----------
    environment : mapping
        Environment variables of the server; those of each job come with its call.
    measured : bool
        Whether `coverage` counts which branches the first calls of each script run.

    Attributes
    ----------
    python : Path
        A program that runs a script as Python does.
    """

    def __init__(self, environment: Mapping[str, str], *, measured: bool = False) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="jobs")
        address = str(Path(self._folder.name) / "socket")
        self.python = Path(self._folder.name) / "python"
        self.python.write_text(CLIENT.format(python=sys.executable, address=address))
        self.python.chmod(0o755)
        with socket.socket(socket.AF_UNIX) as listening:
            listening.bind(address)
            listening.listen(64)
            handle = listening.fileno()
            self._server = subprocess.Popen(
                start_of(__name__, handle),
                pass_fds=[handle],
                env={**environment, **({MEASURED: "1"} if measured else {})},
            )

    def close(self) -> None:
        """End the server."""
        self._server.terminate()
        self._server.wait()
        self._folder.cleanup()


def serve(listening: socket.socket) -> None:
    """Fork for each call that comes."""
    to_measure = MEASURED_CALLS if MEASURED in os.environ else 0
    for name in [*PACKAGES, *(["coverage"] if to_measure else [])]:
        importlib.import_module(name)
    # A fork need not look through what was there before it for garbage, nor copy its pages.
    gc.collect()
    gc.freeze()
    calls: Counter[str] = Counter()
    at_work = 0
    while True:
        connection, _ = listening.accept()
        header, handles, _, _ = socket.recv_fds(connection, 4, 3)
        with connection.makefile("rb") as stream:
            call = marshal.loads(stream.read(int.from_bytes(header, "big")))
        name = Path(call[0][0]).name
        calls[name] += 1
        if os.fork() == 0:
            listening.close()
            run_call(connection, handles, call, measured=calls[name] <= to_measure)
        for handle in handles:
            os.close(handle)
        connection.close()
        at_work += 1
        # Take the ended ones away.
        while at_work and os.waitpid(-1, os.WNOHANG)[0]:
            at_work -= 1


def run_call(
    connection: socket.socket,
    handles: Sequence[int],
    call: tuple[list[str], str, dict[str, str]],
    *,
    measured: bool,
) -> None:
    """Run the script of one call in a fork, and send its exit status; never return."""
    # Windows has no such module, and starts its jobs anew.
    import fcntl

    arguments, folder, environment = call
    for stream, handle in enumerate(handles):
        os.dup2(handle, stream)
        os.close(handle)
    # Whoever kills the client kills the job: the kernel then sends SIGIO, which ends a process.
    fcntl.fcntl(connection, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(connection, fcntl.F_SETFL, fcntl.fcntl(connection, fcntl.F_GETFL) | os.O_ASYNC)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    sys.argv = arguments
    # Where `python SCRIPT` looks first.
    sys.path[0] = str(Path(arguments[0]).resolve().parent)
    with count_branches() if measured else contextlib.nullcontext():
        status = run_script(arguments[0])
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    connection.sendall(str(status).encode())
    # To take all imported modules apart would cost more than most jobs.
    os._exit(status)


def run_script(path: str) -> int:
    """Run a script as Python does, and return its exit status."""
    try:
        runpy.run_path(path, run_name="__main__")
    except SystemExit as ended:
        if isinstance(ended.code, str):
            print(ended.code, file=sys.stderr)
        return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    return 0


@contextlib.contextmanager
def count_branches() -> Iterator[None]:
    """Count the branches that run, in a file that `pytest --cov` adds to its own."""
    import coverage

    counted = coverage.Coverage(
        data_file=str(ROOT / ".coverage"),
        data_suffix=True,
        config_file=str(ROOT / "pyproject.toml"),
    )
    with counted.collect():
        yield
    counted.save()


def start_of(module: str, handle: int) -> list[str]:
    """Return the command that serves a module's calls on a socket."""
    tests = str(Path(__file__).parents[1])
    code = (
        f"import socket, sys; sys.path[0] = {tests!r}; import {module} as served; "
        f"served.serve(socket.socket(fileno={handle}))"
    )
    return [sys.executable, "-c", code]
