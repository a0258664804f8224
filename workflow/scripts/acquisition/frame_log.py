"""The log of a recording: what happened, and every frame that failed its check, byte for byte."""

from datetime import UTC, datetime
from pathlib import Path

from acquisition.archive import explain_write_fault
from acquisition.protocol import Damaged


class FrameLog:
    """A text file, one line an event, on disk as it happens."""

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._stream = path.open("a", encoding="utf-8", newline="\n")
        self.path = path

    def note(self, text: str) -> None:
        """Write what happened."""
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        try:
            self._stream.write(f"{now} {text}\n")
            self._stream.flush()
        except OSError as fault:
            raise explain_write_fault(fault, self.path) from fault

    def damaged(self, piece: Damaged) -> None:
        """Write bytes that are no whole frame, and why; they can be read back exactly."""
        self.note(f"damaged, {piece.reason}: {piece.content!r}")

    def close(self) -> None:
        """Close the file."""
        self._stream.close()
