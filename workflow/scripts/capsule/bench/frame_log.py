"""The log of a recording: events, and every damaged frame byte for byte."""

import errno
import os
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from capsule.bench.protocol import Damaged

LARGEST_BYTES = 50_000_000  # a faulty line must not fill the disk within days


class FrameLog:
    """A text file with one line per event, written at once; its faults never stop a recording.

    Parameters
    ----------
    path : Path
        The file; new lines are appended to its content.
    tell : callable, optional
        Function that shows a warning if the log can no longer be written.
    """

    def __init__(self, path: Path, tell: Callable[[str], None] = print) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Not buffered: a failed write would otherwise fail again when the file is closed.
        self._stream = path.open("ab", buffering=0)
        self._room = LARGEST_BYTES
        self._tell = tell
        self.path = path

    def note(self, text: str) -> None:
        """Write a line with the time and the text."""
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
        """Write bytes that are not a whole frame, exactly and with the reason."""
        self.note(f"damaged, {piece.reason}: {piece.content!r}")

    def close(self) -> None:
        """Close the file."""
        self._stream.close()
