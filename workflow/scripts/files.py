"""Where the library meets the disk: listing raw/, writing files whole, one style of error.

Imports nothing heavy: the Snakefile and every script use it.
"""

import contextlib
import io
import json
import os
import sys
from collections.abc import Callable, Iterator
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
            stream.flush()
            os.fsync(stream.fileno())
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


def run(main: Callable[[], None]) -> None:
    """Run a script: faults of the input and of the disk end in one plain line, not a traceback."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        main()
    except CapsuleError as error:
        sys.exit(f"error: {error}")
    except OSError as error:
        sys.exit(f"error: {error.filename or 'disk'}: {error.strerror or error}")
