"""Remove recordings or surveys, with all that names them in results, notes and logs.

What rests on the whole archive goes, too. A link is removed, and never what it points at.
"""

import argparse
import base64
import binascii
import contextlib
import os
import re
import sys
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from pathlib import Path

from capsule.engine.jobs import hold_run_lock
from capsule.engine.project import RECORD_LOGS
from capsule.errors import CapsuleError, WrongOptionError
from capsule.recordings.names import PART, displayed
from capsule.store import files
from capsule.store.results import CHECKS, DESCRIBED, FITS, MATRICES, SIGNALS

RAW, RESULTS, SESSIONS, NOTES = map(Path, ("raw", "results", "sessions", ".snakemake"))
# Below results/: what may be of others alone.
_OF_OTHERS = {SIGNALS, MATRICES, CHECKS, FITS, *DESCRIBED, "surveys", "logs", "run.txt"}
_NO_NOTES = {"cache", "capsule", "conda", "conda-archive", "singularity"}
_ENDS = r"(?![\w+-]|\.(?!(?:csv|json|log|npy|npz|svg|pdf)(?![\w+-])|\W|$))"
_GONE = """{count} files go. All results over the archive (tables, templates, detectors, figures and
the report) are among them; this makes them again without the removed: snakemake -c2"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.epilog = "docs/robustness.md tells what stays where, and what this cannot remove."
    name = "a recording, such as 3mm/r07, or a survey, such as sessions/gut-7"
    parser.add_argument("names", nargs="+", metavar="NAME", help=name)
    parser.add_argument("--yes", action="store_true", help="do not ask")
    parser.add_argument("--dry-run", action="store_true", help="tell what goes, and remove nothing")


def main(arguments: argparse.Namespace) -> int:
    """Tell what goes, ask, and remove it; return 1 if something lies behind a link, and stays."""
    names = [_plain(name) for name in arguments.names]
    own = {name: _own_files(name) for name in names}
    for name, found in own.items():
        if not found and not _named(_pattern([name])):
            listed = files.list_archive(RAW).recordings
            near = [*get_close_matches(name, listed, n=1), *listed, "3mm/r07"][0]
            raise CapsuleError(f"nothing here names {name}; give a name such as {near}")
    with hold_run_lock():
        # The recordings go last, so after a kill the same command goes on.
        first = [path for found in own.values() for path in found]
        going = [*_named(_pattern(names)), *first]
        behind = [path for path in going if any(each.is_symlink() for each in path.parents)]
        behind += [folder for folder in (RESULTS, NOTES) if folder.is_symlink()]
        going = [path for path in dict.fromkeys(going) if path not in behind]
        print(*(displayed(str(path)) for path in first if path not in behind), sep="\n")
        for path in behind:
            print(f"{displayed(str(path))} stays: a link leads there; remove it yourself")
        print(_GONE.format(count=len(going)))
        if not arguments.dry_run:
            if not (arguments.yes or (sys.stdin.isatty() and input("Remove all? [y/N] ") == "y")):
                raise WrongOptionError("nothing was removed; to remove all this, add --yes")
            for path in going:
                path.unlink(missing_ok=True)
            for folder in sorted({each for path in going for each in path.parents}, reverse=True):
                if folder.parts[1:] and folder.parts[0] != RAW.name and not any(folder.iterdir()):
                    folder.rmdir()
    print("Git keeps what was committed. Copies and exports stay, too.")
    return int(bool(behind))


def _plain(name: str) -> str:
    """Return a name without ``raw/`` and ``.csv``; refuse what leads out of the folder."""
    plain = Path(name).as_posix().removeprefix("raw/").removesuffix(".csv")
    if plain.count("/") != 1 or plain.startswith(("/", "../")) or plain.endswith("/.."):
        raise WrongOptionError(f"{displayed(name)} is no name such as 3mm/r07 or sessions/gut-7")
    return plain


def _own_files(name: str) -> list[Path]:
    """Return the files of a recording or of a survey, also one that is not finished."""
    if Path(name).parent == SESSIONS:
        return [*_below(Path(name))]
    found = [RAW / f"{name}{ending}" for ending in ("", ".csv", f".csv{PART}")]
    found.append(RECORD_LOGS / f"{name}.log")
    return [path for path in found if path.is_symlink() or path.is_file()]


def _below(folder: Path) -> Iterator[Path]:
    """Yield the files and links below a folder, or the folder itself if it is a link."""
    if folder.is_symlink():
        yield folder
    for parent, folders, names in os.walk(folder) if not folder.is_symlink() else ():
        links = [name for name in folders if Path(parent, name).is_symlink()]
        yield from (Path(parent, name) for name in sorted([*names, *links]))


def _pattern(names: Iterable[str]) -> re.Pattern[bytes]:
    # Slurm's logs have a line in place of the slash, and the results of surveys another folder.
    said = [re.escape(name).replace("/", "[/_]").replace("sessions", "s[a-z]+s") for name in names]
    return re.compile(rf"(?<![\w.+-])(?:{'|'.join(said)}){_ENDS}".encode())


def _named(names: re.Pattern[bytes]) -> list[Path]:
    """Return results, notes and logs that name something, and the results over the archive."""
    results = [path for path in _below(RESULTS) if path != RESULTS]
    notes = [path for path in _below(NOTES) if not {*path.parts[1:2]} <= _NO_NOTES]
    going = {path for path in (*results, *notes) if _holds(path, names)}
    if going:
        going |= {path for path in results if path.parts[1] not in _OF_OTHERS}
    # Snakemake names its notes on a result by the result's path. What names an input goes, too.
    noted = {note: _result_of(note) for note in notes}
    going |= {noted[note] for note in going & {*notes}} & {*results}
    return sorted(going | {note for note, result in noted.items() if result in going})


def _result_of(note: Path) -> Path:
    """Return the result that a note is on; a long name is divided into folders."""
    coded = "".join(part.removeprefix("@") for part in note.parts[2:])
    with contextlib.suppress(binascii.Error):
        return Path(os.fsdecode(base64.urlsafe_b64decode(coded)))
    return note


def _holds(path: Path, names: re.Pattern[bytes]) -> bool:
    """Return whether the path, or the content of a file, names something."""
    content = path.read_bytes() if path.is_file() and not path.is_symlink() else b""
    return bool(names.search(os.fsencode(path)) or names.search(content))
