"""What each result was made from: a record that a job writes last, and the check against it.

Snakemake's own notes go by time stamps, and may be lost or belong to another run. A record holds
the key of the settings and the code, and the checksum of each file that the job has read or
written. A result fits as long as all of these are as they were. What does not fit is made again by
Snakemake's own means: its parameter changes, and its files count as old.

Imports nothing heavy: the Snakefile and every script use it.
"""

import functools
import hashlib
import json
import os
import secrets
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from edges.reading import read_limited

# Raised when records or results change their form: everything is then made again.
FORMAT = 1
# Of a larger file only the size counts; no such file is ever read whole.
_LARGEST_BYTES = 100_000_000
_RESULTS, _RECORDS = "results", "records"
# What a job's results depend on: recordings, surveys, other results, what ships beside the code.
_FOLLOWED = {"raw", _RESULTS, "sessions", "workflow"}
_NOT_FOLLOWED = {"logs", _RECORDS}


def _record_folder(result: Path | str) -> Path:
    """Name the folder of the records; another workflow may give results/ a prefix."""
    parts = Path(result).parts
    return Path(*parts[: parts.index(_RESULTS) + 1], _RECORDS)


def record_path(output: Path | str) -> Path:
    """Name the record of the job whose first output is this file under results/."""
    folder = _record_folder(output)
    path = folder / Path(output).relative_to(folder.parent)
    return path.with_name(f"{path.name}.json")


def checksum(path: Path | str) -> str | None:
    """Return the SHA-256 of a file; None where it is not there or cannot be read."""
    try:
        content = read_limited(Path(path), _LARGEST_BYTES)
        if content is None:
            return f"{Path(path).stat().st_size} bytes"
        return hashlib.sha256(content).hexdigest()
    except OSError:
        return None


def followed(path: object) -> str | None:
    """Name a file relative to the working directory, if a result may depend on its content."""
    # Most of what a job opens is code.
    if not isinstance(path, str | os.PathLike) or os.fsdecode(path).endswith((".py", ".pyc")):
        return None
    name = os.path.relpath(os.fsdecode(path)).replace(os.sep, "/")
    parts = name.split("/")
    if parts[0] == ".." or _FOLLOWED.isdisjoint(parts):
        return None
    below_results = parts[parts.index(_RESULTS) + 1 :] if _RESULTS in parts else []
    return None if _NOT_FOLLOWED.intersection(below_results[:1]) else name


@dataclass
class Record:
    """What one job has read and written, by its checksums, and the key of what it was told."""

    made_from: str
    read: dict[str, str | None] = field(default_factory=dict)
    written: dict[str, str | None] = field(default_factory=dict)
    _busy: bool = False

    def watch(self) -> None:
        """Note each file that this process opens for reading, or renames to its final name."""
        sys.addaudithook(self._heard)

    def _heard(self, event: str, arguments: tuple[Any, ...]) -> None:
        if self._busy or event not in ("open", "os.rename"):
            return
        self._busy = True
        try:
            if event == "open" and arguments[1] in ("r", "rb"):
                name = followed(arguments[0])
                # What the job has written itself, and reads again, comes from nowhere else.
                if name and name not in self.read and name not in self.written:
                    self.read[name] = checksum(name)
            elif event == "os.rename" and (name := followed(arguments[1])):
                self.written[name] = checksum(os.fspath(arguments[0]))
        finally:
            self._busy = False

    def content(self) -> dict[str, Any]:
        """Return the record as JSON holds it; to be written when the job has ended well."""
        files = {
            "read": dict(sorted(self.read.items())),
            "written": dict(sorted(self.written.items())),
        }
        return {"format": FORMAT, "made_from": self.made_from, **files}


@functools.cache
def parameter(key: str, outputs: tuple[str, ...], *, renew: bool) -> str:
    """Give the parameter by which Snakemake tells whether a job's results are still good.

    One process gives one answer: Snakemake asks several times.

    Parameters
    ----------
    key : str
        The job's first output, a colon, and what changes with its settings, code and members.
    outputs : tuple of str
        Its files; the first one names the record.
    renew : bool
        Whether results that do not fit are to be made again: their parameter then changes, and
        their time stamps become old for a Snakemake that remembers no parameter.

    Returns
    -------
    str
        The key, and behind it a token where the job had to be done again.
    """
    token = record_path(outputs[0]).with_suffix(".again")
    told = key + _text(token)
    if not renew or _fits(told, outputs):
        return told
    for output in filter(os.path.exists, outputs):
        os.utime(output, (1, 1))
    token.parent.mkdir(parents=True, exist_ok=True)
    token.write_text(f"-{secrets.token_hex(4)}", encoding="utf-8")
    return key + _text(token)


def files_that_do_not_fit(target: str) -> list[str]:
    """Follow the records from a result to all that it was made from, and find what has changed.

    Returns
    -------
    list of str
        Sorted; files that are missing or have another content than a record says.
    """
    changed, waiting, written_by = set(), [target], _records_by_file(_record_folder(target))
    # Many jobs read the same file.
    seen, now = set(waiting), functools.cache(checksum)
    while waiting:
        record = written_by.get(waiting.pop())
        if record is None:
            continue
        changed |= _changed(record, now)
        waiting += [name for name in record["read"] if name not in seen]
        seen |= set(record["read"])
    return sorted(changed)


def _changed(record: dict[str, Any], now: Callable[[str], str | None]) -> set[str]:
    """Name the files that a record tells otherwise than they are now."""
    known = {**record["read"], **record["written"]}
    return {name for name, before in known.items() if now(name) != before}


def _records_by_file(folder: Path) -> dict[str, dict[str, Any]]:
    by_file: dict[str, dict[str, Any]] = {}
    for path in folder.rglob("*.json"):
        if record := _read(path):
            by_file |= dict.fromkeys(record["written"], record)
    return by_file


def _fits(told: str, outputs: Sequence[str]) -> bool:
    """Tell whether a job's results are as its record says; so they are where there are neither."""
    path = record_path(outputs[0])
    if not path.exists() and not any(map(os.path.exists, outputs)):
        return True
    record = _read(path)
    if record is None or record["made_from"] != told or not _wrote_all(outputs, record["written"]):
        return False
    return not _changed(record, _checksum_at_start)


def _wrote_all(outputs: Sequence[str], written: Iterable[str]) -> bool:
    """Tell whether each output was written; of a folder, a file in it."""
    parents = {name.rpartition("/")[0] for name in written}
    return set(outputs) <= {*written, *parents}


def _read(path: Path) -> dict[str, Any] | None:
    """Read a record; None where it is not there, damaged, or of another format."""
    try:
        record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        whole = record["format"] == FORMAT and isinstance(record["made_from"], str)
        whole = whole and isinstance(record["read"], dict) and isinstance(record["written"], dict)
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return record if whole else None


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError):
        return ""


@functools.cache
def _checksum_at_start(name: str) -> str | None:
    """Return a file's checksum; many jobs read the same one."""
    return checksum(name)
