"""Read the durations of the workflow's steps from their logs.

The Snakefile reads the list of rules from this module, so it imports only fast modules.
"""

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from capsule.figures.registry import SOURCES
from capsule.job_sets import search_sets
from capsule.page.provenance import seconds_in_log
from edges.reading import read_whole

# All rules before the rule report, in the order in which they run. Each is also the name of a
# script; `draw` stands for the rules of all sources of figures, such as draw_templates.
RULES = (
    "preprocess",
    "preprocess_set",
    "index",
    "fit",
    "fit_set",
    "average",
    "passages",
    "features",
    "evidence",
    "evaluate",
    "judge",
    "detect",
    "combine",
    "draw",
    "page_files",
    "chart_survey",
)


def read_durations(
    logs: Path, names: Iterable[str], surveys: Sequence[str] = ()
) -> list[dict[str, Any]]:
    """Add up the durations of each rule's jobs, from the last lines of their logs.

    Parameters
    ----------
    logs : Path
        results/logs, with the log of each rule or a folder with the logs of its jobs.
    names : iterable of str
        Names of all recordings of the archive; a job belongs to one of them or to a set of them.
    surveys : sequence of str
        Names of the surveys; each has one job.

    Returns
    -------
    list of dict
        ``rule``, ``jobs`` and ``seconds`` of each rule that has run.
    """
    recordings = list(names)
    jobs = {*recordings, *search_sets(recordings)}
    others = {"draw": set(SOURCES), "chart_survey": set(surveys)}
    rows = []
    for rule in RULES:
        folder = logs / rule
        if folder.is_dir():
            paths = _logs_of(folder, others.get(rule, jobs))
        else:
            paths = [path for path in [logs / f"{rule}.log"] if path.exists()]
        read = [read_whole(path).decode("utf-8") for path in paths]
        seconds = [s for s in map(seconds_in_log, read) if s is not None]
        if seconds:
            rows.append({"rule": rule, "jobs": len(seconds), "seconds": sum(seconds)})
    return rows


def _logs_of(folder: Path, jobs: set[str]) -> list[Path]:
    """Return the logs in a rule's folder that belong to some jobs; it may hold many others."""
    # Cut off as text, because `relative_to` would take seconds for thousands of logs.
    job = slice(len(f"{folder.as_posix()}/"), -len(".log"))
    logs = (path for path in folder.rglob("*.log") if path.as_posix()[job] in jobs)
    return sorted(logs, key=os.fspath)
