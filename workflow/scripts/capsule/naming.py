"""Names under raw/: which files are recordings, of which size, and what is passed over.

Imports nothing heavy: the Snakefile reads the archive at every start.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

UNLABELLED = "unlabelled"
# Behind the name of a file that is still being written.
PART = ".part"
# At most three digits on either side, so that a size and its label are the same number.
_SIZE_FOLDER = re.compile(r"([0-9]{1,3}(?:\.[0-9]{1,3})?)mm")
# Plain names reach a shell, a report and any file system unharmed; the length leaves room for
# the endings of the results.
_PLAIN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]{0,99}")
# Full-width signs count too where people write with them.
# Snakemake takes such a name for a mistake in a rule, and stops the whole run.
_REPEATED_END = re.compile(r"(.+?)\1{19,}$")
_FORMULA = re.compile(r"(^|[;,|\t])(?=[\"']*[=+\-@\uff1d\uff0b\uff0d\uff20])")
_NUMBER = re.compile(r"[+-]?[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?|[+-]?inf")
_NO_FILE = {
    "folder": "a folder, not a file",
    "dead link": "a link to a file that does not exist",
    "link out": "a link to a place outside raw/; replace it with a copy of the file",
    "device": "a pipe or a device, not a file",
    "locked": "cannot be read: you have no permission",
}


@dataclass(frozen=True)
class Entry:
    """What lies under raw/.

    Attributes
    ----------
    path : str
        Relative to raw/, with forward slashes.
    kind : {"file", "folder", "dead link", "link out", "device", "locked"}
        What it is, links followed; ``"link out"`` leads to something that does not lie under
        raw/, ``"locked"`` is a file or folder that may not be read.
    """

    path: str
    kind: str = "file"


@dataclass(frozen=True)
class Archive:
    """What was found under raw/.

    Attributes
    ----------
    recordings : tuple of str
        Names such as ``3mm/r07``, sorted: these are processed.
    refused : dict of str to str
        Files that claim to be recordings but cannot be processed, and why; the names as
        `displayed`.
    passed_over : dict of str to str
        Everything else, and why; the names as `displayed`.
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

    def by_folder(self) -> dict[str, list[str]]:
        """Give the recordings of each folder that holds some."""
        folders: dict[str, list[str]] = {}
        for name in self.recordings:
            folders.setdefault(folder_of(name), []).append(name)
        return folders

    def unlabelled(self) -> list[str]:
        """Give the recordings to be detected."""
        return [name for name in self.recordings if size_mm(name) is None]


def is_plain(name: str) -> bool:
    """Tell whether a name reaches a shell, a report and any file system unharmed."""
    return _PLAIN_NAME.fullmatch(name) is not None


def displayed(name: str) -> str:
    r"""Write an untrusted name on one line, so that it neither moves a cursor nor breaks a table.

    What is not printable (line feeds, escape characters, bytes that are no UTF-8) is written as
    an escape such as ``\n``; different names stay different.
    """
    return "".join(
        each if each.isprintable() and each != "\\" else each.encode("unicode_escape").decode()
        for each in name
    )


def as_cell(untrusted: str) -> str:
    """Write untrusted text so that a spreadsheet shows it and does not compute it."""
    return without_formula(displayed(untrusted))


def without_formula(text: str) -> str:
    """Put a space before each sign that begins a formula in one of a spreadsheet's cells.

    That is one that stands first, and one behind a separator: where people write decimal commas,
    spreadsheets divide cells at semicolons, whatever stands in quotes. A number stays as it is.
    """
    return text if _NUMBER.fullmatch(text) else _FORMULA.sub(r"\1 ", text)


def folder_size_mm(folder: str) -> float | None:
    """Read the nodule size from a folder's name such as ``3mm`` or ``2.5mm``; None for others."""
    match = _SIZE_FOLDER.fullmatch(folder)
    return float(match[1]) if match else None


def folder_of(recording: str) -> str:
    """Name the folder of a recording: ``3mm`` of ``3mm/r07``."""
    return recording.partition("/")[0]


def size_mm(recording: str) -> float | None:
    """Give the true nodule size of a recording such as ``3mm/r07``; None where it is unknown."""
    return folder_size_mm(folder_of(recording))


def sizes_of(recordings: Iterable[str]) -> dict[str, float]:
    """Give the true size of each labelled recording, in mm; the others are left aside."""
    sizes_mm = {name: size_mm(name) for name in recordings}
    return {name: size for name, size in sizes_mm.items() if size is not None}


def size_label(size: float) -> str:
    """Write a size as its folder is called: ``3mm``, ``2.5mm``."""
    return f"{size:g}mm"


def sort_key(recording: str) -> tuple[object, ...]:
    """Order recordings by size (unlabelled ones last), then by name with numbers as numbers."""
    folder, _, run = recording.partition("/")
    size = folder_size_mm(folder)
    parts = [
        (0, int(part), "") if part.isdecimal() else (1, 0, part)
        for part in re.split(r"(\d+)", run)
        if part
    ]
    return (size is None, size or 0.0, folder, parts, run)


def repeated_end(name: str) -> str:
    """Return what a name ends in twenty times and more; nothing for other names."""
    match = _REPEATED_END.search(name)
    return match[1] if match else ""


def reason_of_copy(original: str, name: str) -> str:
    """Say what a recording is a copy of, and whether the labels of the two contradict."""
    reason = f"the same content as {original}"
    sizes = {size_mm(original), size_mm(name)} - {None}
    return reason + (", under another size: one of the two is mislabelled" * (len(sizes) > 1))


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
        shown = displayed(entry.path)
        if not name:
            if reason := _fault_at_top(entry):
                passed_over[shown + ("/" if entry.kind == "folder" else "")] = reason
        elif folder.startswith("."):
            if name.lower().endswith(".csv"):
                passed_over[shown] = "in a hidden folder; move it into a folder such as 3mm/"
        elif folder != UNLABELLED and folder_size_mm(folder) is None:
            continue  # its folder is named once, above
        elif name.startswith("."):
            passed_over[shown] = "hidden file"
        elif name.endswith(PART):
            passed_over[shown] = (
                "an unfinished recording; if no recorder is running: acquire.py --recover"
            )
        elif not name.endswith(".csv"):
            passed_over[shown] = _other_file(entry, name)
        elif entry.kind != "file":
            refused[shown] = _NO_FILE[entry.kind]
        elif not is_plain(name):
            refused[shown] = (
                "rename the file: only letters A-Z, digits and _ . + - are allowed in its name, "
                "at most 100 of them, and the first is a letter or digit"
            )
        elif repeated := repeated_end(name.removesuffix(".csv")):
            refused[shown] = (
                f"rename the file: its name ends in {repeated!r} twenty times or more, "
                "and Snakemake stops at such a name"
            )
        else:
            recordings.append(entry.path.removesuffix(".csv"))
    ordered = dict(sorted(refused.items())), dict(sorted(passed_over.items()))
    return Archive(tuple(sorted(recordings, key=sort_key)), *ordered)


def _other_file(entry: Entry, name: str) -> str:
    if entry.kind == "folder":
        return "a folder; put recordings directly into the folder of their size"
    if name.lower().endswith(".csv"):
        return "not a .csv file: write the ending in lower case"
    return "not a .csv file"


def _fault_at_top(entry: Entry) -> str:
    if entry.path.startswith("."):
        return "hidden file" if entry.path.lower().endswith(".csv") else ""
    if entry.kind in ("locked", "link out"):
        return _NO_FILE[entry.kind].replace("the file", "the linked folder")
    if entry.kind != "folder":
        return "directly in raw/; move it into a folder such as 3mm/"
    if entry.path != UNLABELLED and folder_size_mm(entry.path) is None:
        return (
            "a folder whose name is not a size; rename it, for example to 0mm, 2.5mm or unlabelled"
        )
    return ""
