"""A text file that grows line by line, and gets its final name only when it is complete."""

import os
from pathlib import Path

from capsule.bench.archive import explain_write_fault, publish, writing
from capsule.bench.bench_errors import AcquisitionError
from capsule.locks import lock_file
from capsule.names import PART

REMEDY = "capsule survey --resume"


class GrowingFile:
    """A text file that grows line by line, ``<name>.part`` until it is complete.

    The file may hold lines of a killed session. Added lines are first compared with these, and not
    written again.

    Parameters
    ----------
    final : Path
        Path of the complete file.

    Raises
    ------
    AcquisitionError
        Another program is writing the file, or it cannot be written.
    """

    def __init__(self, final: Path) -> None:
        self._final = final
        self._path = final.with_name(final.name + PART)
        flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0)
        try:
            self._descriptor = os.open(self._path, flags, 0o666)
            lock_file(self._descriptor)
        except BlockingIOError as fault:
            raise AcquisitionError(
                f"another program is writing {self._path}; stop that program first"
            ) from fault
        except OSError as fault:
            raise explain_write_fault(fault, self._path, REMEDY) from fault
        content = self._path.read_bytes()
        # The session adds an incomplete last line again.
        whole = content.rfind(b"\n") + 1
        os.ftruncate(self._descriptor, whole)
        os.lseek(self._descriptor, whole, os.SEEK_SET)
        self._known = content[:whole].splitlines(keepends=True)
        self._compared = 0
        self._pending: list[bytes] = []

    @property
    def caught_up(self) -> bool:
        """Return whether all stored lines were added again."""
        return self._compared == len(self._known)

    def add(self, text: str) -> None:
        """Add one line, which ends in a line feed; the next `flush` writes it.

        Raises
        ------
        AcquisitionError
            The line differs from the stored one.
        """
        line = text.encode("utf-8")
        if self.caught_up:
            self._pending.append(line)
            return
        if line != self._known[self._compared]:
            raise AcquisitionError(
                f"{self._path}: line {self._compared + 1} differs in the resumed session, so "
                "another version or other parameters made the file; it is unchanged. Start a new "
                "session with --out"
            )
        self._compared += 1

    def cut(self) -> None:
        """Drop the stored lines that were not added again."""
        kept = b"".join(self._known[: self._compared])
        os.ftruncate(self._descriptor, len(kept))
        os.lseek(self._descriptor, len(kept), os.SEEK_SET)
        self._known = self._known[: self._compared]

    def flush(self) -> None:
        """Write the added lines to the file."""
        content = b"".join(self._pending)
        self._pending.clear()
        with writing(self._path, REMEDY):
            while content:
                content = content[os.write(self._descriptor, content) :]

    def sync(self) -> None:
        """Write the file to the disk."""
        with writing(self._path, REMEDY):
            os.fsync(self._descriptor)

    def finish(self) -> None:
        """Rename the file to its final name."""
        self.flush()
        self.sync()
        self.close()
        publish(self._path, self._final)

    def close(self) -> None:
        """Close the file under its present name."""
        os.close(self._descriptor)
