"""Collect the provenance of an export: recordings, configuration, code and versions."""

import importlib.metadata
import json
import platform
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from capsule import files
from capsule.page.provenance import combined_checksum, origin_of
from capsule.project import PROJECT
from capsule.project_state import read_project_state
from capsule.results import read_or_explain

PAPER = "Ge, Zong, Zhang and Nanayakkara, arXiv 2406.01371"
_PACKAGES = ("numpy", "scipy", "pandas")
# A NetCDF attribute is too small for the names of a large archive.
_MOST_NAMES = 20


def provenance_of(
    results: Path,
    config: Path,
    settings: Mapping[str, Any],
    rows: Iterable[Mapping[str, str]],
    read: Mapping[str, str],
) -> dict[str, str]:
    """Return the provenance of an export.

    Parameters
    ----------
    results : Path
        The folder of results.
    config : Path
        The file of the configuration.
    settings : mapping
        The configuration.
    rows : iterable of mapping
        The rows of results/recordings.csv.
    read : mapping of str to str
        The SHA-256 of each file of results that was read, by its path.

    Returns
    -------
    dict of str to str
        The provenance; the keys are valid names in MATLAB and in other programs.
    """
    rows = list(rows)
    accepted = [row for row in rows if row["status"] == "accepted"]
    origin, state = origin_of(row["source"] for row in accepted), read_project_state(PROJECT)
    checksums = {row["recording"]: row["sha256"] for row in rows if row["sha256"]}
    return {
        "project": state.text(),
        "version": state.version or "not known",
        "commit": state.commit or "not known",
        "code_modified": "yes" if state.modified else "no",
        "exported": datetime.now(UTC).isoformat(timespec="seconds"),
        "origin": origin.kind,
        "sources": _listed(list(origin.sources)) or "not named in the recordings",
        "recordings_accepted": str(len(accepted)),
        "recordings_rejected": str(len(rows) - len(accepted)),
        "recordings_sha256": combined_checksum(checksums),
        "results_sha256": combined_checksum(read),
        "results_out_of_date": _listed(outdated(results, settings)) or "no",
        "configuration_file": config.name,
        "configuration": json.dumps(settings),
        "method": PAPER,
        "python": platform.python_version(),
        **{name: importlib.metadata.version(name) for name in _PACKAGES},
    }


def outdated(results: Path, settings: Mapping[str, Any]) -> list[str]:
    """Return the recordings that came, went or changed since the results were made from them.

    Parameters
    ----------
    results : Path
        The folder of results; the recordings are in the folder ``raw`` beside it.
    settings : mapping
        The configuration.
    """
    raw, table = results.resolve().parent / "raw", results / "recordings.csv"
    if not raw.is_dir() or not table.exists():
        return []
    limit = int(settings["recording"]["max_megabytes"] * 1e6)
    now = {
        name: files.fingerprint(raw / f"{name}.csv", limit)
        for name in files.list_archive(raw).recordings
    }
    checksums = read_or_explain(table, _checksums_in)
    # Without a checksum, the file could not be read or is not named like a recording.
    then = {name: checksum for name, checksum in checksums.items() if checksum}
    changed = {name for name, checksum in then.items() if now.get(name) != checksum}
    return [f"raw/{name}.csv" for name in sorted(changed | (now.keys() - checksums.keys()))]


def _checksums_in(table: Path) -> dict[str, str]:
    return {row["recording"]: row["sha256"] for row in files.read_csv(table)}


def _listed(names: Sequence[str]) -> str:
    """Return the first names of a list as a text, with the number of further names."""
    more = len(names) - _MOST_NAMES
    return "; ".join([*names[:_MOST_NAMES], *([f"and {more} more"] if more > 0 else [])])
