"""How long the stages took, from their logs.

Imports nothing heavy: the Snakefile takes the list of rules from here.
"""

from pathlib import Path

from capsule.naming import folder_of
from capsule.page.provenance import seconds_in_log

# All rules before the report, in the order of the work.
RULES = (
    "preprocess",
    "index",
    "fit",
    "average",
    "passages",
    "features",
    "evaluate",
    "judge",
    "detect",
    "combine",
    "draw",
)


def read_durations(logs: Path, names: list[str]) -> list[dict]:
    """Add up how long each rule's scripts took, from the last lines of their logs.

    Parameters
    ----------
    logs : Path
        results/logs: a rule's log, or the folder of the logs of its jobs.
    names : list of str
        The recordings: each has its own jobs, and so has each of their folders.

    Returns
    -------
    list of dict
        ``rule``, ``jobs`` and ``seconds`` of each rule that has run.
    """
    jobs = [*names, *sorted(set(map(folder_of, names)))]
    rows = []
    for rule in RULES:
        single = logs / f"{rule}.log"
        paths = [single] if single.exists() else [logs / rule / f"{name}.log" for name in jobs]
        read = [path.read_text(encoding="utf-8") for path in paths if path.exists()]
        seconds = [s for s in map(seconds_in_log, read) if s is not None]
        if seconds:
            rows.append({"rule": rule, "jobs": len(seconds), "seconds": sum(seconds)})
    return rows
