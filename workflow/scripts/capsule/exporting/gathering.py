"""Read the results that are exported into the classes of `capsule.exporting.exported`."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from capsule.converter import reading_unit
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.paper import TABLES
from capsule.exporting.checked_files import CheckedFiles
from capsule.exporting.column_words import PARAMETERS
from capsule.exporting.export_provenance import provenance_of
from capsule.exporting.exported import NO_UNIT, Exported, Matrices, Table
from capsule.exporting.text_columns import table_of
from capsule.held_out import is_held_out
from capsule.results import CHECKS, SIGNALS
from capsule.results import FITS as FITS_OF_RECORDINGS
from capsule.results import MATRICES as MATRICES_OF_RECORDINGS

RECORDINGS, MATRICES, FITS, EVALUATION = "recordings", "matrices", "fits", "evaluation"
ALL = "all"
CHOICES = (RECORDINGS, MATRICES, FITS, EVALUATION, ALL)
_FIT = ["recording", "size_mm", "seed", "first_peak", "lag", "accepted_moves"]
_FIT += ["rmse_initial", "rmse"]
_EVALUATION = {
    "predictions": "verdict of each detector on each recording, under each scheme",
    **{name: f"evaluation: {name.replace('_', ' ')}" for name in (*TABLES, *COLUMNS)},
    "learning": "rates that the detectors reach with parts of the archive",
}
_VERDICTS = {
    "detections": "verdict of each detector on each unlabelled recording",
    "sites": "one verdict for each site with several passes",
}


def gather(
    results: Path,
    config: Path,
    settings: Mapping[str, Any],
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
    stored = CheckedFiles(results, settings["recordings_per_job"])
    wanted = set(CHOICES) if what == ALL else {what}
    rows, columns = stored.rows("recordings.csv"), stored.columns("recordings.csv")
    headers, tables, matrices = {}, [], []
    signals, shapes = {}, {}
    none = np.empty((settings["recording"]["sensors"], 0))
    checks = stored.contents(CHECKS, stored.recordings.names)
    for done, row in enumerate(rows, start=1):
        name, accepted = row["recording"], row["status"] == "accepted"
        # A recording that was rejected because of its name alone has no check.
        headers[name] = checks[name]["header"] if name in checks else {}
        if RECORDINGS in wanted:
            signals[name] = stored.array(SIGNALS, name) if accepted else none
            row["reading_unit"] = reading_unit(headers[name], signals[name]) if accepted else ""
        if MATRICES in wanted:
            shapes[name] = stored.array(MATRICES_OF_RECORDINGS, name) if accepted else none
        tell(done, len(rows))
    rate_hz = float(settings["recording"]["rate_hz"])
    if RECORDINGS in wanted:
        units = {row["recording"]: row["reading_unit"] for row in rows if row["reading_unit"]}
        matrices.append(_readings(signals, units, rate_hz))
        columns.append("reading_unit")
    tables.append(table_of("recordings", "every file of the archive", columns, rows))
    tables.append(_headers_table(headers))
    tables.append(_whole(stored, "passed_over.csv", "files that are not recordings"))
    if MATRICES in wanted:
        long_name = "padded matrix V after pre-processing, in standard deviations"
        matrices.append(_by_column("matrix", long_name, "recording", shapes))
    if FITS in wanted:
        tables += [_fits(stored, rows, settings["evaluation"]["held_out"]), _templates(stored)]
        long_name = "template T of a size, in standard deviations"
        matrices.append(_by_column("template", long_name, "size", stored.arrays("templates.npz")))
    if EVALUATION in wanted:
        tables += _evaluation(stored)
    provenance = provenance_of(results, config, settings, rows, stored.read)
    tables.append(table_of("files", "files that were read", ["path", "sha256"], stored.read))
    return Exported(what, rate_hz, tuple(tables), tuple(matrices), headers, provenance)


def _headers_table(headers: Mapping[str, Mapping[str, str]]) -> Table:
    rows = [
        {"recording": name, "key": key, "value": value}
        for name, header in headers.items()
        for key, value in header.items()
    ]
    columns = ["recording", "key", "value"]
    return table_of("headers", "the header lines of each recording", columns, rows)


def _whole(stored: CheckedFiles, name: str, long_name: str) -> Table:
    """Read a whole table."""
    stem = Path(name).stem
    return table_of(stem, long_name, stored.columns(name), stored.rows(name))


def _readings(
    signals: Mapping[str, np.ndarray], units: Mapping[str, str], rate_hz: float
) -> Matrices:
    longest = max((signal.shape[1] for signal in signals.values()), default=0)
    time_s = np.arange(longest) / rate_hz
    long_name = "accepted readings on an even grid in time"
    return Matrices("readings", long_name, units, "recording", "time", "s", time_s, signals)


def _by_column(name: str, long_name: str, of: str, matrices: Mapping[str, np.ndarray]) -> Matrices:
    longest = max((matrix.shape[1] for matrix in matrices.values()), default=0)
    columns = np.arange(1, longest + 1)
    units = dict.fromkeys(matrices, NO_UNIT)
    return Matrices(name, long_name, units, of, "column", NO_UNIT, columns, matrices)


def _fits(
    stored: CheckedFiles, rows: Iterable[Mapping[str, str]], held_out: Collection[str]
) -> Table:
    """Read the fits that the templates are made from."""
    names = [
        row["recording"]
        for row in rows
        if row["status"] == "accepted" and float(row["size_mm"] or 0) and not row["no_verdict"]
        if not is_held_out(row["recording"], row.get("session"), held_out)
    ]
    fits = list(stored.contents(FITS_OF_RECORDINGS, names).values())
    return _with_parameters("fits", "the particle fitted to each recording", _FIT, fits)


def _templates(stored: CheckedFiles) -> Table:
    content = stored.content("templates.json")["templates"]
    columns = ["size_mm", "recordings"]
    return _with_parameters("templates", "averaged parameters of each size", columns, content)


def _with_parameters(
    name: str, long_name: str, columns: list[str], contents: Iterable[Mapping[str, Any]]
) -> Table:
    """Return a table with one column for each parameter and sensor."""
    spread = [
        {
            f"{key}_{sensor}": repr(value)
            for key in PARAMETERS
            for sensor, value in enumerate((content["parameters"] or {}).get(key, ()), start=1)
        }
        for content in contents
    ]
    names = max(spread, key=len, default={})
    rows = [
        {key: str(content[key]) for key in columns} | dict.fromkeys(names, "") | parameters
        for content, parameters in zip(contents, spread, strict=True)
    ]
    return table_of(name, long_name, [*columns, *names], rows)


def _evaluation(stored: CheckedFiles) -> Iterator[Table]:
    for name, long_name in _EVALUATION.items():
        yield _whole(stored, f"evaluation/{name}.csv", long_name)
    for name, long_name in _VERDICTS.items():
        yield _whole(stored, f"{name}.csv", long_name)
