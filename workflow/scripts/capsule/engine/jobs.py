"""Run a job, or a command, in one line an error; let only one run at a time use a folder.

Snakemake's own lock is a file. After `kill -9` or a power cut the file stays, and the user has to
remove it. A lock of the operating system always ends with the process that holds it.

The jobs of a killed run may go on for a while. Each run writes its name into the locked file and
hands it to its jobs. A job whose name is no longer in the file writes no result.

What a job runs is what its key was computed from: a run notes the state of each file of its code
when it reads it, and a job whose code has another state writes no result. The state of a file
differs also when it was changed and put back in between, with its dates.

The Snakefile and every script use this module, so it imports only fast modules.
"""

import contextlib
import io
import json
import os
import secrets
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import IO

from capsule.errors import CapsuleError, error_line

# The file that a run locks, in the working directory, and the variable that names it to the jobs.
RUN_LOCK = Path(".snakemake/run.lock")
_RUN = "CAPSULE_RUN"
# There, too: the state of each file that a script's key was computed from, by the script.
STATES = Path(".snakemake/run.code")

# Below the traceback of an error that is neither of the input nor of the disk.
FAULT = (
    "This is a fault of the program: report it with all lines above. Only if somebody has changed "
    "a file under results/, remove results/, and make it again: snakemake -c2"
)
State = list[int]

if sys.platform == "win32":
    import msvcrt

    # Other processes cannot read a byte that is locked on Windows, so the locked byte lies far
    # behind the end of any file.
    _LOCKED_BYTE = 2**31 - 2

    def lock_file(descriptor: int) -> None:
        """Lock a file for as long as it is open."""
        position = os.lseek(descriptor, 0, os.SEEK_CUR)
        os.lseek(descriptor, _LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except PermissionError as fault:
            raise BlockingIOError(*fault.args) from fault
        finally:
            os.lseek(descriptor, position, os.SEEK_SET)

else:
    import fcntl

    def lock_file(descriptor: int) -> None:
        """Lock a file for as long as it is open.

        The locked files hold data. Libraries do not fit that: `filelock` empties the file that it
        locks, and `portalocker` locks the whole file on Windows, so that nobody can read it.

        Parameters
        ----------
        descriptor : int
            Descriptor of the open file.

        Raises
        ------
        BlockingIOError
            Another process holds the lock.
        OSError
            The file system does not support locks.
        """
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def hold_run_lock(path: Path = RUN_LOCK) -> IO[bytes]:
    """Take the lock of a folder, and name this run to its jobs; an error names who holds it.

    The lock ends with the returned file, and with this process. The file that carries it stays.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    stream = path.open("a+b")
    try:
        lock_file(stream.fileno())
    except BlockingIOError:
        stream.close()
        raise CapsuleError(
            f"another run uses this folder ({_holder(path)}), and only one can use it at a time; "
            "wait until it has ended"
        ) from None
    except OSError as error:
        print(
            f"warning: {path}: this file system does not support locks ({error.strerror}); "
            "make sure that only one run at a time uses this folder",
            file=sys.stderr,
        )
    name = (
        f"process {os.getpid()} on {socket.gethostname()}, "
        f"since {time.strftime('%Y-%m-%d %H:%M:%S')}, run {secrets.token_hex(4)}"
    )
    stream.truncate(0)
    stream.write(f"{name}\n".encode())
    stream.flush()
    os.environ[_RUN] = name
    return stream


def states_of(paths: Iterable[Path]) -> dict[str, State]:
    """Return the state of each file, whose path must be absolute."""
    return {str(path): _state(path) for path in paths}


def _state(path: Path) -> State:
    """Return what a change of a file changes, even if it is undone; all zeros without the file."""
    try:
        found = path.stat()
    except FileNotFoundError:
        return [0, 0, 0, 0]
    return [found.st_mtime_ns, found.st_ctime_ns, found.st_size, found.st_ino]


def refuse_outdated_job() -> None:
    """Raise an error if this is a job whose result nobody wants, or nobody would know.

    Its run was killed, and another one has begun, which makes the result again; or code of its
    script has changed since the run noted its state.
    """
    name = os.environ.get(_RUN)
    if not name:
        return
    if (holder := _holder(RUN_LOCK)) not in (name, ""):
        raise CapsuleError(
            f"the run of this job ({name}) was killed, and {holder} has begun since; this job "
            "writes nothing"
        )
    noted: Mapping[str, Mapping[str, State]] = {}
    with contextlib.suppress(FileNotFoundError):
        noted = json.loads(STATES.read_bytes())
    for path, before in noted.get(str(Path(sys.argv[0]).resolve()), {}).items():
        if _state(Path(path)) != before:
            raise CapsuleError(
                f"{path} has changed since the run began, so nobody knows which of both this job "
                "has read; run the command again"
            )


def _holder(path: Path) -> str:
    """Return the run that took a lock last; empty if no run can be read there."""
    with contextlib.suppress(OSError):
        return path.read_text(encoding="utf-8", errors="replace").strip()
    return ""


def run(main: Callable[[], int | None]) -> None:
    """Run a script or a command; the program ends with its exit status (None: 0).

    An error of the input or of the disk is one line, without a traceback. A fault of the program
    keeps its traceback, and says that it is one. Ctrl-C ends the program with status 130.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        if os.environ.get(_RUN):  # a job of a run, which its shell has made deaf to Ctrl-C
            signal.signal(signal.SIGINT, signal.default_int_handler)
        status = main()
        if status:
            sys.exit(status)
    except KeyboardInterrupt:
        sys.exit(130)
    except CapsuleError as error:
        print(error_line(error), file=sys.stderr)
        sys.exit(error.status)
    except BrokenPipeError:
        # The program that reads the output, such as `head`, wants no more. Python would fail once
        # more when it closes the stream.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(141)
    except OSError as error:
        sys.exit(error_line(error))
    except Exception as error:
        error.add_note(FAULT)
        raise
