"""The folder of the runs: whether Snakemake can work there, and whether its results are known.

The Snakefile uses this module at every start, so it imports only fast modules.
"""

import contextlib
import itertools
import os
import secrets
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from capsule.errors import CapsuleError, error_line
from capsule.store.files import UNFINISHED, write_whole
from capsule.store.results import OfArchive

_HEAD_BYTES = 2000
# Each run writes its sign into the results, and into a file beside Snakemake's notes on them. If
# both differ, the notes are not on these results.
SIGN = "run.txt"
# Below results/: what is not made by a job.
_NOT_MADE = {OfArchive.LOGS, SIGN}
# The first line of the report from the start of a run until a new report is complete.
OUTDATED = (
    b'<p class="outdated" role="alert">This report is out of date: recordings, settings or code '
    b"have changed since. Make it again: <code>snakemake -c2 results/report.html</code></p>\n"
)


@contextlib.contextmanager
def told_as(kind: Callable[[str], Exception]) -> Iterator[None]:
    """Raise an error of the input or of the disk as one of this kind, in one line."""
    try:
        yield
    except CapsuleError as error:
        raise kind(str(error)) from None
    except OSError as error:
        raise kind(error_line(error)) from None


def refuse_folders(project: Path, here: Path) -> None:
    """Raise an error if Snakemake cannot run in the folder `here` with the steps of the project.

    It takes a brace in a name for a wildcard, and it keeps notes in the folder, even of a dry run.
    """
    for folder in (project, here):
        if set("{}") & set(str(folder)):
            raise CapsuleError(
                f"{folder}: rename this folder; Snakemake cannot work in a folder whose name holds "
                "{ or }"
            )
    notes = here / ".snakemake"
    # Another user's folder may be open to all, and what it holds may not.
    for path in (here, notes, *notes.glob("*"), notes / "iocache" / "latest.pkl"):
        if path.exists() and not os.access(path, os.W_OK):
            raise CapsuleError(
                f"{path} cannot be written, and Snakemake keeps notes there; have its owner allow "
                "it, or run it in a folder of your own that holds raw/ and config/ (capsule new "
                "NAME makes one)"
            )


def refuse_unknown_results(results: Path, notes: Path) -> None:
    """Raise an error if results are there, but not Snakemake's notes on them, in .snakemake.

    Without its notes, or with those on other results, Snakemake takes any result for one that fits.
    """
    if not results.is_dir() or not any(_made_in(results)):
        return
    if not any(_is_filled(notes / name) for name in ("metadata", "incomplete")):
        raise CapsuleError(
            f"Snakemake's notes on {results}/, in {notes}/metadata/, are gone, so nobody knows "
            f"whether these results fit the recordings; remove {results}/ and run again"
        )
    known, _, of = _read(notes / SIGN).partition(" ")
    if known and of == str(results) and known not in _read(results / SIGN).split():
        raise CapsuleError(
            f"{results}/ is not what the last run of this folder has left there, but a copy from "
            "elsewhere or from before, so nobody knows whether these results fit the recordings; "
            f"remove {results}/ and run again, or put back what that run has left"
        )


def _made_in(results: Path) -> Iterator[Path]:
    """Yield the files that jobs have made; a run that has just begun has made folders alone."""
    for path in results.iterdir():
        if path.name not in _NOT_MADE:
            yield from (each for each in itertools.chain([path], path.rglob("*")) if each.is_file())


def sign_results(results: Path, notes: Path) -> None:
    """Write a new sign into the results, and into a file beside Snakemake's notes on them."""
    before, sign = _read(notes / SIGN).partition(" ")[0], secrets.token_hex(8)
    # If this process is killed in between, the results still have the sign beside the notes.
    for path, text in (
        (results / SIGN, f"{before} {sign}"),
        (notes / SIGN, f"{sign} {results}"),
        (results / SIGN, sign),
    ):
        with write_whole(path) as stream:
            stream.write(f"{text}\n")


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8").strip() if path.is_file() else ""


def _is_filled(folder: Path) -> bool:
    return folder.is_dir() and any(folder.iterdir())


def tidy(folder: Path) -> None:
    """Remove the temporary files of killed processes, and take back dates in the future.

    A file has such a date if a clock was set back. Snakemake fails at a job whose result is older
    than what it is made from.
    """
    now_s = time.time()
    for path in folder.rglob("*"):
        if path.name.startswith(".") and path.name.endswith(UNFINISHED):
            path.unlink(missing_ok=True)
        elif path.lstat().st_mtime > now_s:
            os.utime(path, (now_s, now_s), follow_symlinks=False)


def mark_outdated(page: Path, *, outdated: bool) -> None:
    """Add the line "out of date" to a page, or remove it; the rest of the page does not change."""
    if not page.exists():
        return
    content = page.read_bytes()
    plain = content.replace(OUTDATED, b"")
    wanted = plain.replace(b"<body>\n", b"<body>\n" + OUTDATED, 1) if outdated else plain
    if wanted != content:
        with write_whole(page, "wb") as stream:
            stream.write(wanted)


def is_made_from(page: Path, key: str) -> bool:
    """Return whether a page names the key of the job that would make it now."""
    # Only the head of the page names it.
    with page.open("rb") as stream:
        return key.encode() in stream.read(_HEAD_BYTES)
