"""Where the library meets the disk: listing raw/, writing files whole, one style of error.

Imports nothing heavy: the Snakefile and every script use it.
"""

import contextlib
import csv
import io
import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO

from capsule.errors import CapsuleError
from capsule.naming import Archive, Entry, classify


def list_archive(raw: Path) -> Archive:
    """List the recordings under raw/, without opening any."""
    if not raw.is_dir():
        raise CapsuleError(f"{raw}/ does not exist; make it and put recordings into {raw}/3mm/")
    return classify(_entries(raw))


def _entries(raw: Path) -> Iterator[Entry]:
    with os.scandir(raw) as top:
        folders = sorted(top, key=lambda found: found.name)
    for folder in folders:
        yield Entry(folder.name, folder.is_file(), folder.is_symlink())
        if folder.is_dir():
            with os.scandir(folder) as inside:
                for found in inside:
                    name = f"{folder.name}/{found.name}"
                    yield Entry(name, found.is_file(), found.is_symlink())


@contextlib.contextmanager
def write_whole(path: Path, mode: str = "w") -> Iterator[IO]:
    """Open a file for writing that appears under its name only when it is complete.

    Parameters
    ----------
    path : Path
        The final name; its folder is made.
    mode : {"w", "wb"}
        Text (UTF-8, line feeds on every system) or binary.

    Yields
    ------
    file
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.unfinished")
    text = {} if "b" in mode else {"encoding": "utf-8", "newline": "\n"}
    try:
        with unfinished.open(mode, **text) as stream:
            yield stream
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def write_json(path: Path, content: object) -> None:
    """Write JSON, indented; NaN is refused, so that every reader of JSON can read it."""
    with write_whole(path) as stream:
        json.dump(content, stream, indent=1, allow_nan=False)
        stream.write("\n")


def read_json(path: Path) -> dict:
    """Read a JSON file that a stage before has written."""
    return json.loads(path.read_text(encoding="utf-8"))


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Mapping]) -> None:
    """Write a table: comma-separated, full precision, an empty cell where a value is unknown."""
    with write_whole(path) as stream:
        writer = csv.DictWriter(stream, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: _cell(row[name]) for name in columns} for row in rows)


def _cell(value: object) -> object:
    unknown = value is None or (isinstance(value, float) and math.isnan(value))
    return "" if unknown else value


def read_csv(path: Path) -> list[dict[str, str]]:
    """Read a table that a stage before has written; every cell as text."""
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def accepted_recordings(index: Path) -> list[str]:
    """Give the names of the accepted recordings, from results/recordings.csv."""
    return [row["recording"] for row in read_csv(index) if row["status"] == "accepted"]


def run(main: Callable[[], None]) -> None:
    """Run a script: faults of the input and of the disk end in one plain line, not a traceback.

    The last line that a successful script prints, into its log, is how long it took; the report
    adds these up.
    """
    started = time.perf_counter()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        main()
        print(f"finished in {time.perf_counter() - started:.3f} s")
    except CapsuleError as error:
        sys.exit(f"error: {error}")
    except OSError as error:
        sys.exit(f"error: {error.filename or 'disk'}: {error.strerror or error}")
