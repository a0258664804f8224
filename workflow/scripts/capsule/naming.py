"""Names under raw/: which files are recordings, of which size, and what is passed over.

Imports nothing heavy: the Snakefile reads the archive at every start.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

UNLABELLED = "unlabelled"
_SIZE_FOLDER = re.compile(r"(\d+(?:\.\d+)?)mm")
# Plain names reach a shell, a report and any file system unharmed.
_PLAIN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")


@dataclass(frozen=True)
class Entry:
    """What lies under raw/.

    Attributes
    ----------
    path : str
        Relative to raw/, with forward slashes.
    is_file : bool
        False for folders and for links to nowhere.
    is_link : bool
        True for links.
    """

    path: str
    is_file: bool = True
    is_link: bool = False


@dataclass(frozen=True)
class Archive:
    """What was found under raw/.

    Attributes
    ----------
    recordings : tuple of str
        Names such as ``3mm/r07``, sorted: these are processed.
    refused : dict of str to str
        Files that claim to be recordings but cannot be processed, and why.
    passed_over : dict of str to str
        Everything else, and why.
    """

    recordings: tuple[str, ...]
    refused: dict[str, str]
    passed_over: dict[str, str]

    def labelled(self) -> list[str]:
        """Give the recordings made in a known condition, with or without a nodule."""
        return [name for name in self.recordings if size_mm(name) is not None]

    def of_nodules(self) -> list[str]:
        """Give the recordings made over a nodule of known size."""
        return [name for name in self.recordings if (size_mm(name) or 0.0) > 0.0]

    def unlabelled(self) -> list[str]:
        """Give the recordings to be detected."""
        return [name for name in self.recordings if size_mm(name) is None]


def folder_size_mm(folder: str) -> float | None:
    """Read the nodule size from a folder's name such as ``3mm`` or ``2.5mm``; None for others."""
    match = _SIZE_FOLDER.fullmatch(folder)
    return float(match[1]) if match else None


def size_mm(recording: str) -> float | None:
    """Give the true nodule size of a recording such as ``3mm/r07``; None where it is unknown."""
    return folder_size_mm(recording.partition("/")[0])


def size_label(size: float) -> str:
    """Write a size as its folder is called: ``3mm``, ``2.5mm``."""
    return f"{size:g}mm"


def sort_key(recording: str) -> tuple:
    """Order recordings by size (unlabelled ones last), then by name with numbers as numbers."""
    folder, _, run = recording.partition("/")
    size = folder_size_mm(folder)
    parts = [
        (0, int(part), "") if part.isdecimal() else (1, 0, part)
        for part in re.split(r"(\d+)", run)
        if part
    ]
    return (size is None, size or 0.0, folder, parts, run)


def classify(entries: Iterable[Entry]) -> Archive:
    """Sort out what lies under raw/.

    Parameters
    ----------
    entries : iterable of Entry
        Everything in raw/ and in its folders, in any order.

    Returns
    -------
    Archive
    """
    recordings, refused, passed_over = [], {}, {}
    for entry in entries:
        folder, _, name = entry.path.partition("/")
        if not name:
            _classify_top(entry, passed_over)
        elif folder != UNLABELLED and folder_size_mm(folder) is None:
            continue  # its folder is named once, by _classify_top
        elif name.startswith("."):
            passed_over[entry.path] = "hidden file"
        elif not name.endswith(".csv"):
            passed_over[entry.path] = (
                "still being recorded" if name.endswith(".part") else "not a .csv file"
            )
        elif not entry.is_file:
            refused[entry.path] = (
                "a link that leads nowhere" if entry.is_link else "a folder, not a file"
            )
        elif not _PLAIN_NAME.fullmatch(name):
            refused[entry.path] = (
                "rename the file: only letters A-Z, digits and _ . + - are allowed in its name, "
                "and it starts with a letter or digit"
            )
        else:
            recordings.append(entry.path.removesuffix(".csv"))
    ordered = dict(sorted(refused.items())), dict(sorted(passed_over.items()))
    return Archive(tuple(sorted(recordings, key=sort_key)), *ordered)


def _classify_top(entry: Entry, passed_over: dict[str, str]) -> None:
    if entry.path.startswith("."):
        return
    if entry.is_file:
        passed_over[entry.path] = "lies beside the folders; move it into one such as 3mm/"
    elif entry.path != UNLABELLED and folder_size_mm(entry.path) is None:
        passed_over[entry.path + "/"] = (
            "a folder that names no size; call it such as 0mm, 2.5mm or unlabelled"
        )
