"""Read a whole file, without a stream and without waiting for a pipe or a device.

Jobs read thousands of small files, and a stream takes longer than the reading itself. What has been
read is told as the event `READ` of Python's audit, from which a job's record takes the checksum of
the file.

The Snakefile and every script use this module, so it imports only fast modules.
"""

import errno
import os
import stat
import sys
from pathlib import Path

# Its arguments are the path and the content; None stands for a content that was not read.
READ = "capsule.read"
_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)


def read_limited(path: Path | str, max_bytes: int) -> bytes | None:
    """Read a whole file; return None if it is larger than the limit.

    Raises
    ------
    OSError
        The file cannot be read, or is a pipe, a device or a folder.
    """
    content = None
    try:
        content = _read(path, max_bytes)
    finally:
        sys.audit(READ, path, content)
    return content


def read_whole(path: Path | str) -> bytes:
    """Read a whole file that an earlier step has written, as `read_limited` does."""
    content = read_limited(path, sys.maxsize)
    assert content is not None
    return content


def _read(path: Path | str, max_bytes: int) -> bytes | None:
    # A pipe may have replaced the file since it was listed, and opening a pipe can wait forever.
    handle = os.open(path, _FLAGS)
    try:
        status = os.fstat(handle)
        if stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "a pipe or a device, not a file", str(path))
        parts: list[bytes] = []
        missing = max_bytes + 1
        # It may grow meanwhile, and one call may not return all of it.
        while status.st_size <= max_bytes and missing > 0:
            part = os.read(handle, min(status.st_size + 1, missing))
            if not part:
                return b"".join(parts)
            parts.append(part)
            missing -= len(part)
        return None
    finally:
        os.close(handle)
