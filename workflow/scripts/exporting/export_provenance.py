"""Collect the provenance of an export: recordings, configuration, code and versions."""

import contextlib
import importlib.metadata
import json
import platform
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

from capsule.page.provenance import combined_checksum, origin_of
from edges.project_state import read_project_state
from edges.records import files_that_do_not_fit

PROJECT = Path(__file__).resolve().parents[3]
PAPER = "Ge, Zong, Zhang and Nanayakkara, arXiv 2406.01371"
_PACKAGES = ("numpy", "scipy", "pandas")
# A NetCDF attribute is too small for the names of a large archive.
_MOST_NAMES = 20


def provenance_of(
    results: Path,
    config: Path,
    settings: Mapping,
    rows: Iterable[Mapping[str, str]],
    read: Iterable[Mapping[str, str]],
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
    read : iterable of mapping
        ``path`` and ``sha256`` of the results that were read.

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
        "results_sha256": combined_checksum({row["path"]: row["sha256"] for row in read}),
        "results_out_of_date": _listed(outdated(results)) or "no",
        "configuration_file": config.name,
        "configuration": json.dumps(settings),
        "method": PAPER,
        "python": platform.python_version(),
        **{name: importlib.metadata.version(name) for name in _PACKAGES},
    }


def outdated(results: Path) -> list[str]:
    """Return the files that have changed since the results were made from them."""
    with contextlib.chdir(results.resolve().parent):
        return files_that_do_not_fit("results/report.html") if results.name == "results" else []


def _listed(names: Sequence[str]) -> str:
    """Return the first names of a list as a text, with the number of further names."""
    more = len(names) - _MOST_NAMES
    return "; ".join([*names[:_MOST_NAMES], *([f"and {more} more"] if more > 0 else [])])
