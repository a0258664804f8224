"""Checksums of files, as a process finds them first and as they are later.

The Snakefile and every script use this module, so it imports only fast modules.
"""

import hashlib
import os
import time
from pathlib import Path

from edges.reading import read_limited

# For a larger file, the size replaces the checksum.
_LARGEST_BYTES = 100_000_000
# A file that changed so shortly before it was read could change again without a new time stamp.
_SETTLED_NS = 2_000_000_000

# Place, size and times of a file. Its last change counts even if somebody sets the time stamp back.
Stamp = tuple[int, int, int, int]


def checksum(path: Path | str) -> str | None:
    """Return the SHA-256 of a file; None if the file does not exist or cannot be read."""
    try:
        content = read_limited(path, _LARGEST_BYTES)
        if content is None:
            return f"{Path(path).stat().st_size} bytes"
        return checksum_of(content)
    except OSError:
        return None


def checksum_of(content: bytes) -> str:
    """Return what `checksum` returns for a file with this content."""
    if len(content) > _LARGEST_BYTES:
        return f"{len(content)} bytes"
    return hashlib.sha256(content).hexdigest()


class Checksums:
    """Checksums of files that a process asks for at its start, and again at its end."""

    def __init__(self) -> None:
        self._first: dict[str, tuple[Stamp | None, str | None]] = {}

    def first(self, name: str) -> str | None:
        """Return a file's checksum, as it was when this was first asked for."""
        if name not in self._first:
            # Before the file is read: what changes it later also changes the stamp.
            stamp = _settled_stamp(name)
            self._first[name] = stamp, checksum(name)
        return self._first[name][1]

    def now(self, name: str) -> str | None:
        """Return a file's checksum; an unchanged file is not read again."""
        stamp, found = self._first.get(name, (None, None))
        return found if stamp is not None and stamp == _settled_stamp(name) else checksum(name)

    def forget(self) -> None:
        """Read every file again."""
        self._first.clear()


def _settled_stamp(name: str) -> Stamp | None:
    """Return a file's stamp; None if it is missing, or has changed a moment ago."""
    try:
        # For thousands of files, a Path would take longer than the call.
        status = os.stat(name)  # noqa: PTH116
    except OSError:
        return None
    if time.time_ns() - max(status.st_mtime_ns, status.st_ctime_ns) < _SETTLED_NS:
        return None
    return status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns
