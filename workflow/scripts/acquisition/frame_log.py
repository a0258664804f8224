"""The log of a recording: what happened, and every frame that failed its check, byte for byte."""

import errno
import os
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from acquisition.protocol import Damaged

LARGEST_BYTES = 50_000_000  # a line that sends nonsense for days must not fill the disk


class FrameLog:
    """A text file, one line an event, on disk as it happens; samples never wait for it.

    Parameters
    ----------
    path : Path
        The file; what is in it stays.
    tell : callable, optional
        Is told when the log cannot be written any more.
    """

    def __init__(self, path: Path, tell: Callable[[str], None] = print) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Not buffered: what could not be written would come up again at the end.
        self._stream = path.open("ab", buffering=0)
        self._room = LARGEST_BYTES
        self._tell = tell
        self.path = path

    def note(self, text: str) -> None:
        """Write what happened."""
        if self._room <= 0:
            return
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        line = f"{now} {text}\n".encode("utf-8", "backslashreplace")
        self._room -= len(line)
        fault = ""
        try:
            if self._stream.write(line) != len(line):
                fault = os.strerror(errno.ENOSPC)
        except OSError as reason:
            fault = str(reason.strerror)
        if not fault and self._room <= 0:
            fault = f"it has reached its limit of {LARGEST_BYTES / 1e6:g} MB"
        if fault:
            self._room = 0
            self._tell(f"warning: recording continues without its log {self.path}: {fault}")

    def damaged(self, piece: Damaged) -> None:
        """Write bytes that are no whole frame, and why; they can be read back exactly."""
        self.note(f"damaged, {piece.reason}: {piece.content!r}")

    def close(self) -> None:
        """Close the file."""
        self._stream.close()
