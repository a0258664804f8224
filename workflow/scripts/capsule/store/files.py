"""List raw/, and read and write files.

The Snakefile and every script use this module, so it imports only fast modules.
"""

import contextlib
import csv
import errno
import hashlib
import io
import json
import os
import stat
import struct
import sys
import tokenize
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import IO, Any, TypeVar
from zipfile import BadZipFile

from capsule.engine.jobs import refuse_outdated_job
from capsule.errors import CapsuleError
from capsule.kinds import Row
from capsule.recordings.names import Archive, Entry, classify, displayed, without_formula

Read = TypeVar("Read")

UNFINISHED = ".unfinished"
_MOST_LETTERS = 200
_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
# What readers of JSON, tables and arrays raise at damaged bytes.
_DAMAGE = (
    ArithmeticError,
    BadZipFile,
    EOFError,
    LookupError,
    MemoryError,
    RuntimeError,
    SyntaxError,  # the header of an array is Python
    TypeError,
    ValueError,
    csv.Error,
    struct.error,
    tokenize.TokenError,
    zlib.error,
)


def list_archive(raw: Path) -> Archive:
    """Return the list of the recordings under raw/; open none of them."""
    if not raw.is_dir():
        raise CapsuleError(
            f"{raw}/ does not exist; create it and put recordings into folders such as {raw}/3mm/"
        )
    return classify(_entries(raw))


def _entries(raw: Path) -> Iterator[Entry]:
    root = raw.resolve()
    for folder in sorted(raw.iterdir()):
        kind = _kind(folder, root)
        yield Entry(folder.name, kind)
        if kind == "folder":
            with os.scandir(folder) as listed:
                for entry in listed:
                    # To list a folder already tells this, except for links.
                    is_file = entry.is_file(follow_symlinks=False) and os.access(entry, os.R_OK)
                    kind = "file" if is_file else _kind(Path(entry), root)
                    yield Entry(f"{folder.name}/{entry.name}", kind)


def _kind(path: Path, root: Path) -> str:
    try:
        # `exists` follows links, so a listed name that does not exist is a dead link or a loop.
        if not path.exists():
            return "dead link"
        # A link out of raw/ is not read: the report would show a file that only its owner may see.
        if path.is_symlink() and not path.resolve().is_relative_to(root):
            return "device" if _is_device(path) else "link out"
    except PermissionError:
        return "locked"
    if _is_device(path):
        return "device"
    if not os.access(path, os.R_OK):
        return "locked"
    return "folder" if path.is_dir() else "file"


def _is_device(path: Path) -> bool:
    return not (path.is_file() or path.is_dir())


def read_limited(path: Path | str, max_bytes: int) -> bytes | None:
    """Read a whole file without waiting for a pipe; return None if it is larger than the limit.

    Jobs read thousands of small files, and a stream takes longer than the reading itself.

    Raises
    ------
    OSError
        The file cannot be read, or is a pipe, a device or a folder.
    """
    with _opened(path) as (handle, size):
        content = b"" if size > max_bytes else _read(handle, size + 1, max_bytes + 1)
    # It may grow meanwhile.
    return None if max(size, len(content)) > max_bytes else content


def read_beginning(path: Path | str, most: int) -> bytes:
    """Read the first bytes of a file, at most this many; errors are those of `read_limited`."""
    with _opened(path) as (handle, _):
        return _read(handle, most, most)


@contextlib.contextmanager
def _opened(path: Path | str) -> Iterator[tuple[int, int]]:
    """Open a file without waiting for a pipe, and yield its handle and its size in bytes."""
    # A pipe may have replaced the file since it was listed, and opening a pipe can wait forever.
    handle = os.open(path, _FLAGS)
    try:
        status = os.fstat(handle)
        if stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "a pipe or a device, not a file", str(path))
        yield handle, status.st_size
    finally:
        os.close(handle)


def _read(handle: int, at_once: int, most: int) -> bytes:
    """Read at most so many bytes; one call of the system may not return all of them."""
    parts: list[bytes] = []
    while most > 0 and (part := os.read(handle, min(at_once, most))):
        parts.append(part)
        most -= len(part)
    return b"".join(parts)


def read_whole(path: Path | str) -> bytes:
    """Read a whole file that an earlier step has written, as `read_limited` does."""
    content = read_limited(path, sys.maxsize)
    assert content is not None
    return content


def fingerprint(path: Path, max_bytes: int) -> str:
    """Return the SHA-256 of a file's content, or a text that says why it cannot be read.

    It does not depend on the file's time stamp. A larger file than allowed is not read.
    """
    try:
        return fingerprint_of(read_limited(path, max_bytes))
    except OSError as error:
        return f"unreadable: {error.strerror}"


def fingerprint_of(content: bytes | None) -> str:
    """Return what `fingerprint` returns for a file from which `read_limited` returned this."""
    return "too large" if content is None else hashlib.sha256(content).hexdigest()


@contextlib.contextmanager
def write_whole(path: Path, mode: str = "w") -> Iterator[IO[Any]]:
    """Open a file for writing; the file appears under its name only when it is complete.

    The content is collected in memory and written to a temporary file, which is then renamed. If
    the process is killed, the file is either complete or unchanged. A job writes nothing any more
    if its run was killed and a later one has begun, or if its code has changed meanwhile.

    Parameters
    ----------
    path : Path
        The final name; its folder is created.
    mode : {"w", "wb"}
        Text (UTF-8, line feeds on every system) or binary.

    Yields
    ------
    file

    Raises
    ------
    OSError
        The file cannot be written; the error names it.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    content = io.BytesIO()
    # It keeps bytes, which take less memory than the letters of a text.
    text = io.TextIOWrapper(content, encoding="utf-8", newline="")
    yield content if "b" in mode else text
    text.flush()
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}{UNFINISHED}")
    try:
        with unfinished.open("wb") as stream:
            stream.write(content.getbuffer())
            stream.flush()
            # Without this, the file could be empty after a power cut.
            os.fsync(stream.fileno())
        refuse_outdated_job()
        unfinished.replace(path)
    except OSError as error:
        # The error of a failed write does not name the file.
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        unfinished.unlink(missing_ok=True)


def write_new(path: Path, content: bytes) -> None:
    """Write a new file; the name must be free.

    Raises
    ------
    FileExistsError
        A file with this name exists.
    OSError
        The file cannot be written; the error names it.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}.new")
    with write_whole(beside, "wb") as stream:
        stream.write(content)
    try:
        os.link(beside, path)  # atomic, and fails if the name exists
    except FileExistsError:
        raise
    except OSError:  # a file system without links, as on a USB stick
        path.open("xb").close()
        try:
            beside.replace(path)
        except OSError:
            path.unlink()
            raise
    finally:
        beside.unlink(missing_ok=True)


def write_json(path: Path, content: object) -> None:
    """Write indented JSON; NaN raises an error, since JSON has no such number."""
    with write_whole(path) as stream:
        json.dump(content, stream, indent=1, allow_nan=False)
        stream.write("\n")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON file that an earlier step has written."""
    content = json.loads(read_whole(path).decode("utf-8"))
    if not isinstance(content, dict):
        raise ValueError(f"it holds a {type(content).__name__}, and no keys")
    return content


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Row]) -> None:
    """Write a CSV table in full precision; the cell of an unknown value is empty.

    A text that begins like a formula is changed, so that no spreadsheet program runs it.
    """
    write_cells(path, columns, ([row[name] for name in columns] for row in rows))


def write_cells(path: Path, columns: Sequence[str], rows: Iterable[Iterable[object]]) -> None:
    """Write a CSV table as `write_csv` does, from rows of cells in the order of the columns."""
    with write_whole(path) as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([*map(_cell, row)] for row in rows)


def _cell(value: object) -> object:
    if isinstance(value, str):
        return without_formula(value)
    # Only NaN differs from itself.
    return "" if value is None or value != value else value


def read_csv(path: Path) -> list[dict[str, str]]:
    """Read a table that an earlier step has written; every cell is a text."""
    with path.open(encoding="utf-8", newline="") as stream:
        columns, *rows = csv.reader(stream)
    # A table that was cut short ends within a row.
    return [dict(zip(columns, row, strict=True)) for row in rows]


def accepted_recordings(index: Path) -> dict[str, dict[str, str]]:
    """Read the rows of the accepted recordings by name, in the order of their readings' checksums.

    The order must not depend on names. Sums in another order can differ in the last digit, and
    random numbers in another order belong to other recordings. Tables are written in the order of
    names.
    """
    listed = read_or_explain(index, read_csv)
    rows = [row for row in listed if row["status"] == "accepted"]
    rows.sort(key=lambda row: row["readings_sha256"])
    return {row["recording"]: row for row in rows}


def read_or_explain(path: Path, read: Callable[[Path], Read]) -> Read:
    """Read a file of the results; if it is missing or damaged, the error tells how to make it."""
    try:
        return read(path)
    except FileNotFoundError:
        raise CapsuleError(
            f"{path} does not exist; make all that is missing: snakemake -c2"
        ) from None
    except (*_DAMAGE, OSError) as error:
        # The error of a file that cannot be opened names it; that of a place in it does not.
        if isinstance(error, OSError) and error.filename:
            raise
        raise CapsuleError(
            f"{path} is damaged ({in_short(error)}); delete it, and make it again: snakemake -c2"
        ) from None


def in_short(error: BaseException) -> str:
    """Return the text of an error of a library in one line of some length."""
    text = displayed(" ".join(str(error).split()))
    return text if len(text) <= _MOST_LETTERS else f"{text[:_MOST_LETTERS]}..."
