"""A recording into raw/, unless it is there already."""

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path

from capsule.errors import CapsuleError
from capsule.naming import PART, Entry, classify, displayed, reason_of_copy
from capsule.recording import Recording, format_recording
from edges.files import list_archive
from edges.new_file import write_new
from edges.run_arguments import LONGEST_NAME


def run_name(stem: str, label: str) -> str:
    """Make a name that a shell, the report and any file system take, from a file's and a run's.

    Raises
    ------
    CapsuleError
        None can be made; the remedy is --name.
    """
    text = f"{stem}-{label}" if label else stem
    name = re.sub(r"[^A-Za-z0-9_.+-]+", "-", text).strip("-._+")[:LONGEST_NAME]
    name = name.removesuffix(".csv").strip("-._+")
    if not classify([Entry(f"unlabelled/{name}.csv")]).recordings:
        raise CapsuleError(f"{displayed(text)!r} makes no name of a recording; give one by --name")
    return name


class ArchivedRuns:
    """The recordings under raw/, by the checksum of their samples.

    Parameters
    ----------
    raw : Path
        The archive.
    """

    def __init__(self, raw: Path) -> None:
        self._raw = raw
        names = list_archive(raw).recordings if raw.is_dir() else ()
        self._names = {
            _checksum((raw / f"{name}.csv").read_bytes()): name for name in sorted(names)
        }

    def known(self, recording: Recording) -> str:
        """Name the recording that holds the same samples; empty where there is none."""
        return self._names.get(_checksum(format_recording(recording)), "")

    def check_free(self, names: Sequence[str]) -> None:
        """Make sure that recordings such as ``3mm/r07`` can be written.

        Raises
        ------
        CapsuleError
            A name is taken, or two of them are the same.
        """
        for at, name in enumerate(names):
            path = self._raw / f"{name}.csv"
            part = path.with_name(path.name + PART)
            if taken := next((each for each in (path, part) if each.exists()), None):
                raise CapsuleError(_taken(taken))
            if name in names[:at]:
                raise CapsuleError(f"two of its runs would be {path}; give them other names")

    def add(self, name: str, recording: Recording) -> None:
        """Write a recording whose name is free."""
        path = self._raw / f"{name}.csv"
        content = format_recording(recording)
        try:
            write_new(path, content)
        except FileExistsError:
            raise CapsuleError(_taken(path)) from None
        self._names[_checksum(content)] = name

    def refuse_other_size(self, known: str, name: str) -> None:
        """Refuse samples that are in the archive under another size."""
        reason = reason_of_copy(known, name)
        if "mislabelled" in reason:
            raise CapsuleError(
                f"{reason}; move {self._raw / known}.csv, or give the size that it has"
            )


def _taken(path: Path) -> str:
    return f"{path} exists and holds other samples; nothing is overwritten: give another --name"


def _checksum(content: bytes) -> str:
    """Return the checksum of a recording's samples, whatever its header lines say."""
    lines = [line for line in content.splitlines() if not line.lstrip().startswith(b"#")]
    return hashlib.sha256(b"\n".join(lines)).hexdigest()
