"""The files of recordings under results/: where they stand, and how they are read and written.

Up to 500 recordings, each has files of its own, such as results/matrices/3mm/r07.npy. In a larger
archive, one file holds a batch of recordings, such as results/matrices/3mm/batch-01.npz. `Results`
finds a recording in either. A batch depends on the recordings' names alone.

The Snakefile and every script use this module, so it imports nothing but numpy and fast modules.
"""

import functools
import hashlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache, partial
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from capsule.arrays import FloatArray
from capsule.kinds import Settings
from capsule.recordings.names import Entry, classify, folder_of
from capsule.store import files
from capsule.store.files import Read, read_or_explain


class OfArchive:
    """Names below results/ of what is made from the whole archive."""

    RECORDINGS = "recordings.csv"
    PASSED_OVER = "passed_over.csv"
    TEMPLATES = "templates.npz"
    TEMPLATE_PARAMETERS = "templates.json"
    DETECTORS = "detectors.json"
    EVALUATION = "evaluation"
    PREDICTIONS = "evaluation/predictions.csv"
    LEARNING = "evaluation/learning.csv"
    DETECTIONS = "detections.csv"
    SITES = "sites.csv"
    FIGURES = "figures"
    SURVEYS = "surveys"
    REPORT = "report.html"
    LOGS = "logs"


# What the page shows of a survey, in the folder of its own below results/surveys/.
SURVEY_VALUES = "survey.json"

SIGNALS, MATRICES, CHECKS, FITS = "signals", "matrices", "checks", "fits"
BEST_PLACES, FEATURES, PLOT_DATA = "best_places", "features", "plot_data"
_SUFFIX = {CHECKS: ".json", FITS: ".json"}
_SUFFIX |= {BEST_PLACES: ".csv", FEATURES: ".npz", PLOT_DATA: ".json"}
# These kinds of files hold the batches of the rule describe.
DESCRIBED = (BEST_PLACES, FEATURES, PLOT_DATA)
# Archives of a large run stay open, because recordings are read in the order of their content.
_MOST_OPEN = 200

# Up to this many recordings, each is a batch of its own; beyond, batches of some ten, then of some
# hundred. Batches are divided in halves, so most hold less than the largest number.
_EACH_ALONE, _IN_TENS = 500, 5000
TENS, HUNDREDS = 16, 160
# To describe a recording takes some 60 ms, and a job of its own would take four times as long.
DESCRIBED_TOGETHER = 100


def pattern(kind: str, size: int) -> str:
    """Return the path of one kind of file below results/, with ``{batch}`` in it.

    Parameters
    ----------
    kind : str
        `SIGNALS` to `PLOT_DATA`.
    size : int
        Largest number of recordings in a batch.
    """
    suffix = _SUFFIX.get(kind, ".npy" if size == 1 else ".npz")
    return f"{kind}/{{batch}}{suffix}"


class Results:
    """The files of the recordings of an archive under results/.

    Parameters
    ----------
    folder : Path
        The folder of results.
    recordings : iterable of str
        All recordings of the archive, or all of some of its folders, or of a batch of describe.
    size : int
        Largest number of recordings in a batch.
    within : str
        The batch of the rule describe, if the recordings are those of one.

    Attributes
    ----------
    names : tuple of str
        The recordings.
    """

    def __init__(
        self, folder: Path, recordings: Iterable[str], size: int, within: str = ""
    ) -> None:
        self.folder, self._size = folder, size
        self.names = tuple(recordings)
        self._batch = _batch_of(batches(self.names, size, within))
        self._described = _batch_of(described_together(self.names, size, within))

    @classmethod
    def of_table(cls, folder: Path, recordings: Path, size: int) -> "Results":
        """Return the results of the recordings that a table lists, such as recordings.csv."""
        return cls(folder, _listed_in(recordings), size)

    @classmethod
    def on_disk(cls, folder: Path, wanted: int | str = "auto") -> "Results":
        """Return the results that stand in a folder, whatever the size of their batches.

        Parameters
        ----------
        folder : Path
            The folder of results, with ``recordings.csv``.
        wanted : int or str
            ``recordings_per_job`` of the configuration; other sizes are tried too.
        """
        names = _listed_in(folder / OfArchive.RECORDINGS)
        # A run may have been given another size, as on a cluster.
        usual = [batch_size(len(names), wanted), 1, TENS, HUNDREDS]
        sizes = dict.fromkeys([*usual, *range(2, 1001)])
        for size in sizes:
            found = cls(folder, names, size)
            if all(found.file(CHECKS, name).exists() for name in names):
                return found
        return cls(folder, names, next(iter(sizes)))

    def file(self, kind: str, recording: str) -> Path:
        """Return the file of one kind that holds a recording."""
        batch = (self._described if kind in DESCRIBED else self._batch)[recording]
        return self.folder / pattern(kind, self._size).format(batch=batch)

    def signal(self, recording: str) -> FloatArray:
        """Return the readings of a recording on an even grid in time, (S, K)."""
        return read_array(self.file(SIGNALS, recording), recording)

    def matrix(self, recording: str) -> FloatArray:
        """Return the padded matrix V of a recording, (S, L)."""
        return read_array(self.file(MATRICES, recording), recording)

    def checks(self, recordings: Iterable[str]) -> dict[str, dict[str, Any]]:
        """Return the outcome of the check of each recording."""
        return self.contents(CHECKS, recordings)

    def fits(self, recordings: Iterable[str]) -> dict[str, dict[str, Any]]:
        """Return the fit of each recording of a nodule."""
        return self.contents(FITS, recordings)

    def described(
        self, kind: str, recordings: Iterable[str], read: Callable[[Path], Mapping[str, Read]]
    ) -> dict[str, Read]:
        """Return what a file of one kind holds of each recording; each file is read once.

        Parameters
        ----------
        kind : str
            One of `DESCRIBED`.
        recordings : iterable of str
            The recordings.
        read : callable
            ``read(path)`` returns what a file holds, by recording.
        """
        found: dict[str, Read] = {}
        for path, names in self._by_file(kind, recordings):
            content = read_or_explain(path, read)
            found |= {name: content[name] for name in names if name in content}
        return found

    def contents(self, kind: str, recordings: Iterable[str]) -> dict[str, dict[str, Any]]:
        """Return the checks or the fits of recordings, `CHECKS` or `FITS`, in the same order."""
        wanted = list(recordings)
        found: dict[str, dict[str, Any]] = {}
        for path, names in self._by_file(kind, wanted):
            found |= read_or_explain(path, partial(_contents_in, names))
        return {name: found[name] for name in wanted}

    def _by_file(self, kind: str, recordings: Iterable[str]) -> Iterator[tuple[Path, list[str]]]:
        grouped: dict[Path, list[str]] = {}
        for name in recordings:
            grouped.setdefault(self.file(kind, name), []).append(name)
        yield from grouped.items()


def files_of(recordings: Iterable[str], wanted: int | str) -> dict[str, list[str]]:
    """Return the files of an archive's recordings, below results/, with what each holds.

    Parameters
    ----------
    recordings : iterable of str
        All recordings of the archive.
    wanted : int or str
        ``recordings_per_job`` of the configuration.
    """
    names = list(recordings)
    size = batch_size(len(names), wanted)
    divided, described = batches(names, size), described_together(names, size)
    return {
        pattern(kind, size).format(batch=batch): held
        for kind in (SIGNALS, MATRICES, CHECKS, FITS, *DESCRIBED)
        for batch, held in (described if kind in DESCRIBED else divided).items()
    }


def left_over(
    folder: Path,
    size: int,
    now: Mapping[str, Iterable[str]],
    described: Mapping[str, Iterable[str]],
) -> list[str]:
    """Return the files under results/ that hold recordings or batches that are gone, sorted.

    Parameters
    ----------
    folder : Path
        The folder of results.
    size : int
        Largest number of recordings in a batch.
    now, described : mapping
        The batches, and those of the rule describe, by their names.
    """
    found = []
    for kind in (SIGNALS, MATRICES, CHECKS, FITS, *DESCRIBED):
        known = described if kind in DESCRIBED else now
        suffix = Path(pattern(kind, size)).suffix
        for path in (folder / kind).glob("*/*"):
            batch = path.relative_to(folder / kind).with_name(path.name.removesuffix(suffix))
            if not path.name.endswith(suffix) or batch.as_posix() not in known:
                found.append(path.as_posix())
    return sorted(found)


def changed_recordings(folder: Path, settings: Settings) -> list[str]:
    """Return the recordings that came, went or changed since the results were made from them.

    Parameters
    ----------
    folder : Path
        The folder of results; the recordings are in the folder ``raw`` beside it.
    settings : mapping
        The configuration.
    """
    raw, table = folder.resolve().parent / "raw", folder / OfArchive.RECORDINGS
    if not raw.is_dir() or not table.exists():
        return []
    limit = int(settings["recording"]["max_megabytes"] * 1e6)
    now = {
        name: files.fingerprint(raw / f"{name}.csv", limit)
        for name in files.list_archive(raw).recordings
    }
    listed = read_or_explain(table, files.read_csv)
    then = {row["recording"]: row["sha256"] for row in listed}
    # Without a checksum, the file could not be read or is not named like a recording.
    changed = {name for name, checksum in then.items() if checksum and now.get(name) != checksum}
    return [f"raw/{name}.csv" for name in sorted(changed | (now.keys() - then.keys()))]


def _contents_in(names: Iterable[str], path: Path) -> dict[str, dict[str, Any]]:
    content = files.read_json(path)
    # The file of a single recording holds its content itself.
    return {name: content if content.get("recording") == name else content[name] for name in names}


def _listed_in(table: Path) -> tuple[str, ...]:
    """Return the recordings of a table that have files; some rows name files that are none."""
    rows = read_or_explain(table, files.read_csv)
    return classify(Entry(f"{row['recording']}.csv") for row in rows).recordings


def write_arrays(path: Path, arrays: Mapping[str, FloatArray]) -> None:
    """Write the array of one recording (.npy), or the arrays of several by their names (.npz)."""
    with files.write_whole(path, "wb") as stream:
        if path.suffix == ".npy":
            (array,) = arrays.values()
            np.save(stream, array)
        else:
            # Names hold a slash, as the paths in a zip archive may.
            named: dict[str, Any] = {**arrays}
            np.savez(stream, **named)


def write_contents(path: Path, contents: Mapping[str, Mapping[str, Any]], batch: str) -> None:
    """Write the content of the recording that is the batch, or of several by names (.json)."""
    alone = list(contents) == [batch]
    files.write_json(path, contents[batch] if alone else contents)


def read_array(path: Path, recording: str) -> FloatArray:
    """Read the array of a recording from a file that `write_arrays` has written."""

    def read(path: Path) -> FloatArray:
        if path.suffix == ".npy":
            return _array_in(files.read_whole(path))
        return _array_in(_opened(path, os.getpid()).read(f"{recording}.npy"))

    return read_or_explain(path, read)


@lru_cache(maxsize=_MOST_OPEN)
def _opened(path: Path, process: int) -> ZipFile:
    """Open an archive once for each process: forks must not share a position in a file."""
    return ZipFile(path)


def _array_in(content: bytes) -> FloatArray:
    """Return the array in the content of an .npy file.

    Many files have the same header, so it is understood once. np.load would take four times as
    long, and thousands of matrices are read in a row.
    """
    begin = content.index(b"\n") + 1
    shape, kind = _header(content[:begin])
    array: FloatArray = np.frombuffer(content, kind, offset=begin).reshape(shape)
    return array


@lru_cache(maxsize=4096)
def _header(header: bytes) -> tuple[tuple[int, ...], np.dtype[np.float64]]:
    """Return shape and type of the array behind a header of numpy's format 1.0."""
    stream = BytesIO(header)
    np.lib.format.read_magic(stream)
    shape, _, kind = np.lib.format.read_array_header_1_0(stream)
    return shape, kind


def _batch_of(divided: Mapping[str, Iterable[str]]) -> dict[str, str]:
    return {name: batch for batch, names in divided.items() for name in names}


def batch_size(recordings: int, wanted: int | str) -> int:
    """Return the largest number of recordings in one batch.

    Parameters
    ----------
    recordings : int
        Number of recordings of the archive.
    wanted : int or str
        ``recordings_per_job`` of the configuration: a number, or ``auto``.
    """
    if isinstance(wanted, int):
        return wanted
    if recordings <= _EACH_ALONE:
        return 1
    return TENS if recordings <= _IN_TENS else HUNDREDS


def batches(recordings: Iterable[str], most: int, within: str = "") -> dict[str, list[str]]:
    """Divide recordings into batches.

    With ``most`` 1, each recording is a batch and gives it its name. Otherwise, a batch holds the
    recordings of one folder whose checksums begin with the same bits. A larger batch than allowed
    is divided by the next bit. A recording that comes or goes therefore changes only its own batch,
    which is then divided, or joined with its other half. This is extendible hashing (R. Fagin, J.
    Nievergelt, N. Pippenger and H. R. Strong, ACM Transactions on Database Systems 4, 1979).

    Each batch of a small size lies within one batch of a larger size.

    Parameters
    ----------
    recordings : iterable of str
        Names such as ``3mm/r07``, no name twice.
    most : int
        Largest number of recordings in a batch.
    within : str
        The larger batch, if the recordings are those of one; otherwise they are all recordings of
        some folders. The same batches have the same names in both cases.

    Returns
    -------
    dict of str to list of str
        The recordings of each batch, sorted, by the batch's name: ``3mm/batch`` for all of a small
        folder, ``3mm/batch-01`` for the bits 01.
    """
    if most == 1:
        return {name: [name] for name in sorted(recordings)}
    waiting: dict[str, list[str]] = {}
    for name in sorted(recordings):
        waiting.setdefault(within or f"{folder_of(name)}/batch", []).append(name)
    # A name is divided several times.
    bits_of = functools.cache(_bits)
    divided = {}
    while waiting:
        label, names = waiting.popitem()
        if len(names) <= most:
            divided[label] = names
            continue
        # "3mm/batch" is divided into "3mm/batch-0" and "3mm/batch-1", and so on.
        beginning = label if "-" in label else f"{label}-"
        place = len(beginning.partition("-")[2])
        for name in names:
            waiting.setdefault(beginning + bits_of(name)[place], []).append(name)
    return dict(sorted(divided.items()))


def described_together(
    recordings: Iterable[str], most: int, within: str = ""
) -> dict[str, list[str]]:
    """Divide recordings into the batches of the rule describe, from batches of `most` or larger."""
    return batches(recordings, max(most, DESCRIBED_TOGETHER), within)


def _bits(name: str) -> str:
    return f"{int.from_bytes(hashlib.sha256(name.encode()).digest()):0256b}"
