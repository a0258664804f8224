"""Tell where recordings come from, by the sources in their headers, and that they are the same."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Origin:
    """The origin of the recordings, as their headers state it.

    Attributes
    ----------
    kind : {"simulated", "recorded", "imported", "mixed", "unknown", "none"}
        ``unknown`` if no recording states its source, ``none`` if there is no recording.
    simulated, imported, recorded, silent : int
        Number of recordings whose source is simulated, the name of an imported file alone, another
        source, or not stated.
    sources : dict of str to int
        Number of recordings of each source that is stated.
    """

    kind: str
    simulated: int
    imported: int
    recorded: int
    silent: int
    sources: dict[str, int]

    def parts(self) -> list[str]:
        """Return the number of recordings of each kind in words, without those of none."""
        kinds = {
            "simulated": self.simulated,
            "imported without a word on their source": self.imported,
            "from another source": self.recorded,
            "without a source in the header": self.silent,
        }
        return [f"{count} {what}" for what, count in kinds.items() if count]


def is_simulated(source: str) -> bool:
    """Return whether the header's ``source`` states that a recording is simulated."""
    return "simulat" in source.casefold()


def is_imported(source: str) -> bool:
    """Return whether ``source`` names an imported file alone: the laboratory named no source."""
    return source.startswith("imported from ")


def origin_of(sources: Iterable[str]) -> Origin:
    """Return the origin of the accepted recordings, from the sources in their headers."""
    counted: dict[str, int] = {}
    for source in sources:
        counted[source.strip()] = counted.get(source.strip(), 0) + 1
    silent = counted.pop("", 0)
    simulated = sum(count for source, count in counted.items() if is_simulated(source))
    named = {source: count for source, count in counted.items() if not is_simulated(source)}
    imported = sum(count for source, count in named.items() if is_imported(source))
    recorded = sum(named.values()) - imported
    numbers = {"simulated": simulated, "imported": imported, "recorded": recorded}
    kinds = [name for name, count in (numbers | {"unknown": silent}).items() if count]
    kind = kinds[0] if len(kinds) == 1 else ("mixed" if kinds else "none")
    return Origin(kind, simulated, imported, recorded, silent, dict(sorted(counted.items())))


def combined_checksum(checksums: Mapping[str, str]) -> str:
    """Return one SHA-256 for many named files: that of the lines ``checksum  name``, by name.

    It equals the SHA-256 of what ``sha256sum`` prints for the sorted list of files.
    """
    lines = "".join(f"{checksums[name]}  {name}\n" for name in sorted(checksums))
    return hashlib.sha256(lines.encode("utf-8")).hexdigest()
