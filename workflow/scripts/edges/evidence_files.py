"""Read and write the evidence of a set of recordings that the report draws."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from edges import files


@dataclass(frozen=True)
class StoredEvidence:
    """The part of what the report shows of a recording that no other recording changes.

    Attributes
    ----------
    quality : str
        Its quality in words.
    drawn : str
        From `capsule.page.recording_evidence`, as JSON that `capsule.page.packing` has deflated.
    """

    quality: str
    drawn: str


def write_evidence(path: Path, evidence: Mapping[str, StoredEvidence]) -> None:
    """Write the evidence of some recordings."""
    files.write_json(path, {name: asdict(each) for name, each in evidence.items()})


def read_evidence(paths: Iterable[Path], recordings: Iterable[str]) -> dict[str, StoredEvidence]:
    """Read the evidence of some recordings from the files that hold it."""
    wanted, evidence = set(recordings), {}
    for path in paths:
        stored = files.read_json(path)
        for name in wanted.intersection(stored):
            evidence[name] = StoredEvidence(**stored[name])
    return evidence
