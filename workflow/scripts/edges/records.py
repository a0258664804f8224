"""Record what each result was made from, and check later whether the result still fits.

Snakemake's own notes use time stamps, and can be lost or belong to another run. A job's last act is
to write its record. The record holds the key of the settings and the code, and the checksum of each
file that the job has read or written. A result fits as long as none of these has changed. For a
result that does not fit, the parameter of its rule changes and its files get an old time stamp, so
that Snakemake makes it again.

The Snakefile and every script use this module, so it imports only fast modules.
"""

import contextlib
import functools
import json
import os
import secrets
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from edges.checksums import Checksums, checksum, checksum_of
from edges.reading import READ, read_whole

# Increase this number when the form of records or results changes; all results are then made again.
FORMAT = 1
_RESULTS, _RECORDS = "results", "records"
# A job's results depend on files in these folders: recordings, surveys, other results, and the
# files beside the code.
_FOLLOWED = {"raw", _RESULTS, "sessions", "workflow"}
_NOT_FOLLOWED = {"logs", _RECORDS}
_CODE = (".py", ".pyc")
# Many records hold the same files. Each file is read once for all of them.
CHECKSUMS = Checksums()


def _record_folder(result: Path | str) -> Path:
    """Return the folder of the records; another workflow may give results/ a prefix."""
    parts = Path(result).parts
    return Path(*parts[: parts.index(_RESULTS) + 1], _RECORDS)


@functools.cache
def record_path(output: Path | str) -> Path:
    """Return the path of the record of the job whose first output is this file."""
    folder = _record_folder(output)
    path = folder / Path(output).relative_to(folder.parent)
    return path.with_name(f"{path.name}.json")


def followed(path: object) -> str | None:
    """Return a file's path from the working directory; None if no result depends on the file."""
    # Most files that a job opens are code.
    if not isinstance(path, str | os.PathLike) or (name := os.fsdecode(path)).endswith(_CODE):
        return None
    # Most paths need no change, which would take longer than all else here.
    if os.sep != "/" or name.startswith("/") or "./" in name or "//" in name:
        name = os.path.relpath(name).replace(os.sep, "/")
    parts = name.split("/")
    if parts[0] == ".." or _FOLLOWED.isdisjoint(parts):
        return None
    below_results = parts[parts.index(_RESULTS) + 1 :] if _RESULTS in parts else []
    return None if _NOT_FOLLOWED.intersection(below_results[:1]) else name


@dataclass
class Record:
    """The key of one job, and the checksums of the files that it has read and written."""

    made_from: str
    read: dict[str, str | None] = field(default_factory=dict)
    written: dict[str, str | None] = field(default_factory=dict)

    @contextlib.contextmanager
    def watch(self) -> Iterator[None]:
        """Record each file that this process opens for reading, or renames to its final name.

        While a record watches inside another one, only the inner record grows.
        """
        _add_hook()
        _WATCHING.append(self)
        try:
            yield
        finally:
            _WATCHING.pop()

    def add_event(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Record the file of an event of Python's audit."""
        if event == "os.rename":
            if name := followed(arguments[1]):
                self.written[name] = checksum(os.fspath(arguments[0]))
            return
        name = followed(arguments[0])
        # A file that the job wrote itself is no input, even if the job reads it again.
        if name and name not in self.read and name not in self.written:
            content = arguments[1] if event == READ else None
            self.read[name] = checksum(name) if content is None else checksum_of(content)

    def add_part(self, part: "Record") -> None:
        """Record that this job depends on all files that a part of it has read or written."""
        self.read |= {**part.read, **part.written}

    def added_since(self, earlier: "Record") -> "Record":
        """Return the files that have been read or written since this record was like another."""
        return Record(
            self.made_from,
            dict(self.read.items() - earlier.read.items()),
            dict(self.written.items() - earlier.written.items()),
        )

    def add(self, other: "Record") -> None:
        """Add the files that another process has read and written for this job."""
        self.read |= other.read
        self.written |= other.written

    def content(self) -> dict[str, Any]:
        """Return the record for a JSON file, to be written when the job has succeeded."""
        files = {
            "read": dict(sorted(self.read.items())),
            "written": dict(sorted(self.written.items())),
        }
        return {"format": FORMAT, "made_from": self.made_from, **files}


# The records that watch this process, the innermost one last; at None, nothing is recorded.
_WATCHING: list[Record | None] = []


@functools.cache
def _add_hook() -> None:
    # Python cannot remove a hook, so all records share one.
    sys.addaudithook(_forward)


def _forward(event: str, arguments: tuple[Any, ...]) -> None:
    if not _WATCHING or event not in ("open", READ, "os.rename"):
        return
    if event == "open" and arguments[1] not in ("r", "rb"):
        return
    if record := _WATCHING[-1]:
        with unwatched():
            record.add_event(event, arguments)


@contextlib.contextmanager
def unwatched() -> Iterator[None]:
    """Let no record grow meanwhile."""
    _WATCHING.append(None)
    try:
        yield
    finally:
        _WATCHING.pop()


def watching_record() -> Record | None:
    """Return the record that watches this process."""
    return _WATCHING[-1] if _WATCHING else None


def current_key(key: str) -> str:
    """Return a key, with the token that `parameter` has added to it; it begins with the output."""
    return key + _text(_token_path(key.rpartition(":")[0]))


def stored_record(output: Path | str) -> Record | None:
    """Read the record of the job whose first output is this file; None if it has none."""
    stored = _read(record_path(output))
    return Record(stored["made_from"], stored["read"], stored["written"]) if stored else None


def reason_to_make(made_from: str, outputs: Sequence[str]) -> str:
    """Return why results must be made, as a clause that follows "because"; empty if they fit."""
    record = _read(record_path(outputs[0]))
    if not all(map(os.path.exists, outputs)):
        return "its results are missing"
    if record is None:
        return "the record of its results is missing"
    if record["made_from"] != made_from or not _wrote_all(outputs, record["written"]):
        return "its settings or the code have changed"
    changed = sorted(_changed(record, CHECKSUMS.first))
    return f"{changed[0]} has changed" if changed else ""


@functools.cache
def parameter(key: str, outputs: tuple[str, ...], *, renew: bool) -> str:
    """Return the parameter by which Snakemake decides whether to run a job again.

    Snakemake asks several times; the cache makes all answers of one process equal.

    Parameters
    ----------
    key : str
        The job's first output, a colon, and a checksum of its settings, code and members.
    outputs : tuple of str
        The job's output files; the first one names the record.
    renew : bool
        Whether results that do not fit are made again. Their parameter then changes. Their time
        stamps become old, in case Snakemake has lost its notes of the parameters.

    Returns
    -------
    str
        The key, followed by a token if the results did not fit once.
    """
    token = _token_path(outputs[0])
    told = key + _text(token)
    if not renew or _fits(told, outputs):
        return told
    for output in filter(os.path.exists, outputs):
        os.utime(output, (1, 1))
    token.parent.mkdir(parents=True, exist_ok=True)
    token.write_text(f"-{secrets.token_hex(4)}", encoding="utf-8")
    return key + _text(token)


def files_that_do_not_fit(target: str) -> list[str]:
    """Return the changed files among all files that a result was made from.

    Returns
    -------
    list of str
        Sorted paths of files that are missing, or whose content differs from a record.
    """
    changed, waiting, written_by = set(), [target], _records_by_file(_record_folder(target))
    # Many jobs read the same file, so each checksum is computed once.
    seen, now = set(waiting), functools.cache(CHECKSUMS.now)
    while waiting:
        record = written_by.get(waiting.pop())
        if record is None:
            continue
        changed |= _changed(record, now)
        waiting += [name for name in record["read"] if name not in seen]
        seen |= set(record["read"])
    return sorted(changed)


def _changed(record: dict[str, Any], now: Callable[[str], str | None]) -> set[str]:
    """Return the files whose checksums differ from those in the record."""
    known = {**record["read"], **record["written"]}
    return {name for name, before in known.items() if now(name) != before}


def _records_by_file(folder: Path) -> dict[str, dict[str, Any]]:
    by_file: dict[str, dict[str, Any]] = {}
    for path in folder.rglob("*.json"):
        if record := _read(path):
            by_file |= dict.fromkeys(record["written"], record)
    return by_file


def _fits(told: str, outputs: Sequence[str]) -> bool:
    """Return whether a job's results fit its record; True if neither results nor record exist."""
    if not record_path(outputs[0]).exists() and not any(map(os.path.exists, outputs)):
        return True
    return not reason_to_make(told, outputs)


def _wrote_all(outputs: Sequence[str], written: Iterable[str]) -> bool:
    """Return whether each output was written; for a folder, whether a file in it was written."""
    parents = {name.rpartition("/")[0] for name in written}
    return set(outputs) <= {*written, *parents}


def _read(path: Path) -> dict[str, Any] | None:
    """Read a record; return None if it is missing, damaged, or of another format."""
    try:
        record: dict[str, Any] = json.loads(read_whole(path).decode("utf-8"))
        whole = record["format"] == FORMAT and isinstance(record["made_from"], str)
        whole = whole and isinstance(record["read"], dict) and isinstance(record["written"], dict)
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return record if whole else None


def _token_path(output: str) -> Path:
    """Return the path of the token that makes the job of this output run again."""
    return record_path(output).with_suffix(".again")


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError):
        return ""
