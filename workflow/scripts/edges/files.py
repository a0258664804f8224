"""Where the library meets the disk: listing raw/, writing files whole, one style of error.

Imports nothing heavy: the Snakefile and every script use it.
"""

import contextlib
import csv
import errno
import gc
import hashlib
import io
import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import IO, Any

from capsule.errors import CapsuleError
from capsule.kinds import Row
from capsule.naming import Archive, Entry, classify, without_formula
from edges.reading import read_limited
from edges.records import Record, record_path

UNFINISHED = ".unfinished"
# Objects that come to be between two searches for garbage; Python's own 700 are for long runs.
_SELDOM = 100_000
# Seen first on a page whose successor was begun and is not there.
OUTDATED = (
    b'<p class="outdated" role="alert">This report is out of date: recordings, settings or code '
    b"have changed since. Make it again: <code>snakemake -c2 results/report.html</code></p>\n"
)


def list_archive(raw: Path) -> Archive:
    """List the recordings under raw/, without opening any."""
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
            for entry in folder.iterdir():
                yield Entry(f"{folder.name}/{entry.name}", _kind(entry, root))


def _kind(path: Path, root: Path) -> str:
    try:
        # Links are followed, so what is not there is a link that leads nowhere, or to itself.
        if not path.exists():
            return "dead link"
        # Nothing of it is read: a page would show to all what one user may see.
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
    """Give what changes when a file's content changes, and only then.

    Snakemake alone goes by the time stamp: a file that is renamed, or copied or unpacked with
    its old time stamp, would replace another one unnoticed.

    Parameters
    ----------
    path : Path
        The file.
    max_bytes : int
        Of a larger file only the size counts; no such recording is ever read.

    Returns
    -------
    str
    """
    try:
        content = read_limited(path, max_bytes)
        return hashlib.sha256(content).hexdigest() if content is not None else "too large"
    except OSError as error:
        return f"unreadable: {error.strerror}"


@contextlib.contextmanager
def write_whole(path: Path, mode: str = "w") -> Iterator[IO[Any]]:
    """Open a file for writing that appears under its name only when it is complete.

    The content is collected in memory, written beside the final name, and renamed: whenever the
    process is killed, the name stands for nothing or for all of it.

    Parameters
    ----------
    path : Path
        The final name; its folder is made.
    mode : {"w", "wb"}
        Text (UTF-8, line feeds on every system) or binary.

    Yields
    ------
    file

    Raises
    ------
    OSError
        Names the file.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    buffer: io.BytesIO | io.StringIO = io.BytesIO() if "b" in mode else io.StringIO()
    yield buffer
    content = buffer.getvalue()
    if isinstance(content, str):
        content = content.encode("utf-8")
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}{UNFINISHED}")
    try:
        with unfinished.open("wb") as stream:
            stream.write(content)
            stream.flush()
            # Or a power cut could leave the name with nothing behind it.
            os.fsync(stream.fileno())
        unfinished.replace(path)
    except OSError as error:
        # A failed write names no file by itself.
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        unfinished.unlink(missing_ok=True)


def remove_unfinished(folder: Path) -> None:
    """Remove what writers that were killed have left behind."""
    for path in folder.rglob(f".*{UNFINISHED}"):
        path.unlink(missing_ok=True)


def mark_outdated(page: Path, *, outdated: bool) -> None:
    """Write into a page that it is out of date, or take that back; nothing else is changed."""
    if not page.exists():
        return
    content = page.read_bytes()
    plain = content.replace(OUTDATED, b"")
    wanted = plain.replace(b"<body>\n", b"<body>\n" + OUTDATED, 1) if outdated else plain
    if wanted != content:
        with write_whole(page, "wb") as stream:
            stream.write(wanted)


def write_json(path: Path, content: object) -> None:
    """Write JSON, indented; NaN is refused, so that every reader of JSON can read it."""
    with write_whole(path) as stream:
        json.dump(content, stream, indent=1, allow_nan=False)
        stream.write("\n")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON file that a stage before has written."""
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Row]) -> None:
    """Write a table: comma-separated, full precision, an empty cell where a value is unknown.

    No text in it begins like a formula, whoever wrote it.
    """
    with write_whole(path) as stream:
        writer = csv.DictWriter(stream, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: _cell(row[name]) for name in columns} for row in rows)


def _cell(value: object) -> object:
    unknown = value is None or (isinstance(value, float) and math.isnan(value))
    if unknown:
        return ""
    return without_formula(value) if isinstance(value, str) else value


def read_csv(path: Path) -> list[dict[str, str]]:
    """Read a table that a stage before has written; every cell as text."""
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def accepted_recordings(index: Path) -> dict[str, dict[str, str]]:
    """Read the rows of the accepted recordings, from results/recordings.csv, by content.

    Sums of the same numbers in another order may differ in the last digit, and draws in another
    order fall on other recordings. So whatever computes takes recordings in an order that no name
    changes, that of their readings' checksums; tables are written in the order of names.

    Returns
    -------
    dict of str to dict
        By the recording's name.
    """
    rows = [row for row in read_csv(index) if row["status"] == "accepted"]
    rows.sort(key=lambda row: row["readings_sha256"])
    return {row["recording"]: row for row in rows}


def run(main: Callable[[], None]) -> None:
    """Run a script: faults of the input and of the disk end in one plain line, not a traceback.

    The last line that a successful script prints, into its log, is how long it took; the report
    adds these up. A rule calls its script with ``--record OUTPUT:KEY``; what the script has read
    and written is then recorded (`edges.records`).
    """
    started = time.perf_counter()
    # What the imports made is no garbage, and little of what follows is: seldom look for it.
    gc.freeze()
    gc.set_threshold(_SELDOM)
    record, path = None, None
    if "--record" in sys.argv:
        place = sys.argv.index("--record")
        told = sys.argv[place + 1]
        del sys.argv[place : place + 2]
        record, path = Record(told), record_path(told.rpartition(":")[0])
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        if record and path:
            # Whatever ends this job from now on, its old record does not vouch for it.
            path.unlink(missing_ok=True)
            record.watch()
        main()
        if record and path:
            write_json(path, record.content())
        print(f"finished in {time.perf_counter() - started:.3f} s")
    except CapsuleError as error:
        sys.exit(f"error: {error}")
    except OSError as error:
        remedy = ""
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            remedy = "; free some space and run again: finished results are kept"
        sys.exit(f"error: {error.filename or 'disk'}: {error.strerror or error}{remedy}")
