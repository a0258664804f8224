"""Lock a folder, so that only one run can use it at a time.

Snakemake's own lock is a file. After `kill -9` or a power cut the file stays, and the user has to
remove it. A lock of the operating system always ends with the process that holds it. The jobs that
a killed run has left in Slurm hold the folder, too, until they have ended.

The Snakefile uses this module, so it imports only fast modules.
"""

import contextlib
import os
import socket
import sys
import time
from pathlib import Path
from typing import IO

from capsule.errors import CapsuleError
from edges.file_lock import lock_file
from edges.slurm_jobs import unfinished_jobs


def hold(path: Path) -> IO[bytes]:
    """Take the lock of a folder until this process ends.

    Parameters
    ----------
    path : Path
        The file that carries the lock; it is created, and stays.

    Returns
    -------
    binary file
        The open file; the lock ends when this file is closed.

    Raises
    ------
    CapsuleError
        Another process holds the lock, or Slurm still runs jobs of a killed run; the message names
        them.
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
    if jobs := unfinished_jobs(path.absolute().parents[1]):
        stream.close()
        raise CapsuleError(
            f"Slurm jobs of a run that was killed still use this folder ({', '.join(jobs)}); wait "
            f"until they have ended, or end them: scancel {' '.join(jobs)}"
        )
    stream.truncate(0)
    stream.write(
        f"process {os.getpid()} on {socket.gethostname()}, "
        f"since {time.strftime('%Y-%m-%d %H:%M:%S')}\n".encode()
    )
    stream.flush()
    return stream


def is_held(path: Path) -> bool:
    """Return whether a process, or a Slurm job of a killed run, holds a folder."""
    if not path.exists():
        return False
    if unfinished_jobs(path.absolute().parents[1]):
        return True
    with path.open("rb+") as stream:
        try:
            lock_file(stream.fileno())
        except BlockingIOError:
            return True
        except OSError:
            # The file system does not support locks; `hold` prints a warning.
            return False
    return False


def _holder(path: Path) -> str:
    text = ""
    with contextlib.suppress(OSError):
        text = path.read_text(encoding="utf-8", errors="replace").strip()
    return text or "unknown process"
