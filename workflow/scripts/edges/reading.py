"""Reading a file whole, with a bound, and without waiting for what is no file.

Imports nothing heavy: the Snakefile and every script use it.
"""

import errno
import os
import stat
from pathlib import Path


def _open_without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def read_limited(path: Path, max_bytes: int) -> bytes | None:
    """Read a file whole, or tell by None that it is larger; no larger one is taken in.

    Raises
    ------
    OSError
        It cannot be read, or is no file but a pipe, a device or a folder.
    """
    # What was a file when it was listed may be a pipe by now, and opening one waits for ever.
    with open(path, "rb", opener=_open_without_waiting) as stream:
        if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
            raise OSError(errno.EINVAL, "a pipe or a device, not a file", str(path))
        content = stream.read(max_bytes + 1) if path.stat().st_size <= max_bytes else b""
        if len(content) > max_bytes or path.stat().st_size > max_bytes:
            return None
        return content
