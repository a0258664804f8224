"""Tell where recordings come from: their sources, their places, and that they are the same.

Passes over one place share its gut wall and its nodule. If one pass teaches a detector, the verdict
on another pass is not independent. So a place is the unit that is left out, counted and weighed.
"""

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


def places_of(rows: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    """Return the place of each recording.

    Recordings are of one place if their headers name the same site, or if they are near copies of
    each other. Both relations are joined: a near copy brings its whole site with it.

    Parameters
    ----------
    rows : mapping of str to mapping
        The rows of recordings.csv, with ``site`` and ``near_copies``. Names of recordings that have
        no row are passed over.

    Returns
    -------
    dict of str to str
        Two recordings have the same text exactly if they are of one place. The text is the name of
        the place's first recording, so it does not depend on what other places hold.
    """
    place = {name: name for name in rows}
    first_of_site: dict[str, str] = {}
    for name, row in rows.items():
        near = [other for other in row.get("near_copies", "").split() if other in place]
        if row.get("site"):
            near.append(first_of_site.setdefault(row["site"], name))
        for other in near:
            one, two = _root(place, name), _root(place, other)
            place[two] = one
    members: dict[str, list[str]] = {}
    for name in rows:
        members.setdefault(_root(place, name), []).append(name)
    return {name: names[0] for names in members.values() for name in names}


def _root(place: dict[str, str], name: str) -> str:
    while place[name] != name:
        name = place[name]
    return name
