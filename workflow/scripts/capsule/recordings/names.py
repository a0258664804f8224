"""Names of files under raw/: which are recordings, their sizes, and which files are passed over.

This module imports nothing heavy, because the Snakefile reads the archive at every start.
"""

import hashlib
import json
import re
from collections.abc import Iterable
from dataclasses import dataclass

UNLABELLED = "unlabelled"
# Ending of a file that is still being written.
PART = ".part"
# At most three digits on either side, so that a size and its label are the same number.
_SIZE_FOLDER = re.compile(r"([0-9]{1,3}(?:\.[0-9]{1,3})?)mm")
# Plain names are safe in a shell, in the report and in any file system. The limited length leaves
# room for the endings of result files.
_PLAIN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]{0,99}")
# Snakemake takes such a name for a mistake in a rule and stops the whole run.
_REPEATED_END = re.compile(r"(.+?)\1{19,}$")
# Spreadsheets also accept the full-width forms of these signs.
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
    """One file or folder under raw/.

    Attributes
    ----------
    path : str
        Relative to raw/, with forward slashes.
    kind : {"file", "folder", "dead link", "link out", "device", "locked"}
        Its kind after following links. ``"link out"`` is a link to a place outside raw/;
        ``"locked"`` is a file or folder without read permission.
    """

    path: str
    kind: str = "file"


@dataclass(frozen=True)
class Archive:
    """The files under raw/, sorted into recordings and others.

    Attributes
    ----------
    recordings : tuple of str
        Names such as ``3mm/r07``, sorted: these are processed.
    refused : dict of str to str
        Files that are named like recordings but cannot be processed, and why. The names are as
        from `displayed`.
    passed_over : dict of str to str
        All other files, and why they are passed over. The names are as from `displayed`.
    """

    recordings: tuple[str, ...]
    refused: dict[str, str]
    passed_over: dict[str, str]

    def others(self) -> str:
        """Return a checksum of the files that are no recordings, and of the reasons."""
        named = json.dumps([self.refused, self.passed_over])
        return hashlib.sha256(named.encode()).hexdigest()


def is_plain(name: str) -> bool:
    """Return whether a name is safe in a shell, in the report and in any file system."""
    return _PLAIN_NAME.fullmatch(name) is not None


def displayed(name: str) -> str:
    r"""Return an untrusted name on one line, which cannot move a cursor or break a table.

    Characters that cannot be printed become escapes such as ``\n``: line feeds, escape characters,
    bytes that are not UTF-8. Different names stay different.
    """
    if name.isprintable() and "\\" not in name:
        return name
    return "".join(
        each if each.isprintable() and each != "\\" else each.encode("unicode_escape").decode()
        for each in name
    )


def as_cell(untrusted: str) -> str:
    """Return untrusted text in a form that a spreadsheet shows and does not compute."""
    return without_formula(displayed(untrusted))


def without_formula(text: str) -> str:
    """Return text with a space before each sign that begins a formula in a spreadsheet's cell.

    Such a sign stands at the start or after a separator. In countries with decimal commas,
    spreadsheets split cells at semicolons, even inside quotes. A number stays as it is.
    """
    # Almost no text begins a formula, so it is looked for first.
    if not _FORMULA.search(text) or _NUMBER.fullmatch(text):
        return text
    return _FORMULA.sub(r"\1 ", text)


def folder_size_mm(folder: str) -> float | None:
    """Return the nodule size of a folder such as ``3mm`` or ``2.5mm``; None for other names."""
    match = _SIZE_FOLDER.fullmatch(folder)
    return float(match[1]) if match else None


def folder_of(recording: str) -> str:
    """Return the folder of a recording: ``3mm`` of ``3mm/r07``."""
    return recording.partition("/")[0]


def size_mm(recording: str) -> float | None:
    """Return the true nodule size of a recording such as ``3mm/r07``; None if it is unknown."""
    return folder_size_mm(folder_of(recording))


def sizes_of(recordings: Iterable[str]) -> dict[str, float]:
    """Return the true size of each labelled recording, in mm; the others are left out."""
    sizes_mm = {name: size_mm(name) for name in recordings}
    return {name: size for name, size in sizes_mm.items() if size is not None}


def size_label(size: float) -> str:
    """Return the name of a size's folder: ``3mm``, ``2.5mm``."""
    return f"{size:g}mm"


def sort_key(recording: str) -> tuple[object, ...]:
    """Return a key that sorts by size (unlabelled last), then by name, digits as numbers."""
    folder, _, run = recording.partition("/")
    size = folder_size_mm(folder)
    parts = [
        (0, int(part), "") if part.isdecimal() else (1, 0, part)
        for part in re.split(r"(\d+)", run)
        if part
    ]
    return (size is None, size or 0.0, folder, parts, run)


def repeated_end(name: str) -> str:
    """Return the text that a name ends in at least twenty times; empty for other names."""
    match = _REPEATED_END.search(name)
    return match[1] if match else ""


def reason_of_copy(original: str, name: str) -> str:
    """Return which recording this one copies, and whether the labels of the two contradict."""
    reason = f"the same content as {original}"
    sizes = {size_mm(original), size_mm(name)} - {None}
    return reason + (", under another size: one of the two is mislabelled" * (len(sizes) > 1))


def classify(entries: Iterable[Entry]) -> Archive:
    """Return which files under raw/ are recordings, and why the others are not.

    Parameters
    ----------
    entries : iterable of Entry
        Everything in raw/ and in its folders, in any order.
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
            continue  # The entry of its folder is listed instead.
        elif name.startswith("."):
            passed_over[shown] = "hidden file"
        elif name.endswith(PART):
            passed_over[shown] = (
                "an unfinished recording; if no recorder is running, complete it with "
                "capsule record --recover"
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
