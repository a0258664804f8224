"""Write imported recordings into raw/, except those that raw/ already holds."""

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path

from capsule.arguments import LONGEST_NAME
from capsule.errors import CapsuleError
from capsule.files import list_archive, read_limited, write_new
from capsule.names import PART, Entry, classify, displayed, reason_of_copy
from capsule.recording import Recording, format_recording


def run_name(stem: str, label: str) -> str:
    """Return a recording's name, made from the names of its file and its run.

    A shell, the report and any file system accept the characters of this name.

    Raises
    ------
    CapsuleError
        No valid name can be made; the message names the remedy, --name.
    """
    text = f"{stem}-{label}" if label else stem
    name = re.sub(r"[^A-Za-z0-9_.+-]+", "-", text).strip("-._+")[:LONGEST_NAME]
    name = name.removesuffix(".csv").strip("-._+")
    if not classify([Entry(f"unlabelled/{name}.csv")]).recordings:
        raise CapsuleError(f"{displayed(text)!r} gives no valid name; give one with --name")
    return name


class ArchivedRuns:
    """The recordings under raw/, by the checksum of their samples.

    Parameters
    ----------
    raw : Path
        The archive.
    max_bytes : int
        Size of the largest recording; a larger file is none, and is not read.
    """

    def __init__(self, raw: Path, max_bytes: int) -> None:
        self._raw = raw
        self._names: dict[str, str] = {}
        for name in sorted(list_archive(raw).recordings) if raw.is_dir() else ():
            content = read_limited(raw / f"{name}.csv", max_bytes)
            if content is not None:
                self._names[_checksum(content)] = name

    def known(self, recording: Recording) -> str:
        """Return the name of the recording with the same samples; empty if there is none."""
        return self._names.get(_checksum(format_recording(recording)), "")

    def check_free(self, names: Sequence[str]) -> None:
        """Raise an error if recordings with names such as ``3mm/r07`` cannot be written.

        Raises
        ------
        CapsuleError
            A name is taken, or two names are the same.
        """
        for at, name in enumerate(names):
            path = self._raw / f"{name}.csv"
            part = path.with_name(path.name + PART)
            if taken := next((each for each in (path, part) if each.exists()), None):
                raise CapsuleError(_taken(taken))
            if name in names[:at]:
                raise CapsuleError(
                    f"two of its runs would be written to {path}; give them different names"
                )

    def add(self, name: str, recording: Recording) -> None:
        """Write a recording; its name must be free."""
        path = self._raw / f"{name}.csv"
        content = format_recording(recording)
        try:
            write_new(path, content)
        except FileExistsError:
            raise CapsuleError(_taken(path)) from None
        self._names[_checksum(content)] = name

    def refuse_other_size(self, known: str, name: str) -> None:
        """Raise an error if the archive holds the same samples under another size."""
        reason = reason_of_copy(known, name)
        if "mislabelled" in reason:
            raise CapsuleError(f"{reason}; move {self._raw / known}.csv, or give the right size")


def _taken(path: Path) -> str:
    return f"{path} exists and holds other samples, so it is not overwritten; give another --name"


def _checksum(content: bytes) -> str:
    """Return the checksum of a recording's samples, without its header lines."""
    lines = [line for line in content.splitlines() if not line.lstrip().startswith(b"#")]
    return hashlib.sha256(b"\n".join(lines)).hexdigest()
