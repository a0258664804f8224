"""List raw/, read and write files, and run a script with errors of one line.

The Snakefile and every script use this module, so it imports only fast modules.
"""

import contextlib
import csv
import errno
import hashlib
import io
import json
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import IO, Any

from capsule.errors import CapsuleError
from capsule.kinds import Row
from capsule.naming import Archive, Entry, classify, without_formula
from edges.garbage import collect_seldom
from edges.reading import read_limited, read_whole
from edges.records import Record, record_path

UNFINISHED = ".unfinished"
# The first line of the report from the start of a run until a new report is complete.
OUTDATED = (
    b'<p class="outdated" role="alert">This report is out of date: recordings, settings or code '
    b"have changed since. Make it again: <code>snakemake -c2 results/report.html</code></p>\n"
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
            for entry in os.scandir(folder):
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


def fingerprint(path: Path, max_bytes: int) -> str:
    """Return the SHA-256 of a file's content, which does not depend on its time stamp.

    Snakemake itself compares time stamps. If a file is renamed, copied or unpacked with its old
    time stamp, Snakemake does not notice that it replaces another one.

    Parameters
    ----------
    path : Path
        The file.
    max_bytes : int
        Limit of the size. A larger file is not read.

    Returns
    -------
    str
        The checksum, or a text that says why the file cannot be read.
    """
    try:
        content = read_limited(path, max_bytes)
        return hashlib.sha256(content).hexdigest() if content is not None else "too large"
    except OSError as error:
        return f"unreadable: {error.strerror}"


@contextlib.contextmanager
def write_whole(path: Path, mode: str = "w") -> Iterator[IO[Any]]:
    """Open a file for writing; the file appears under its name only when it is complete.

    The content is collected in memory and written to a temporary file, which is then renamed. If
    the process is killed, the file is either complete or unchanged.

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
        unfinished.replace(path)
    except OSError as error:
        # The error of a failed write does not name the file.
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        unfinished.unlink(missing_ok=True)


def remove_unfinished(folder: Path) -> None:
    """Remove the temporary files of processes that were killed."""
    for path in folder.rglob(f".*{UNFINISHED}"):
        path.unlink(missing_ok=True)


def mark_outdated(page: Path, *, outdated: bool) -> None:
    """Add the line "out of date" to a page, or remove it; the rest of the page does not change."""
    if not page.exists():
        return
    content = page.read_bytes()
    plain = content.replace(OUTDATED, b"")
    wanted = plain.replace(b"<body>\n", b"<body>\n" + OUTDATED, 1) if outdated else plain
    if wanted != content:
        with write_whole(page, "wb") as stream:
            stream.write(wanted)


def write_json(path: Path, content: object) -> None:
    """Write indented JSON; NaN raises an error, since JSON has no such number."""
    with write_whole(path) as stream:
        json.dump(content, stream, indent=1, allow_nan=False)
        stream.write("\n")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON file that an earlier step has written."""
    content: dict[str, Any] = json.loads(read_whole(path).decode("utf-8"))
    return content


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Row]) -> None:
    """Write a CSV table in full precision; the cell of an unknown value is empty.

    A text that begins like a formula is changed, so that no spreadsheet program runs it.
    """
    with write_whole(path) as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([_cell(row[name]) for name in columns] for row in rows)


def _cell(value: object) -> object:
    if isinstance(value, str):
        return without_formula(value)
    # Only NaN differs from itself.
    return "" if value is None or value != value else value


def read_csv(path: Path) -> list[dict[str, str]]:
    """Read a table that an earlier step has written; every cell is a text."""
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def accepted_recordings(index: Path) -> dict[str, dict[str, str]]:
    """Read the rows of the accepted recordings, in the order of their readings' checksums.

    The order must not depend on names. Sums in another order can differ in the last digit, and
    random numbers in another order belong to other recordings. Tables are written in the order of
    names.

    Parameters
    ----------
    index : Path
        results/recordings.csv.

    Returns
    -------
    dict of str to dict
        The rows, by the recording's name.
    """
    rows = [row for row in read_csv(index) if row["status"] == "accepted"]
    rows.sort(key=lambda row: row["readings_sha256"])
    return {row["recording"]: row for row in rows}


def run(main: Callable[[], None]) -> None:
    """Run a script; print an error of the input or of the disk as one line, without a traceback.

    At the end, a successful script prints its duration into its log, and the report adds the
    durations up. A rule calls its script with ``--record OUTPUT:KEY``. The files that the script
    reads and writes are then recorded (`edges.records`).
    """
    started = time.perf_counter()
    collect_seldom()
    told = None
    if "--record" in sys.argv:
        place = sys.argv.index("--record")
        told = sys.argv[place + 1]
        del sys.argv[place : place + 2]
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        if told:
            make_recorded(told, main)
        else:
            main()
        print(f"finished in {time.perf_counter() - started:.3f} s")
    except (CapsuleError, OSError) as error:
        sys.exit(error_line(error))


def make_recorded(made_from: str, make: Callable[[], None]) -> Record:
    """Make results, and write the record of the files that were read and written.

    Parameters
    ----------
    made_from : str
        The first output, a colon, and a checksum of settings, code and members.
    make : callable
        Makes the results.
    """
    record, path = Record(made_from), record_path(made_from.rpartition(":")[0])
    # If this job fails, its old record must not remain: it would call the results valid.
    path.unlink(missing_ok=True)
    with record.watch():
        make()
    write_json(path, record.content())
    return record


def error_line(error: CapsuleError | OSError) -> str:
    """Return an error of the input or of the disk as one line."""
    if isinstance(error, CapsuleError):
        return f"error: {error}"
    remedy = ""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        remedy = "; free some space and run again: finished results are kept"
    return f"error: {error.filename or 'disk'}: {error.strerror or error}{remedy}"
