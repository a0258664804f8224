"""Run the jobs of the workflow in forks of one process that has imported their packages.

Start and imports of Python take longer than most jobs of the tests. In a test, a job calls the
program `python` that stands in the folder of `PreloadedJobs`. It sends its arguments, streams,
folder and environment to the process, whose fork runs the script. The process imports no code of
the project: each test may have its own copy of that. Only for Linux: its kernel ends a fork whose
caller was killed.
"""

import atexit
import fcntl
import gc
import importlib
import marshal
import os
import runpy
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

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
# What is no script, such as `-m snakemake` in the job of a cluster, is run by Python itself.
_CALLER = """#!{python} -IS
import marshal, os, sys
if sys.argv[1].startswith("-"):
    os.execv({python!r}, [{python!r}, *sys.argv[1:]])
import _socket
connection = _socket.socket(_socket.AF_UNIX, _socket.SOCK_STREAM)
try:
    connection.connect({address!r})
except OSError:
    os.execv({python!r}, [{python!r}, *sys.argv[1:]])
call = marshal.dumps((sys.argv[1:], os.getcwd(), dict(os.environ)))
streams = b"".join(stream.to_bytes(4, sys.byteorder) for stream in (0, 1, 2))
header = len(call).to_bytes(4, "big")
connection.sendmsg([header], [(_socket.SOL_SOCKET, _socket.SCM_RIGHTS, streams)])
connection.sendall(call)
os._exit(int(connection.recv(8) or 1))
"""


class PreloadedJobs:
    """A process that runs scripts, and the program `python` that calls it.

    Parameters
    ----------
    environment : mapping
        Environment variables of the process; those of each job come with its call.

    Attributes
    ----------
    python : Path
        The program.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        self.python = Path(tempfile.mkdtemp(prefix="jobs")) / "python"
        address = str(self.python.with_name("socket"))
        self.python.write_text(_CALLER.format(python=sys.executable, address=address))
        self.python.chmod(0o700)
        with socket.socket(socket.AF_UNIX) as listening:
            listening.bind(address)
            listening.listen(128)
            self._process = subprocess.Popen(
                [sys.executable, __file__, str(listening.fileno())],
                pass_fds=[listening.fileno()],
                # The process ends when this pipe does, even if this process is killed.
                stdin=subprocess.PIPE,
                env={**environment},
                start_new_session=True,
            )

    def close(self) -> None:
        """End the process, and remove the program; jobs that are running go on."""
        self._process.communicate()
        shutil.rmtree(self.python.parent)


def serve(listening: socket.socket) -> None:
    """Fork for each call until the starter has ended."""
    for package in PACKAGES:
        importlib.import_module(package)
    # Without garbage collection of these objects, a fork copies fewer pages of memory.
    gc.collect()
    gc.freeze()
    # Nobody has to wait for a fork.
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    while listening in select.select([listening, sys.stdin], [], [])[0]:
        connection, _ = listening.accept()
        try:
            header, streams, _, _ = socket.recv_fds(connection, 4, 3)
            with connection.makefile("rb") as content:
                call = marshal.loads(content.read(int.from_bytes(header, "big")))
        except (EOFError, OSError, ValueError):
            # Tests kill jobs, also while they call.
            connection.close()
            continue
        if os.fork() == 0:
            listening.close()
            _run(connection, streams, *call)
        for stream in streams:
            os.close(stream)
        connection.close()


def _run(
    connection: socket.socket,
    streams: Sequence[int],
    arguments: list[str],
    folder: str,
    environment: Mapping[str, str],
) -> None:
    """Run a script in a fork as Python does, and send its exit status; never return."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    for stream, handle in enumerate(streams):
        os.dup2(handle, stream)
        os.close(handle)
    # When the caller is gone, the kernel sends SIGIO, which ends a process.
    fcntl.fcntl(connection, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(connection, fcntl.F_SETFL, fcntl.fcntl(connection, fcntl.F_GETFL) | os.O_ASYNC)
    if select.select([connection], [], [], 0)[0]:
        os._exit(1)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    sys.argv, sys.path[0] = arguments, str(Path(arguments[0]).resolve().parent)
    # If the script raises an error, nothing is sent, and the caller ends with status 1.
    status = 0
    try:
        runpy.run_path(arguments[0], run_name="__main__")
    except SystemExit as ended:
        if isinstance(ended.code, str):
            print(ended.code, file=sys.stderr)
        status = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    connection.sendall(str(status).encode())
    # To take all imported modules apart would take longer than most jobs.
    os._exit(status)


if __name__ == "__main__":
    serve(socket.socket(fileno=int(sys.argv[1])))
