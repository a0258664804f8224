"""Read a whole file up to a size limit, without waiting for a pipe or a device.

The Snakefile and every script use this module, so it imports only fast modules.
"""

import errno
import os
import stat
from pathlib import Path


def _open_without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def read_limited(path: Path | str, max_bytes: int) -> bytes | None:
    """Read a whole file; return None if it is larger than the limit.

    Raises
    ------
    OSError
        The file cannot be read, or is a pipe, a device or a folder.
    """
    # A pipe may have replaced the file since it was listed, and opening a pipe can wait forever.
    with open(path, "rb", opener=_open_without_waiting) as stream:
        status = os.fstat(stream.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "a pipe or a device, not a file", str(path))
        if status.st_size > max_bytes:
            return None
        content = stream.read(status.st_size + 1)
        if len(content) > status.st_size:
            # The file has grown since it was opened.
            content += stream.read(max_bytes + 1 - len(content))
        return None if len(content) > max_bytes else content
