"""Recordings on disk; a recording gets its final name only when it is complete."""

import contextlib
import errno
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from capsule.bench.bench_errors import AcquisitionError, DiskFullError, NameExistsError
from capsule.locks import lock_file
from capsule.names import PART
from capsule.recording import format_header, format_sample

SYNC_EVERY_S = 1.0
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class PartFile:
    """A recording in progress: ``<name>.csv.part`` until it is complete.

    Parameters
    ----------
    final : Path
        Path of the complete recording.
    header : mapping of str to str
        Header of the recording.
    sensors : int
        Number of sensors S.
    tell : callable, optional
        Function that shows a warning if the recording continues in another file.

    Raises
    ------
    NameExistsError
        A complete or unfinished recording of that name exists.
    DiskFullError
        The disk is full.
    """

    def __init__(
        self,
        final: Path,
        header: Mapping[str, str],
        sensors: int,
        tell: Callable[[str], None] = print,
    ) -> None:
        self._tell = tell
        self.final = final
        self.path = final.with_name(final.name + PART)
        self._sensors = sensors
        self._pending: list[str] = []
        self._length = 0
        self._synced_s = 0.0
        check_free(final)
        try:
            self._descriptor = _create(self.path)
        except FileExistsError as fault:
            raise NameExistsError(_unfinished_text(self.path)) from fault
        except OSError as fault:
            raise explain_write_fault(fault, self.path) from fault
        self._pending.append(format_header(header, sensors))
        self.flush()
        self.sync()
        _sync_folder(final.parent)

    def add(self, time_s: float, values: Sequence[float] | None) -> None:
        """Add a sample; None is a missing one. The next `flush` writes it."""
        self._pending.append(format_sample(time_s, values, self._sensors))

    def flush(self) -> None:
        """Write the added samples to the file, so that a killed recorder does not lose them.

        Raises
        ------
        DiskFullError
            The disk is full; whole lines that fitted stay in the file.
        """
        if not self._pending:
            return
        content = "".join(self._pending).encode("utf-8")
        self._pending.clear()
        written = 0
        try:
            while written < len(content):
                written += os.write(self._descriptor, content[written:])
        except OSError as fault:
            whole_lines = content.rfind(b"\n", 0, written) + 1
            os.ftruncate(self._descriptor, self._length + whole_lines)
            raise explain_write_fault(fault, self.path) from fault
        self._length += len(content)

    def sync(self) -> None:
        """Write the file to the disk once a second, so that a power cut loses at most a second.

        Raises
        ------
        AcquisitionError
            The file has disappeared, and no other place for it can be written.
        """
        now_s = time.monotonic()
        if now_s - self._synced_s >= SYNC_EVERY_S:
            self._hold_place()
            self._sync_now()
            self._synced_s = now_s

    def _sync_now(self) -> None:
        with writing(self.path):
            os.fsync(self._descriptor)

    def _hold_place(self) -> None:
        """Copy all samples to a new file if the file or its folder was deleted or renamed."""
        try:
            if os.path.samestat(self.path.stat(), os.fstat(self._descriptor)):
                return
        except OSError:
            pass  # the file does not exist
        lost = self.path
        fault: OSError | None = None
        for path in _places(self.path):
            try:
                copy = _create(path)
            except OSError as reason:
                fault = fault or reason
                continue
            try:
                _copy(self._descriptor, copy)
            except OSError as reason:
                fault = fault or reason
                os.close(copy)
                path.unlink()
                continue
            os.close(self._descriptor)
            self._descriptor, self.path = copy, path
            self.final = path.with_name(path.name.removesuffix(PART))
            self._tell(
                f"warning: {lost} was deleted, renamed or replaced; the recorder has copied all "
                f"samples so far to {path}, and the recording continues there"
            )
            return
        fault = fault or OSError(
            errno.EEXIST, "recordings of this name and of its alternative names exist"
        )
        raise explain_write_fault(fault, lost) from fault

    def finish(self) -> Path:
        """Rename the recording to its final name.

        Raises
        ------
        NameExistsError
            Another recording has got the name meanwhile; this one keeps its unfinished name.
        """
        self.flush()
        self._hold_place()
        self._sync_now()
        self.close()
        publish(self.path, self.final)
        return self.final

    def discard(self) -> None:
        """Remove a recording that holds no sample."""
        self.close()
        self.path.unlink(missing_ok=True)

    def close(self) -> None:
        """Close the file under its unfinished name."""
        os.close(self._descriptor)


def _create(path: Path) -> int:
    """Create and lock a new file, with its folder; return its descriptor."""
    path.parent.mkdir(parents=True, exist_ok=True)
    flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    descriptor = os.open(path, flags, 0o666)
    lock_file(descriptor)
    return descriptor


def _places(part: Path) -> Iterator[Path]:
    """Yield paths for an unfinished recording: its own, others beside it, the temporary folder."""
    name = part.name.removesuffix(f".csv{PART}")
    beside = [part, *(part.with_name(f"{name}-{n}.csv{PART}") for n in range(2, 10))]
    elsewhere = Path(tempfile.gettempdir()) / "capsule-recordings" / part.parent.name
    for path in (*beside, *(elsewhere / path.name for path in beside)):
        if not path.with_name(path.name.removesuffix(PART)).exists():
            yield path


def _copy(source: int, target: int) -> None:
    """Copy an open file, even a deleted one, and write the copy to the disk."""
    os.lseek(source, 0, os.SEEK_SET)
    while chunk := os.read(source, 1 << 20):
        while chunk:
            chunk = chunk[os.write(target, chunk) :]
    os.fsync(target)


def check_free(final: Path) -> None:
    """Raise `NameExistsError` if a recording of that name exists."""
    if final.exists():
        raise NameExistsError(
            f"{final} exists; capsule record never overwrites a recording, so choose another --name"
        )
    part = final.with_name(final.name + PART)
    if part.exists():
        raise NameExistsError(_unfinished_text(part))


def unfinished(raw: Path) -> list[Path]:
    """Return the unfinished recordings under raw/."""
    return sorted(raw.glob(f"*/*{PART}"))


def publish(part: Path, final: Path) -> None:
    """Rename a file; raise `NameExistsError` instead of replacing a recording."""
    try:
        os.link(part, final)  # atomic, and fails where the name exists
    except FileExistsError as fault:
        raise NameExistsError(
            f"{final} exists, so the samples are kept in {part.name}; rename one of the two "
            "files, then run: capsule record --recover"
        ) from fault
    except OSError:  # a file system without links, such as a USB stick's
        if final.exists():
            raise NameExistsError(
                f"{final} exists, so the samples are kept in {part.name}; rename one of the two "
                "files, then run: capsule record --recover"
            ) from None
        part.rename(final)
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


def _unfinished_text(part: Path) -> str:
    return f"{part} is an unfinished recording; complete it first: capsule record --recover"


@contextlib.contextmanager
def writing(path: Path, remedy: str = "capsule record --recover") -> Iterator[None]:
    """Raise `explain_write_fault` in place of an `OSError` of what is written to a file."""
    try:
        yield
    except OSError as fault:
        raise explain_write_fault(fault, path, remedy) from fault


def explain_write_fault(
    fault: OSError, path: Path, remedy: str = "capsule record --recover"
) -> AcquisitionError:
    """Return the error for a failed write; a full disk has its own class, with a remedy."""
    if fault.errno in _FULL:
        return DiskFullError(
            f"the disk is full at {path}; the samples written so far are kept. Free some space, "
            f"then run: {remedy}"
        )
    return AcquisitionError(f"{path} cannot be written: {fault.strerror}")
