"""Write the file of a set of recordings, which Snakemake follows in place of the set's results.

It lists the results of the set's recordings with their checksums. The Snakefile uses this module,
so it imports only fast modules.
"""

import os
import shutil
from collections.abc import Callable, Iterable
from pathlib import Path

from edges import files
from edges.checksums import checksum
from edges.recording_files import recording_files
from edges.records import Record, record_path, stored_record

_SETS, _RECORDS = "sets", "records"
# Exists from a change of the sets' size until Snakemake's notes on the results are removed.
_CHANGED = f"{_RECORDS}/{_SETS}.changed"
# These folders below results/ hold no results.
_NOTES = {"logs", _RECORDS, _SETS}


def write_set_file(path: Path, results: Path, parts: Iterable[Record]) -> None:
    """Write the checksums of the results of a set's recordings, in the format of sha256sum.

    Parameters
    ----------
    path : Path
        The file of the set.
    results : Path
        The folder of results; the names in the file begin there.
    parts : iterable of Record
        The record of each recording.
    """
    written = {name: value for part in parts for name, value in part.written.items()}
    with files.write_whole(path) as stream:
        for name, value in sorted(written.items()):
            stream.write(f"{value}  {Path(os.path.relpath(name, results)).as_posix()}\n")


def take_over(path: Path, told: str, results: Path, stage: str, names: Iterable[str]) -> None:
    """Write the file and the record of a set without a job; all its recordings are up to date.

    Parameters
    ----------
    path : Path
        The file of the set. Its time stamp becomes that of the newest result in it, so that no
        later result counts as outdated.
    told : str
        The key of the set's job.
    results : Path
        The folder of results.
    stage : {"preprocess", "fit"}
        The stage.
    names : iterable of str
        The recordings of the set.
    """
    stored = (stored_record(recording_files(results, stage, name)[0]) for name in names)
    parts = [part for part in stored if part]
    write_set_file(path, results, parts)
    newest_s = max(Path(name).stat().st_mtime for part in parts for name in part.written)
    os.utime(path, (newest_s, newest_s))
    record = Record(told, written={path.as_posix(): checksum(path)})
    for part in parts:
        record.add_part(part)
    files.write_json(record_path(path), record.content())


def stand_in(path: Path, results: Path) -> None:
    """Write an empty file for a set whose file is missing, if there are any results.

    Snakemake does not look for a missing file if the results of later rules exist. An empty file
    does not fit, so its job and the later rules run.
    """
    if not path.exists() and (results / _RECORDS).is_dir():
        write_set_file(path, results, [])


def forget_recordings(results: Path, stage: str, names: Iterable[str]) -> None:
    """Remove the records of recordings, so that the job of their set makes them again."""
    for name in names:
        record_path(recording_files(results, stage, name)[0]).unlink(missing_ok=True)


def leave_other_sets(results: Path, most: int) -> None:
    """Remove the files of sets of another size, and mark that `forget_notes` is to be called.

    Parameters
    ----------
    results : Path
        The folder of results.
    most : int
        Largest number of recordings in a set; with 1, there are no sets.
    """
    folder, kept = results / _SETS, {str(most)} if most > 1 else set()
    present = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
    if present == kept or not results.is_dir():
        return
    files.write_json(results / _CHANGED, {"recordings_per_job": most})
    for name in present - kept:
        for parent in (folder, results / _RECORDS / _SETS):
            shutil.rmtree(parent / name, ignore_errors=True)
    if not kept:
        folder.rmdir()


def forget_notes(results: Path, forget: Callable[[str], object]) -> None:
    """Remove Snakemake's notes on all results, if the sets have another size than before.

    The inputs of later rules then have other names, which Snakemake takes for a change. Nothing is
    lost: the record of a result says whether it fits.

    Parameters
    ----------
    results : Path
        The folder of results.
    forget : callable
        Removes Snakemake's notes on a file.
    """
    if not (results / _CHANGED).exists():
        return
    for place in results.iterdir():
        if place.name not in _NOTES:
            for path in [place, *place.rglob("*")]:
                forget(path.as_posix())
    (results / _CHANGED).unlink()
