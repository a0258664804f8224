"""A text file that grows line by line, and has its name only when it is whole."""

import os
from pathlib import Path

from acquisition.archive import explain_write_fault, publish
from acquisition.bench_errors import AcquisitionError
from capsule.naming import PART
from edges.file_lock import lock_file

REMEDY = "survey.py --resume"


class GrowingFile:
    """A text file that grows line by line, ``<name>.part`` until it is whole.

    Lines that are there already, because an earlier session was killed, are compared with those
    that are added, and not written again.

    Parameters
    ----------
    final : Path
        Its name when it is whole.

    Raises
    ------
    AcquisitionError
        Another program is writing it, or it cannot be written.
    """

    def __init__(self, final: Path) -> None:
        self._final = final
        self._path = final.with_name(final.name + PART)
        flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0)
        try:
            self._descriptor = os.open(self._path, flags, 0o666)
            lock_file(self._descriptor)
        except BlockingIOError as fault:
            raise AcquisitionError(f"{self._path} is being written by another program") from fault
        except OSError as fault:
            raise explain_write_fault(fault, self._path, REMEDY) from fault
        content = self._path.read_bytes()
        # A line that a power cut has cut off was never whole, and comes again.
        whole = content.rfind(b"\n") + 1
        os.ftruncate(self._descriptor, whole)
        os.lseek(self._descriptor, whole, os.SEEK_SET)
        self._known = content[:whole].splitlines(keepends=True)
        self._compared = 0
        self._pending: list[bytes] = []

    @property
    def caught_up(self) -> bool:
        """Whether all that was there has come again."""
        return self._compared == len(self._known)

    def add(self, text: str) -> None:
        """Add one line, which ends in a line feed; it is written by the next `flush`.

        Raises
        ------
        AcquisitionError
            It differs from the one that is there.
        """
        line = text.encode("utf-8")
        if self.caught_up:
            self._pending.append(line)
            return
        if line != self._known[self._compared]:
            raise AcquisitionError(
                f"{self._path}: line {self._compared + 1} would differ if the session were taken "
                "up again; it was made by another version or with other parameters. It is left as "
                "it is"
            )
        self._compared += 1

    def cut(self) -> None:
        """Drop the lines that were there and have not come again; what follows is new."""
        kept = b"".join(self._known[: self._compared])
        os.ftruncate(self._descriptor, len(kept))
        os.lseek(self._descriptor, len(kept), os.SEEK_SET)
        self._known = self._known[: self._compared]

    def flush(self) -> None:
        """Hand what was added to the operating system."""
        content = b"".join(self._pending)
        self._pending.clear()
        try:
            while content:
                content = content[os.write(self._descriptor, content) :]
        except OSError as fault:
            raise explain_write_fault(fault, self._path, REMEDY) from fault

    def sync(self) -> None:
        """Have the disk keep what was flushed."""
        try:
            os.fsync(self._descriptor)
        except OSError as fault:
            raise explain_write_fault(fault, self._path, REMEDY) from fault

    def finish(self) -> None:
        """Give it its name."""
        self.flush()
        self.sync()
        self.close()
        publish(self._path, self._final)

    def close(self) -> None:
        """Leave it as it is."""
        os.close(self._descriptor)
