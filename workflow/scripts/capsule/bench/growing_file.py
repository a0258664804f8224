"""Files that grow line by line; recordings get their final names only when they are complete."""

import contextlib
import errno
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from io import FileIO
from pathlib import Path

from capsule.bench.bench_errors import AcquisitionError, DiskFullError, NameExistsError
from capsule.bench.protocol import Damaged
from capsule.engine.jobs import lock_file
from capsule.recordings.names import PART

SYNC_EVERY_S = 1.0
RECOVER, RESUME = "capsule record --recover", "capsule survey --resume"
_LARGEST_LOG_BYTES = 50_000_000  # a faulty line must not fill the disk within days
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class GrowingFile:
    """A locked text file that grows line by line, ``<name>.part`` until it is complete.

    A killed program left a `resumed` file; then `go_on` must come before `flush`.

    Raises
    ------
    NameExistsError
        A complete or unfinished file of that name exists.
    DiskFullError
        The disk is full.
    AcquisitionError
        Another program is writing the file, or it cannot be written.
    """

    def __init__(
        self,
        final: Path,
        head: str,
        remedy: str = RECOVER,
        tell: Callable[[str], None] = print,
        *,
        resumed: bool = False,
    ) -> None:
        if not resumed:
            check_free(final)
        self.final, self._remedy, self._tell = final, remedy, tell
        self.path = final.with_name(final.name + PART)
        with writing(self.path, remedy):
            final.parent.mkdir(parents=True, exist_ok=True)
            exclusive = 0 if resumed else os.O_EXCL
            self._descriptor = open_locked(self.path, os.O_CREAT | exclusive)
        self._head_bytes = len(head.encode("utf-8"))
        self._pending = [head]
        self._synced_s = 0.0
        if not resumed:
            self.flush()
            self.sync()
            _sync_folder(final.parent)

    def add(self, line: str) -> None:
        """Add a line, which ends in a line feed; the next `flush` writes it."""
        self._pending.append(line)

    def repeated(self) -> int:
        """Return how many bytes of a resumed file the added lines repeat; the rest is new.

        Raises
        ------
        AcquisitionError
            The file has other lines.
        """
        added = "".join(self._pending).encode("utf-8")
        content = self.path.read_bytes()
        # What the disk has lost of the last lines is written again.
        same = min(len(added), content.rfind(b"\n") + 1)
        if added[:same] != content[:same]:
            raise AcquisitionError(
                f"{self.path} differs in the resumed session, so another version or other "
                "parameters made the file; it is unchanged. Start a new session with --out"
            )
        return same

    def go_on(self, repeated: int) -> None:
        """Drop what the added lines do not repeat, and go on behind it."""
        os.ftruncate(self._descriptor, repeated)
        os.lseek(self._descriptor, repeated, os.SEEK_SET)
        added = "".join(self._pending).encode("utf-8")
        self._pending = [added[repeated:].decode("utf-8")]

    def amend(self, head: str) -> None:
        """Write the first lines anew, in their place: the file is complete at any moment.

        Raises
        ------
        AcquisitionError
            The disk cannot be written.
        """
        new = head.encode("utf-8")
        if len(new) != self._head_bytes:
            raise ValueError(f"{head!r} does not have the length of the former first lines")
        with writing(self.path, self._remedy):
            end = os.lseek(self._descriptor, 0, os.SEEK_CUR)
            os.lseek(self._descriptor, 0, os.SEEK_SET)
            os.write(self._descriptor, new)
            os.lseek(self._descriptor, end, os.SEEK_SET)

    def flush(self) -> None:
        """Write the added lines to the file, so that a killed program does not lose them.

        Raises
        ------
        DiskFullError
            The disk is full; whole lines that fitted stay in the file.
        """
        content = "".join(self._pending).encode("utf-8")
        self._pending.clear()
        before = os.lseek(self._descriptor, 0, os.SEEK_CUR)
        written = 0
        with writing(self.path, self._remedy):
            try:
                while written < len(content):
                    written += os.write(self._descriptor, content[written:])
            except OSError:
                end = before + content.rfind(b"\n", 0, written) + 1
                os.ftruncate(self._descriptor, end)
                os.lseek(self._descriptor, end, os.SEEK_SET)
                raise

    def sync(self) -> None:
        """Write the file to the disk once a second, so that a power cut loses at most a second.

        Raises
        ------
        AcquisitionError
            The file has disappeared, and no other place for it can be written.
        """
        now_s = time.monotonic()
        if now_s - self._synced_s >= SYNC_EVERY_S:
            self._sync_now()
            self._synced_s = now_s

    def finish(self) -> Path:
        """Rename the file to its final name.

        Raises
        ------
        NameExistsError
            Another file has got the name meanwhile; this one keeps its unfinished name.
        """
        self.flush()
        self._sync_now()
        self.close()
        publish(self.path, self.final)
        return self.final

    def discard(self) -> None:
        """Remove a file that nobody needs."""
        self.close()
        self.path.unlink(missing_ok=True)

    def close(self) -> None:
        """Close the file under its unfinished name."""
        os.close(self._descriptor)

    def _sync_now(self) -> None:
        self._hold_place()
        with writing(self.path, self._remedy):
            os.fsync(self._descriptor)

    def _hold_place(self) -> None:
        """Copy all lines to a new file if the file or its folder was deleted or renamed."""
        with contextlib.suppress(OSError):  # the file does not exist
            if os.path.samestat(self.path.stat(), os.fstat(self._descriptor)):
                return
        lost = self.path
        fault: OSError | None = None
        for path in _places(self.path):
            try:
                copy = _copied(self._descriptor, path)
            except OSError as reason:
                fault = fault or reason
                continue
            os.close(self._descriptor)
            self._descriptor, self.path = copy, path
            self.final = path.with_name(path.name.removesuffix(PART))
            self._tell(
                f"warning: {lost} was deleted, renamed or replaced; all samples so "
                f"far were copied to {path}, and go on there"
            )
            return
        taken = "recordings of this name and of its alternative names exist"
        with writing(lost):
            raise fault or OSError(errno.EEXIST, taken)


class FrameLog:
    """A text file with one line per event, written at once; its faults never stop a recording."""

    def __init__(self, path: Path, show: Callable[[str], None] = print) -> None:
        self.path, self._show = path, show
        self._stream: FileIO | None = None
        self._room = _LARGEST_LOG_BYTES

    def tell(self, text: str) -> None:
        """Show a message to the user, and write it."""
        self._show(text)
        self.note(text)

    def note(self, text: str) -> None:
        """Write a line with the time and the text."""
        if self._room <= 0:
            return
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        line = f"{now} {text}\n".encode("utf-8", "backslashreplace")
        self._room -= len(line)
        try:
            if self._stream is None:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                # Not buffered: a failed write would otherwise fail again when the file is closed.
                self._stream = self.path.open("ab", buffering=0)
            self._stream.write(line)
            if self._room <= 0:
                limit = f"it has reached its limit of {_LARGEST_LOG_BYTES / 1e6:g} MB"
                raise OSError(errno.EFBIG, limit)
        except OSError as fault:
            self._room = 0
            why = f"its log {self.path}: {fault.strerror}"
            self._show(f"warning: recording continues without {why}")

    def damaged(self, piece: Damaged) -> None:
        """Write bytes that are not a whole frame, exactly and with the reason."""
        self.note(f"damaged, {piece.reason}: {piece.content!r}")

    def close(self) -> None:
        """Close the file; later lines are lost."""
        self._room = 0
        if self._stream is not None:
            self._stream.close()


def open_locked(path: Path, flags: int = 0) -> int:
    """Open a file, and lock it; return its descriptor.

    Raises
    ------
    AcquisitionError
        Another program is writing the file.
    """
    descriptor = os.open(path, os.O_RDWR | flags | getattr(os, "O_BINARY", 0), 0o666)
    try:
        lock_file(descriptor)
    except BlockingIOError as fault:
        os.close(descriptor)
        raise AcquisitionError(
            f"another program is writing {path}; stop that program first"
        ) from fault
    return descriptor


def _places(part: Path) -> Iterator[Path]:
    """Yield paths for an unfinished file: its own, others beside it, the temporary folder."""
    final = part.with_name(part.name.removesuffix(PART))
    names = (f"{final.stem}-{n}{final.suffix}{PART}" for n in range(2, 10))
    beside = [part, *map(part.with_name, names)]
    elsewhere = Path(tempfile.gettempdir()) / "capsule-recordings" / part.parent.name
    for path in (*beside, *(elsewhere / path.name for path in beside)):
        if not path.with_name(path.name.removesuffix(PART)).exists():
            yield path


def _copied(source: int, path: Path) -> int:
    """Copy an open file, even a deleted one, to a new one on the disk, which stays open."""
    path.parent.mkdir(parents=True, exist_ok=True)
    copy = open_locked(path, os.O_CREAT | os.O_EXCL)
    try:
        os.lseek(source, 0, os.SEEK_SET)
        while chunk := os.read(source, 1 << 20):
            while chunk:
                chunk = chunk[os.write(copy, chunk) :]
        os.fsync(copy)
    except OSError:
        os.close(copy)
        path.unlink()
        raise
    return copy


def check_free(final: Path) -> None:
    """Raise `NameExistsError` if a recording of that name exists."""
    if final.exists():
        raise NameExistsError(
            f"{final} exists; capsule record never overwrites a recording, so choose another --name"
        )
    part = final.with_name(final.name + PART)
    if part.exists():
        raise NameExistsError(
            f"{part} is an unfinished recording; complete it first: capsule record --recover"
        )


def unfinished(raw: Path) -> list[Path]:
    """Return the unfinished recordings under raw/."""
    return sorted(raw.glob(f"*/*{PART}"))


def publish(part: Path, final: Path) -> None:
    """Rename a file; raise `NameExistsError` instead of replacing a recording."""
    try:
        os.link(part, final)  # atomic, and fails where the name exists
    except OSError as fault:
        if final.exists():
            raise NameExistsError(
                f"{final} exists, so the samples are kept in {part.name}; rename one of the two "
                "files, then run: capsule record --recover"
            ) from fault
        part.rename(final)  # a file system without links, such as a USB stick's
    else:
        part.unlink()
    _sync_folder(final.parent)


def _sync_folder(folder: Path) -> None:
    if os.name == "posix":
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


@contextlib.contextmanager
def writing(path: Path, remedy: str = RECOVER) -> Iterator[None]:
    """Explain an `OSError` of what is written to a file; a full disk has its own class."""
    try:
        yield
    except OSError as fault:
        if fault.errno in _FULL:
            raise DiskFullError(
                f"the disk is full at {path}; the samples written so far are kept. Free some "
                f"space, then run: {remedy}"
            ) from fault
        raise AcquisitionError(f"{path} cannot be written: {fault.strerror}") from fault
