"""The files of recordings under results/: where they stand, and how they are read and written.

A batch is what one job does, and what one file holds. Up to 500 recordings, each is a batch of its
own, with files such as results/matrices/3mm/r07.npy. In a larger archive, a batch holds several, as
in results/matrices/3mm/batch-01.npz, so that the start of a job costs less than its work. The rules
divide the archive, by the recordings' names alone. Their jobs get the paths of a batch, and the
table of recordings names the batch of each, by which `Results` finds it.

Every script uses this module, so it imports nothing but numpy and fast modules.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from capsule.arrays import FloatArray
from capsule.kinds import Settings
from capsule.recordings.names import folder_of
from capsule.store import files
from capsule.store.files import Read, read_or_explain

# Up to this many recordings, each is a batch of its own; beyond, batches of some ten, then of some
# hundred. Batches are divided in halves, so most hold less than the largest number.
_EACH_ALONE, _IN_TENS = 500, 5000
TENS, HUNDREDS = 16, 160
# To describe a recording takes some 10 ms, and to collect what the page draws of it some 30: a job
# of its own would take many times as long.
DESCRIBED_TOGETHER = 100


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
# These kinds of files hold the batches of the rules describe and plot.
DESCRIBED = (BEST_PLACES, FEATURES, PLOT_DATA)
# Columns of the table of recordings: its batch, and its batch of those rules.
BATCH_COLUMNS = BATCH, DESCRIBED_BATCH = "batch", "described_batch"
# Archives of a large run stay open, because recordings are read in the order of their content.
_MOST_OPEN = 200


@dataclass(frozen=True)
class Division:
    """An archive, divided into batches.

    Attributes
    ----------
    size : int
        Largest number of recordings in a batch; of the rules describe and plot, it may be more.
    batches, described : dict of str to list of str
        The recordings of each batch, and of each batch of the rules describe and plot, which join
        batches because their work on a recording is short.
    """

    size: int
    batches: dict[str, list[str]]
    described: dict[str, list[str]]

    @property
    def alone(self) -> bool:
        """Whether each recording is a batch of its own."""
        return self.size == 1

    def joined(self) -> dict[str, list[str]]:
        """Return the batches that each batch of the rules describe and plot joins."""
        batch_of = {name: batch for batch, names in self.batches.items() for name in names}
        return {
            batch: sorted({batch_of[name] for name in names})
            for batch, names in self.described.items()
        }


def divide(recordings: Iterable[str], wanted: int | str) -> Division:
    """Divide an archive into batches; `wanted` is the key ``recordings_per_job``."""
    names = list(recordings)
    size = batch_size(len(names), wanted)
    return Division(size, batches(names, size), batches(names, max(size, DESCRIBED_TOGETHER)))


def batch_size(recordings: int, wanted: int | str) -> int:
    """Return the largest number of recordings in a batch; `wanted` is ``recordings_per_job``."""
    if isinstance(wanted, int):
        return wanted
    if recordings <= _EACH_ALONE:
        return 1
    return TENS if recordings <= _IN_TENS else HUNDREDS


def batches(recordings: Iterable[str], most: int) -> dict[str, list[str]]:
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
        waiting.setdefault(f"{folder_of(name)}/batch", []).append(name)
    # A name is divided several times.
    bits_of = cache(_bits)
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


def _bits(name: str) -> str:
    return f"{int.from_bytes(hashlib.sha256(name.encode()).digest()):0256b}"


def pattern(kind: str, *, alone: bool) -> str:
    """Return the path of one kind of file below results/, with ``{batch}`` in it.

    `alone` says whether each recording is a batch of its own.
    """
    suffix = _SUFFIX.get(kind, ".npy" if alone else ".npz")
    return f"{kind}/{{batch}}{suffix}"


def read_checks(
    folder: Path, described: Mapping[str, Iterable[str]]
) -> tuple[dict[str, dict[str, str]], dict[str, dict[str, Any]]]:
    """Return the batches of each recording, by `BATCH_COLUMNS`, and the outcome of its check.

    `described` gives the batches that each batch of the rule describe joins.
    """
    rows: dict[str, dict[str, str]] = {}
    checks: dict[str, dict[str, Any]] = {}
    for described_batch, held in described.items():
        for batch in held:
            content = contents_in([folder / pattern(CHECKS, alone=True).format(batch=batch)])
            rows |= {name: {BATCH: batch, DESCRIBED_BATCH: described_batch} for name in content}
            checks |= content
    return rows, checks


class Results:
    """The files of the recordings of an archive under results/.

    Parameters
    ----------
    folder : Path
        The folder of results.
    rows : mapping of str to mapping
        The batches of each recording, by the columns of `BATCH_COLUMNS`: rows of the table of
        recordings, or from `read_checks`.
    """

    def __init__(self, folder: Path, rows: Mapping[str, Mapping[str, str]]) -> None:
        self.folder, self._rows = folder, rows
        self._alone = all(row[BATCH] == name for name, row in rows.items())

    @classmethod
    def of_table(cls, folder: Path, table: Path) -> "Results":
        """Return the results of the recordings that a table lists, such as recordings.csv."""
        rows = {row["recording"]: row for row in read_or_explain(table, files.read_csv)}
        # Some rows name files that are no recordings.
        return cls(folder, {name: row for name, row in rows.items() if row.get(BATCH)})

    @property
    def names(self) -> tuple[str, ...]:
        """The recordings."""
        return tuple(self._rows)

    def file(self, kind: str, recording: str) -> Path:
        """Return the file of one kind that holds a recording."""
        batch = self._rows[recording][DESCRIBED_BATCH if kind in DESCRIBED else BATCH]
        return self.folder / pattern(kind, alone=self._alone).format(batch=batch)

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
            found |= read_or_explain(path, partial(_contents_of, names))
        return {name: found[name] for name in wanted}

    def _by_file(self, kind: str, recordings: Iterable[str]) -> Iterator[tuple[Path, list[str]]]:
        grouped: dict[Path, list[str]] = {}
        for name in recordings:
            grouped.setdefault(self.file(kind, name), []).append(name)
        yield from grouped.items()


def left_over(folder: Path, division: Division) -> list[str]:
    """Return the files under results/ that hold recordings or batches that are gone, sorted."""
    found = []
    for kind in (SIGNALS, MATRICES, CHECKS, FITS, *DESCRIBED):
        known = division.described if kind in DESCRIBED else division.batches
        suffix = Path(pattern(kind, alone=division.alone)).suffix
        for path in (folder / kind).glob("*/*"):
            batch = path.relative_to(folder / kind).with_name(path.name.removesuffix(suffix))
            if batch.as_posix() not in known:
                found.append(path.as_posix())
    return sorted(found)


def changed_recordings(folder: Path, settings: Settings) -> list[str]:
    """Return the recordings that came, went or changed since the results were made from them.

    The recordings are in the folder ``raw`` beside the results.
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


def contents_in(paths: Iterable[Path]) -> dict[str, dict[str, Any]]:
    """Return the content of each recording in files that `write_contents` has written."""
    found: dict[str, dict[str, Any]] = {}
    for path in paths:
        found |= read_or_explain(path, _contents)
    return found


def _contents_of(names: Iterable[str], path: Path) -> dict[str, dict[str, Any]]:
    content = _contents(path)
    return {name: content[name] for name in names}


def _contents(path: Path) -> dict[str, dict[str, Any]]:
    content = files.read_json(path)
    # The file of a single recording holds its content itself.
    alone = content.get("recording")
    return {alone: content} if isinstance(alone, str) else content


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


def arrays_in(paths: Iterable[Path], recordings: Iterable[str]) -> Iterator[tuple[str, FloatArray]]:
    """Yield each recording with its array, from the files of a job.

    Parameters
    ----------
    paths : iterable of Path
        Files that `write_arrays` has written: one of each recording (.npy), or of several (.npz).
    recordings : iterable of str
        The recordings of the job; those of files of one recording, in the order of the files.
    """
    listed = list(paths)
    if listed[0].suffix == ".npy":
        holding = dict(zip(recordings, listed, strict=True))
    else:
        of_file = {
            path: {name.removesuffix(".npy") for name in read_or_explain(path, _names)}
            for path in listed
        }
        holding = {name: path for name in recordings for path in listed if name in of_file[path]}
    for name, path in holding.items():
        yield name, read_array(path, name)


def _names(path: Path) -> list[str]:
    return _opened(path).namelist()


def read_array(path: Path, recording: str) -> FloatArray:
    """Read the array of a recording from a file that `write_arrays` has written."""

    def read(path: Path) -> FloatArray:
        if path.suffix == ".npy":
            content = files.read_whole(path)
        else:
            content = _opened(path).read(f"{recording}.npy")
        array: FloatArray = np.lib.format.read_array(BytesIO(content), allow_pickle=False)
        return array

    return read_or_explain(path, read)


@lru_cache(maxsize=_MOST_OPEN)
def _opened(path: Path) -> ZipFile:
    """Open an archive once."""
    return ZipFile(path)
