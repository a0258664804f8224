"""How long the stages took, from their logs."""

from pathlib import Path

from capsule.report.provenance import seconds_in_log

RULES = (
    "preprocess",
    "index",
    "fit",
    "average",
    "passages",
    "evaluate",
    "judge",
    "detect",
    "combine",
    "draw",
)


def read_durations(logs: Path, names: list[str]) -> list[dict]:
    """Add up how long each rule's scripts took, from the last lines of their logs."""
    rows = []
    for rule in RULES:
        single = logs / f"{rule}.log"
        paths = [single] if single.exists() else [logs / rule / f"{name}.log" for name in names]
        read = [path.read_text(encoding="utf-8") for path in paths if path.exists()]
        seconds = [s for s in map(seconds_in_log, read) if s is not None]
        if seconds:
            rows.append({"rule": rule, "jobs": len(seconds), "seconds": sum(seconds)})
    return rows
