"""Remove every trace of recordings or surveys: files, results, what was learned, notes and logs.

What rests on all recordings goes too, and the next run makes it again. The others' own files stay.
"""

import argparse
import base64
import os
import re
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping
from difflib import get_close_matches
from pathlib import Path

from capsule.engine.configuration import read_settings
from capsule.engine.locks import RUN_LOCK, hold_run_lock
from capsule.engine.project import RECORD_LOGS, config_file
from capsule.errors import CapsuleError, RecordingError, WrongOptionError
from capsule.recordings.held_out import header_of
from capsule.recordings.names import PART, displayed
from capsule.store import files
from capsule.store.results import files_of

RAW, RESULTS, SESSIONS, NOTES = map(Path, ("raw", "results", "sessions", ".snakemake"))
# Packages, copies of the code, the lock of the folder: these notes are of no recording.
_OTHER_NOTES = {"cache", "capsule", "conda", "conda-archive", "singularity", RUN_LOCK.name}
# Snakemake names its notes on a file by the file's path in base 64.
_NAMED_NOTES = ("metadata", "incomplete")
# Not looked through: git's history, code and its documents, a larger file, and what is packed.
_NOT_READ = {".git", ".venv", "build", "docs", "tests", "workflow", "README.md", "CHANGELOG.md"}
_MOST_BYTES = 200_000_000
_KEYS = ("session", "site")
_PACKED = {".gz", ".h5", ".html", ".mat", ".nc", ".npz", ".nwb", ".parquet", ".xlsx", ".zip"}

EXAMPLES = """
examples:
  %(prog)s 3mm/r07 --dry-run       tell what would go
  %(prog)s 3mm/r07 unlabelled/p1   remove two recordings
  %(prog)s sessions/gut-7          remove a survey

docs/privacy.md tells what stays where, and what this command cannot remove.
"""
WHAT_ELSE = """files, with results, notes and logs; the next run makes again what rests on all
recordings: tables, templates, detectors, figures and the report"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.epilog = EXAMPLES
    add = parser.add_argument
    name = "a recording, such as 3mm/r07, or a survey, such as sessions/gut-7"
    add("names", nargs="*", metavar="NAME", help=name)
    for key in _KEYS:
        add(f"--{key}", metavar="NAME", help=f"all recordings whose header names this {key}")
    add("--yes", action="store_true", help="do not ask")
    add("--dry-run", action="store_true", help="tell what would go, and remove nothing")


def main(arguments: argparse.Namespace) -> int:
    """Tell what goes, ask, and remove it; return 1 if a file that stays still names it."""
    listed = files.list_archive(RAW).recordings
    named = [*map(_plain, arguments.names), *_of_header(arguments, listed)]
    if not named:
        raise WrongOptionError("no recording was found; name one, such as 3mm/r07")
    own = {name: _own_files(name) for name in named}
    trace = _trace_of(own)
    for name in own:
        by_name = _trace_of({name: []})
        if not own[name] and not any(_holds(path, by_name) for path in _looked_through()):
            near = [*get_close_matches(name, listed, n=1), *listed, "3mm/r07"][0]
            raise CapsuleError(f"nothing here names {name}; give a name such as {near}")
    with hold_run_lock():
        first = [path for paths in own.values() for path in paths]
        # The recordings go last, so after a kill the same command goes on.
        going = [*_resting_on(own, listed), *first]
        print("\n".join(displayed(str(path)) for path in first))
        print(len(going), WHAT_ELSE)
        if arguments.dry_run:
            return 0
        question = "Remove all this? [y/N] "
        if not (arguments.yes or (sys.stdin.isatty() and input(question).lower() == "y")):
            raise WrongOptionError("nothing was removed; to remove all this, add --yes")
        for path in going:
            path.unlink(missing_ok=True)
        for folder in (RESULTS, NOTES, SESSIONS):
            for path in sorted(folder.rglob("*"), reverse=True):
                if path.is_dir() and not any(path.iterdir()):
                    path.rmdir()
    return _tell_rest(trace)


def _plain(name: str) -> str:
    """Return a name without ``raw/`` and ``.csv``; refuse what leads out of the folder."""
    plain = Path(name).as_posix().removeprefix("raw/").removesuffix(".csv")
    if plain.count("/") != 1 or plain.startswith(("/", "../")) or plain.endswith("/.."):
        raise WrongOptionError(f"{displayed(name)} is no name such as 3mm/r07 or sessions/gut-7")
    return plain


def _of_header(arguments: argparse.Namespace, listed: Iterable[str]) -> list[str]:
    """Return the recordings whose header names the session or the site that was asked for."""
    wanted = {key: value for key in _KEYS if (value := getattr(arguments, key))}
    found: list[str] = []
    for name in listed if wanted else ():
        try:
            if wanted.items() & header_of(RAW / f"{name}.csv").items():
                found.append(name)
        except (RecordingError, OSError) as error:
            print(f"{name} is not removed, unless you name it: {error}")
    return found


def _own_files(name: str) -> list[Path]:
    """Return the files of a recording or of a survey, also one that is not finished."""
    if name.startswith(f"{SESSIONS}/"):
        return _files_below(Path(name))
    path = RAW / name
    beside = [path.with_name(f"{path.name}{ending}") for ending in ("", ".csv", f".csv{PART}")]
    of_record = RECORD_LOGS / f"{name}.log"
    return [each for each in (*beside, of_record) if each.is_symlink() or each.is_file()]


def _files_below(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.rglob("*")) if path.is_symlink() or path.is_file()]


def _resting_on(names: Collection[str], listed: Collection[str]) -> list[Path]:
    """Return what goes under results/ and among Snakemake's notes: all but the others' own."""
    wanted = read_settings(config_file())["recordings_per_job"]
    before, after = (files_of(each, wanted) for each in ({*listed, *names}, {*listed} - {*names}))
    stay = {RESULTS / path for path, held in after.items() if before.get(path) == held}
    for survey in sorted((RESULTS / "surveys").glob("*")):
        if f"{SESSIONS}/{survey.name}" not in names:
            stay |= {*_files_below(survey)}
    kept_notes = {base64.urlsafe_b64encode(os.fsencode(path)).decode() for path in stay}

    def is_kept(note: Path) -> bool:
        kind, *parts = note.relative_to(NOTES).parts
        # A long name is divided into folders.
        of = "".join(part.removeprefix("@") for part in parts)
        return kind in _OTHER_NOTES or (kind in _NAMED_NOTES and of in kept_notes)

    notes = [path for path in _files_below(NOTES) if not is_kept(path)]
    return [path for path in _files_below(RESULTS) if path not in stay] + notes


def _trace_of(own: Mapping[str, Iterable[Path]]) -> re.Pattern[bytes]:
    """Return what finds the names of recordings in a file, or a line of their readings."""
    # Slurm's logs have a line in place of the slash.
    names = [re.escape(name).replace("/", "[/_]").replace("sessions", "s[a-z]+s") for name in own]
    found = [rf"(?<![\w.+-])(?:{'|'.join(names)})(?![\w+-])".encode()]
    for path in (path for paths in own.values() for path in paths if path.is_file()):
        lines = files.read_beginning(path, 1_000_000).splitlines()
        middle = lines[len(lines) // 2 :][: path.suffix in (".csv", PART)]
        found += [re.escape(line) for line in middle if 15 < len(line) < 500]
    return re.compile(b"|".join(found))


def _looked_through() -> Iterator[Path]:
    """Yield the files below this folder, but not those of `_NOT_READ`."""
    for folder, folders, names in os.walk("."):
        passed_over = _NOT_READ if folder == "." else set()
        folders[:] = sorted({*folders} - passed_over)
        yield from (Path(folder, name) for name in sorted({*names} - passed_over))


def _holds(path: Path, trace: re.Pattern[bytes]) -> bool:
    """Return whether the path or the content of a file holds a trace."""
    is_read = path.is_file() and not path.is_symlink()
    content = files.read_limited(path, _MOST_BYTES) if is_read else None
    return bool(trace.search(os.fsencode(path)) or trace.search(content or b""))


def _tell_rest(trace: re.Pattern[bytes]) -> int:
    """Print which files still name what was removed, or could; return 1 if one does."""
    stayed = list(_looked_through())
    left = [path for path in stayed if _holds(path, trace)]
    for path in left:
        print(f"{displayed(str(path))} still names it, or holds its readings; remove it yourself")
    for path in stayed:
        is_read = path.suffix not in _PACKED and path.lstat().st_size <= _MOST_BYTES
        if not is_read and path.parts[0] != RESULTS.name:
            why = "may hold it, and is packed or large; look there yourself"
            print(f"{displayed(str(path))} {why}")
    print("Git keeps what was committed. Copies and exports in other folders stay, too.")
    return int(bool(left))
