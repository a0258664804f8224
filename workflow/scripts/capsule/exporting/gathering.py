"""Read the results that are exported: tables, arrays, and their provenance."""

import importlib.metadata
import json
import platform
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd

from capsule.arrays import FloatArray
from capsule.detectors.files import is_of, read_learned, read_templates
from capsule.engine.configuration import read_settings
from capsule.engine.project import PROJECT, read_project_state
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.files import TEXT, read_table
from capsule.kinds import Row, Settings
from capsule.recordings.held_out import recordings_with_fits
from capsule.recordings.names import size_label
from capsule.recordings.origin import combined_checksum, origin_of
from capsule.recordings.units import reading_unit
from capsule.store import files
from capsule.store.results import (
    BATCH_COLUMNS,
    CHECKS,
    FITS,
    MATRICES,
    SIGNALS,
    OfArchive,
    Results,
    changed_recordings,
)

NO_UNIT = "1"
RECORDINGS, EVALUATION, ALL = "recordings", "evaluation", "all"
CHOICES = (RECORDINGS, MATRICES, FITS, EVALUATION, ALL)
_LARGEST_BYTES = 1_000_000_000
# Whose the arrays of one kind are: each recording has one, or each size.
OWNER = {"readings": "recording", "matrix": "recording", "template": "size"}
# A NetCDF attribute is too small for the names of a large archive.
_MOST_NAMES = 20


@dataclass(frozen=True)
class Exported:
    """All data of one export.

    Attributes
    ----------
    what : str
        One of `CHOICES`.
    rate_hz : float
        Sampling rate of readings and matrices.
    tables : dict of str to DataFrame
        The tables, by names that workflow/schemas/columns.yaml describes.
    arrays : dict of str to dict of (S, K) arrays
        The ``readings`` and ``matrix`` of each recording, and the ``template`` of each size, NaN if
        a sample is missing; those of a rejected recording have no columns.
    reading_units : dict of str to str
        Unit of the readings of each accepted recording.
    headers : dict of str to dict
        The ``# key: value`` lines of each recording.
    provenance : dict of str to str
        Provenance of the data; the keys are plain names.
    """

    what: str
    rate_hz: float
    tables: dict[str, pd.DataFrame]
    arrays: dict[str, dict[str, FloatArray]]
    reading_units: dict[str, str]
    headers: dict[str, dict[str, str]]
    provenance: dict[str, str]

    def unit(self, array: str, name: str) -> str:
        """Return the unit of one array, empty if there are no readings."""
        return self.reading_units.get(name, "") if array == "readings" else NO_UNIT

    def along(self, array: str, name: str) -> pd.Index:
        """Return the ``time`` in s of readings, or each ``column`` of another array, from 1 on."""
        places = pd.RangeIndex(self.arrays[array][name].shape[1])
        if array == "readings":
            return (places / self.rate_hz).rename("time")
        return (places + 1).rename("column")

    def long_table(self, array: str) -> pd.DataFrame:
        """Return the arrays of one kind as one table, a row for each `OWNER` and place along it.

        A column is a sensor; the table's attribute ``unit`` names all units.
        """
        parts = self.arrays[array]
        tables = [pd.DataFrame(values.T, self.along(array, name)) for name, values in parts.items()]
        table = pd.concat(tables, keys=parts, names=[OWNER[array]])
        table.columns = pd.RangeIndex(1, table.shape[1] + 1, name="sensor")
        units = {self.unit(array, name) for name, values in parts.items() if values.size}
        table.attrs["unit"] = " or ".join(sorted(units)) or NO_UNIT
        return table


def gather(results: Path, config: Path, what: str) -> Exported:
    """Read the results that are exported, of the kind `what`, one of `CHOICES`.

    Raises
    ------
    CapsuleError
        A result is missing or damaged; the message names its file.
    """
    settings, wanted = read_settings(config), set(CHOICES) if what == ALL else {what}
    stored = Results.of_table(results, results / OfArchive.RECORDINGS)
    read = [results / OfArchive.RECORDINGS, results / OfArchive.PASSED_OVER]
    if EVALUATION in wanted:
        rates = [results / OfArchive.EVALUATION / f"{name}.csv" for name in COLUMNS]
        read += [results / OfArchive.PREDICTIONS, *rates, results / OfArchive.LEARNING]
        read += [results / OfArchive.DETECTIONS, results / OfArchive.SITES]
    tables = {path.stem: as_exported(read_table(path)) for path in read}
    # In which files the results stand is no property of a recording.
    listed = tables["recordings"] = tables["recordings"].drop(columns=[*BATCH_COLUMNS])
    names = listed["recording"].tolist()
    accepted = listed.loc[listed["status"] == "accepted", "recording"].tolist()
    rejected = dict.fromkeys(names, np.empty((settings["recording"]["sensors"], 0)))
    # A recording that was rejected because of its name alone has no check.
    checks = stored.checks(stored.names)
    read += [stored.file(CHECKS, name) for name in checks]
    headers = {name: checks[name]["header"] if name in checks else {} for name in names}
    lines = [(name, *line) for name, header in headers.items() for line in header.items()]
    tables["headers"] = pd.DataFrame(lines, columns=["recording", "key", "value"])
    arrays, units = {}, {}
    if RECORDINGS in wanted:
        read += [stored.file(SIGNALS, name) for name in accepted]
        arrays["readings"] = rejected | {name: stored.signal(name) for name in accepted}
        units = {name: reading_unit(headers[name], arrays["readings"][name]) for name in accepted}
        listed["reading_unit"] = [units.get(name, "") for name in names]
    if MATRICES in wanted:
        read += [stored.file(MATRICES, name) for name in accepted]
        arrays["matrix"] = rejected | {name: stored.matrix(name) for name in accepted}
    if FITS in wanted:
        teaching = {*recordings_with_fits(read[0], settings["evaluation"]["held_out"])}
        fits = stored.fits(name for name in names if name in teaching)
        templates = results / OfArchive.TEMPLATE_PARAMETERS, results / OfArchive.TEMPLATES
        read += [*(stored.file(FITS, name) for name in fits), *templates]
        tables["fits"] = _with_parameters(fits.values())
        means = files.read_or_explain(templates[0], files.read_json)["templates"]
        tables["templates"] = _with_parameters(means)
        rendered = read_templates(templates[1])
        arrays["template"] = {size_label(size): each for size, each in rendered.items()}
    # Several recordings may lie in one file.
    checksums = {
        path.relative_to(results.parent).as_posix(): files.fingerprint(path, _LARGEST_BYTES)
        for path in dict.fromkeys(read)
    }
    tables["files"] = pd.DataFrame(checksums.items(), columns=["path", "sha256"])
    provenance = provenance_of(listed, checksums, results, config, settings)
    rate_hz = float(settings["recording"]["rate_hz"])
    return Exported(what, rate_hz, tables, arrays, units, headers, provenance)


def as_exported(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table of results in which no text is unknown and each column has a type."""
    for name, values in table.items():
        if values.empty and name not in TEXT:
            table[name] = values.astype(float)
        elif not pd.api.types.is_numeric_dtype(values):
            table[name] = values.fillna("").astype(str)
    return table


def _with_parameters(contents: Iterable[Row]) -> pd.DataFrame:
    """Return a table of fits or templates, with a column for each parameter and sensor."""
    rows = []
    for content in contents:
        rows.append(dict(content))
        for name, values in (content["parameters"] or {}).items():
            rows[-1] |= {f"{name}_{sensor}": value for sensor, value in enumerate(values, start=1)}
    return as_exported(pd.DataFrame(rows).drop(columns="parameters"))


def provenance_of(
    listed: pd.DataFrame, read: Mapping[str, str], results: Path, config: Path, settings: Settings
) -> dict[str, str]:
    """Return the provenance of recordings, of the files that were read, and of the code.

    It also names the configuration, and what has changed since the results were made.
    """
    accepted, hashed = listed[listed["status"] == "accepted"], listed[listed["sha256"] != ""]
    origin, state = origin_of(accepted["source"]), read_project_state(PROJECT)
    learned, changed = results / OfArchive.DETECTORS, changed_recordings(results, settings)
    if learned.exists() and not is_of(read_learned(learned), settings):
        changed.insert(0, config.as_posix())
    return {
        "project": state.text(),
        "version": state.version or "not known",
        "commit": state.commit or "not known",
        "code_modified": "yes" if state.modified else "no",
        "exported": datetime.now(UTC).isoformat(timespec="seconds"),
        "origin": origin.kind,
        "sources": _listed([*origin.sources]) or "not named in the recordings",
        "recordings_accepted": str(len(accepted)),
        "recordings_rejected": str(len(listed) - len(accepted)),
        "recordings_sha256": combined_checksum(hashed.set_index("recording")["sha256"].to_dict()),
        "results_sha256": combined_checksum(read),
        "method": "Ge, Zong, Zhang and Nanayakkara, arXiv 2406.01371",
        "python": platform.python_version(),
        **{name: importlib.metadata.version(name) for name in ("numpy", "scipy", "pandas")},
        "results_out_of_date": _listed(changed) or "no",
        "configuration_file": config.name,
        "configuration": json.dumps(settings),
    }


def _listed(names: Sequence[str]) -> str:
    """Return the first names of a list as a text, with the number of further names."""
    more = [f"and {len(names) - _MOST_NAMES} more"] if len(names) > _MOST_NAMES else []
    return "; ".join([*names[:_MOST_NAMES], *more])
