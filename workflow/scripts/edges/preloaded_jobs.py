"""Run scripts in forks of one process that has imported what the scripts import.

Start and imports of Python take longer than most jobs. Jobs call the program `python` that stands
in the folder of a `PreloadedJobs`. It sends its arguments, streams, folder and environment to the
process, which forks. The fork runs the script and sends back its exit status. Each job is still a
process of its own, and it ends if the program that stands for it is killed.

Only for Linux: the kernel there tells a fork that its caller is gone. The Snakefile uses this
module, so it imports only fast modules.
"""

import atexit
import contextlib
import gc
import importlib
import json
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
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType

# Without this process, the program calls Python itself.
_CALLER = """#!{python} -IS
import marshal, os, sys
if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
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
status = connection.recv(8)
if not status:
    print("error: the process of this job was killed, perhaps because memory ran out",
          file=sys.stderr)
os._exit(int(status) if status else 1)
"""

_Call = tuple[list[str], str, dict[str, str]]
_Context = contextlib.AbstractContextManager[object]


class PreloadedJobs:
    """A process that runs Python scripts, and the program ``python`` that calls it.

    The process ends when the process that has started it ends.

    Parameters
    ----------
    modules : sequence of str
        Names of the modules that the process imports, the most urgent one first.
    search : Path
        The folder in which the process looks for modules first.
    environment : mapping
        Environment variables of the process; those of each job come with its call.
    program : Path
        The Python file that the process runs: this one, or one that calls `serve` in its way.

    Attributes
    ----------
    folder : Path
        The folder of the program ``python``, which runs a script as Python does.

    Raises
    ------
    OSError
        If the folder cannot be made.
    """

    def __init__(
        self,
        modules: Sequence[str],
        search: Path,
        environment: Mapping[str, str],
        program: Path = Path(__file__),
    ) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="jobs"))
        address = str(self.folder / "socket")
        caller = self.folder / "python"
        try:
            caller.write_text(_CALLER.format(python=sys.executable, address=address))
            caller.chmod(0o700)
            # The process reads the end of this pipe when its starter has ended, even by a signal.
            alive, self._alive = os.pipe()
            with os.fdopen(alive, "rb"), socket.socket(socket.AF_UNIX) as listening:
                listening.bind(address)
                listening.listen(128)
                handles = [listening.fileno(), alive]
                told = [*handles, str(self.folder), str(search), list(modules)]
                self._process = subprocess.Popen(
                    [sys.executable, program, json.dumps(told)],
                    pass_fds=handles,
                    env={**environment},
                    # Ctrl-C ends the calling programs, and these end the forks.
                    start_new_session=True,
                )
        except OSError:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise

    def close(self) -> None:
        """End the process, and remove the folder; jobs that are running go on."""
        self._process.terminate()
        self._process.wait()
        os.close(self._alive)
        shutil.rmtree(self.folder, ignore_errors=True)


def serve(
    listening_handle: int,
    alive: int,
    folder: str,
    search: str,
    modules: Iterable[str],
    around: Callable[[str], _Context] = contextlib.nullcontext,
) -> None:
    """Fork for each call until the starter has ended; then remove the folder of the program.

    Parameters
    ----------
    listening_handle, alive : int
        Handles of the listening socket, and of the pipe to the starter.
    folder : str
        The folder of the program.
    search : str
        The folder in which modules are looked for first.
    modules : iterable of str
        Modules to import. Calls come first: while none waits, one module after another is imported.
    around : callable
        Called here with the path of a script; the fork runs the script in the context it returns.
    """
    sys.path[0] = search
    listening = socket.socket(fileno=listening_handle)
    waiting = list(modules)
    importlib.import_module(waiting.pop(0))
    _keep()
    # Python writes a byte there when a fork has ended.
    ended, wake = os.pipe()
    os.set_blocking(wake, False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(wake)
    while True:
        handles = [listening_handle, alive, ended]
        ready, _, _ = select.select(handles, [], [], 0 if waiting else None)
        if alive in ready:
            break
        if listening_handle in ready:
            _fork_for(listening, around)
        elif ended in ready:
            os.read(ended, 1024)
            # The last one raises an error: no fork is left.
            with contextlib.suppress(ChildProcessError):
                while os.waitpid(-1, os.WNOHANG)[0]:
                    pass
        elif waiting:
            importlib.import_module(waiting.pop(0))
            _keep()
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(0)


def _keep() -> None:
    """Exempt what there is from garbage collection, so that no fork copies its memory."""
    gc.collect()
    gc.freeze()


def _fork_for(listening: socket.socket, around: Callable[[str], _Context]) -> None:
    connection, _ = listening.accept()
    header, streams, _, _ = socket.recv_fds(connection, 4, 3)
    with connection.makefile("rb") as content:
        call: _Call = marshal.loads(content.read(int.from_bytes(header, "big")))
    context = around(call[0][0])
    if os.fork() == 0:
        listening.close()
        _run(connection, streams, call, context)
    for stream in streams:
        os.close(stream)
    connection.close()


def _run(connection: socket.socket, streams: Sequence[int], call: _Call, context: _Context) -> None:
    """Run the script of one call in a fork, and send its exit status; never return."""
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    arguments, folder, environment = call
    for stream, handle in enumerate(streams):
        os.dup2(handle, stream)
        os.close(handle)
    _end_with(connection)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    sys.argv = arguments
    # `python SCRIPT` looks for modules there first.
    sys.path[0] = str(Path(arguments[0]).resolve().parent)

    def show_error(
        kind: type[BaseException], error: BaseException, at: TracebackType | None
    ) -> None:
        sys.__excepthook__(kind, error, at)
        sys.stderr.flush()
        connection.sendall(b"1")

    sys.excepthook = show_error
    with context:
        status = _status_of(arguments[0])
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    connection.sendall(str(status).encode())
    # To take all imported modules apart would take longer than most jobs.
    os._exit(status)


def _end_with(connection: socket.socket) -> None:
    """End this process as soon as the other end of the connection is gone."""
    # Windows has no such module.
    import fcntl

    # The kernel then sends SIGIO, which ends a process.
    fcntl.fcntl(connection, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(connection, fcntl.F_SETFL, fcntl.fcntl(connection, fcntl.F_GETFL) | os.O_ASYNC)
    # It sends nothing if the other end was gone before.
    if select.select([connection], [], [], 0)[0]:
        os._exit(1)


def _status_of(script: str) -> int:
    """Run a script as Python does, and return its exit status."""
    try:
        runpy.run_path(script, run_name="__main__")
    except SystemExit as ended:
        if isinstance(ended.code, str):
            print(ended.code, file=sys.stderr)
        return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    return 0


if __name__ == "__main__":
    serve(*json.loads(sys.argv[1]))
