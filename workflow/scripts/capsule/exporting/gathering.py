"""Read the results that are exported: tables, matrices with named axes, and their provenance."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from capsule import files
from capsule.evaluation.columns import COLUMNS
from capsule.exporting.columns import NO_UNIT, PARAMETERS, Column, Table, table_of
from capsule.exporting.provenance import provenance_of
from capsule.held_out import teaching
from capsule.kinds import Settings
from capsule.results import (
    CHECKS,
    FITS,
    MATRICES,
    SIGNALS,
    Read,
    Results,
    read_array,
    read_or_explain,
)
from capsule.units import reading_unit

RECORDINGS, EVALUATION, ALL = "recordings", "evaluation", "all"
CHOICES = (RECORDINGS, MATRICES, FITS, EVALUATION, ALL)
_LARGEST_BYTES = 1_000_000_000
_FIT = ["recording", "size_mm", "seed", "first_peak", "lag", "accepted_moves"]
_FIT += ["rmse_initial", "rmse"]
_EVALUATION = {
    "evaluation/predictions": "verdict of each detector on each recording, under each scheme",
    **{f"evaluation/{name}": f"evaluation: {name.replace('_', ' ')}" for name in COLUMNS},
    "evaluation/learning": "rates that the detectors reach with parts of the archive",
    "detections": "verdict of each detector on each unlabelled recording",
    "sites": "one verdict for each site with several passes",
}


@dataclass(frozen=True)
class Matrices:
    """A group of matrices: one for each recording, or one for each size of a template.

    Attributes
    ----------
    name, long_name : str
        Name and description of the group.
    of : {"recording", "size"}
        Kind of item that each matrix belongs to.
    values : mapping of str to (S, K) array
        Matrices by names such as ``3mm/r07`` or ``3mm``; NaN if a sample is missing. A rejected
        recording has K = 0.
    units : mapping of str to str
        Unit of the values of each matrix, by the same names.
    rate_hz : float, optional
        Sampling rate if the second axis is time in s; otherwise it counts the columns from 1. The
        first axis is ``sensor``, counted from 1.
    """

    name: str
    long_name: str
    of: str
    values: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    rate_hz: float | None = None

    @property
    def axis(self) -> tuple[str, str]:
        """Name and unit of the second axis."""
        return ("time", "s") if self.rate_hz else ("column", NO_UNIT)

    @property
    def coordinate(self) -> np.ndarray:
        """Positions on the second axis of the columns of the longest matrix, (n,)."""
        longest = max((matrix.shape[1] for matrix in self.values.values()), default=0)
        return np.arange(longest) / self.rate_hz if self.rate_hz else np.arange(1, longest + 1)

    @property
    def unit(self) -> str:
        """The common unit; if the recordings differ, all units, joined by "or"."""
        return " or ".join(sorted(set(self.units.values()))) or NO_UNIT

    @property
    def sensors(self) -> int:
        """Number of sensors S."""
        return max((matrix.shape[0] for matrix in self.values.values()), default=0)

    def table(self) -> Table:
        """Return one long table; each row is a column of a matrix, and each sensor a column."""
        lengths = [matrix.shape[1] for matrix in self.values.values()]
        of = np.repeat(np.array([*self.values], dtype=object), lengths)
        coordinate, (axis, unit) = self.coordinate, self.axis
        along = np.concatenate([coordinate[:length] for length in lengths] or [np.empty(0)])
        columns = {
            self.of: Column("", f"name of the {self.of}", of),
            axis if unit == NO_UNIT else f"{axis}_{unit}": Column(unit, axis, along),
        }
        for sensor in range(self.sensors):
            parts = [matrix[sensor] for matrix in self.values.values()]
            what = f"{self.long_name}, sensor {sensor + 1}"
            columns[f"sensor_{sensor + 1}"] = Column(self.unit, what, np.concatenate(parts))
        return Table(self.long_name, columns)


@dataclass(frozen=True)
class Exported:
    """All data of one export.

    Attributes
    ----------
    what : str
        Kind of the exported data, such as ``recordings`` or ``all``.
    rate_hz : float
        Sampling rate of readings and matrices.
    tables : mapping of str to Table
        The tables by names of letters, digits and underscores.
    matrices : sequence of Matrices
        The matrices.
    headers : mapping of str to mapping
        The ``# key: value`` lines of each recording.
    provenance : mapping of str to str
        Provenance of the data; the keys are plain names.
    """

    what: str
    rate_hz: float
    tables: Mapping[str, Table]
    matrices: list[Matrices]
    headers: Mapping[str, Mapping[str, str]]
    provenance: Mapping[str, str]


class _Stored:
    """The folder of results, and the files that were read from it."""

    def __init__(self, folder: Path, recordings_per_job: int | str) -> None:
        self._folder = folder
        self._read: dict[Path, None] = {}
        self.listed = self.cells("recordings")
        self.recordings = Results.on_disk(folder, recordings_per_job)

    def read(self, path: Path, how: Callable[[Path], Read]) -> Read:
        """Read a file in a given way, and note it."""
        self._read[path] = None
        return read_or_explain(path, how)

    def cells(self, name: str) -> dict[str, list[str]]:
        """Read the columns of a table; every cell is a text."""
        return self.read(self._folder / f"{name}.csv", _cells_of)

    def array(self, kind: str, name: str) -> np.ndarray:
        """Read the array of a recording, `SIGNALS` or `MATRICES`."""
        return self.read(self.recordings.file(kind, name), lambda path: read_array(path, name))

    def contents(self, kind: str, names: Collection[str]) -> dict[str, dict[str, Any]]:
        """Read the checks or the fits of recordings, `CHECKS` or `FITS`."""
        self._read |= dict.fromkeys(self.recordings.file(kind, name) for name in names)
        return self.recordings.contents(kind, names)

    def files(self) -> dict[str, list[str]]:
        """Return path and checksum of each file that was read, as the columns of a table."""
        paths = [path.relative_to(self._folder).as_posix() for path in self._read]
        return {
            "path": [f"{self._folder.name}/{path}" for path in paths],
            "sha256": [files.fingerprint(path, _LARGEST_BYTES) for path in self._read],
        }


def gather(
    results: Path,
    config: Path,
    settings: Settings,
    what: str,
    tell: Callable[[int, int], None],
) -> Exported:
    """Read the results that are exported.

    Parameters
    ----------
    results : Path
        The folder of results.
    config : Path
        The file of `settings`.
    settings : mapping
        The configuration.
    what : str
        One of `CHOICES`.
    tell : callable
        Function that is called with the numbers of recordings read and of all recordings.

    Returns
    -------
    Exported

    Raises
    ------
    CapsuleError
        A result is missing or damaged; the message names its file.
    """
    wanted = set(CHOICES) if what == ALL else {what}
    stored = _Stored(results, settings["recordings_per_job"])
    cells = stored.listed
    lines = zip(*cells.values(), strict=True)
    rows = {
        row["recording"]: row for row in (dict(zip(cells, line, strict=True)) for line in lines)
    }
    accepted = {name for name, row in rows.items() if row["status"] == "accepted"}
    # A recording that was rejected because of its name alone has no check.
    checks = stored.contents(CHECKS, stored.recordings.names)
    headers = {name: checks[name]["header"] if name in checks else {} for name in rows}
    none = np.empty((settings["recording"]["sensors"], 0))
    kinds = {RECORDINGS: SIGNALS, MATRICES: MATRICES}
    arrays: dict[str, dict[str, np.ndarray]] = {kinds[part]: {} for part in kinds if part in wanted}
    for done, name in enumerate(rows, start=1):
        for kind, of_kind in arrays.items():
            of_kind[name] = stored.array(kind, name) if name in accepted else none
        tell(done, len(rows))
    rate_hz = float(settings["recording"]["rate_hz"])
    matrices = []
    if RECORDINGS in wanted:
        long_name, signals = "accepted readings on an even grid in time", arrays[SIGNALS]
        units = {
            name: reading_unit(headers[name], signals[name]) for name in rows if name in accepted
        }
        cells["reading_unit"] = [units.get(name, "") for name in cells["recording"]]
        matrices.append(Matrices("readings", long_name, "recording", signals, units, rate_hz))
    if MATRICES in wanted:
        long_name = "padded matrix V after pre-processing, in standard deviations"
        matrices.append(_unitless("matrix", long_name, "recording", arrays[MATRICES]))
    tables = {
        "recordings": table_of("every file of the archive", cells),
        "headers": table_of("the header lines of each recording", _header_cells(headers)),
        "passed_over": table_of("files that are not recordings", stored.cells("passed_over")),
    }
    if FITS in wanted:
        teach = teaching(rows, settings["evaluation"]["held_out"])
        fitted = [
            name
            for name, row in teach.items()
            if name in accepted and float(row["size_mm"] or 0) and not row["no_verdict"]
        ]
        fits = list(stored.contents(FITS, fitted).values())
        tables["fits"] = _with_parameters("the particle fitted to each recording", _FIT, fits)
        means = stored.read(results / "templates.json", files.read_json)["templates"]
        long_name, columns = "averaged parameters of each size", ["size_mm", "recordings"]
        tables["templates"] = _with_parameters(long_name, columns, means)
        templates = stored.read(results / "templates.npz", _arrays_of)
        long_name = "template T of a size, in standard deviations"
        matrices.append(_unitless("template", long_name, "size", templates))
    if EVALUATION in wanted:
        for name, long_name in _EVALUATION.items():
            tables[Path(name).name] = table_of(long_name, stored.cells(name))
    read = stored.files()
    checksums = dict(zip(read["path"], read["sha256"], strict=True))
    provenance = provenance_of(results, config, settings, rows.values(), checksums)
    tables["files"] = table_of("files that were read", read)
    return Exported(what, rate_hz, tables, matrices, headers, provenance)


def _unitless(name: str, long_name: str, of: str, values: Mapping[str, np.ndarray]) -> Matrices:
    return Matrices(name, long_name, of, values, dict.fromkeys(values, NO_UNIT))


def _cells_of(path: Path) -> dict[str, list[str]]:
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    return {name: table[name].tolist() for name in table}


def _arrays_of(path: Path) -> dict[str, np.ndarray]:
    with np.load(path) as stored:
        return dict(stored)


def _header_cells(headers: Mapping[str, Mapping[str, str]]) -> dict[str, list[str]]:
    lines = [(name, *line) for name, header in headers.items() for line in header.items()]
    names = ("recording", "key", "value")
    return {name: [line[place] for line in lines] for place, name in enumerate(names)}


def _with_parameters(
    long_name: str, columns: Iterable[str], contents: Sequence[Mapping[str, Any]]
) -> Table:
    """Return a table with one column for each parameter and sensor."""
    cells = {key: [str(content[key]) for content in contents] for key in columns}
    for key in PARAMETERS:
        of_each = [(content["parameters"] or {}).get(key, ()) for content in contents]
        for sensor in range(max(map(len, of_each), default=0)):
            cells[f"{key}_{sensor + 1}"] = [
                repr(values[sensor]) if sensor < len(values) else "" for values in of_each
            ]
    return table_of(long_name, cells)
