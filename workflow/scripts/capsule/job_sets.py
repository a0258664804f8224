"""Divide recordings into sets for one job each; a set depends on the recordings' names alone.

The Snakefile divides the archive at every start, so this module imports only fast modules.
"""

import functools
import hashlib
from collections.abc import Iterable

from capsule.naming import folder_of

# Searching a recording and scoring it take some 30 ms, so one recording more repeats at most three
# seconds of work.
_SEARCHED_TOGETHER = 100


def job_sets(recordings: Iterable[str], most: int) -> dict[str, list[str]]:
    """Divide recordings into sets for one job each.

    A set holds the recordings of one folder whose checksums begin with the same bits. A larger set
    than allowed is divided by the next bit. A recording that comes or goes therefore changes only
    its own set, which is then divided, or joined with its other half. This is extendible hashing
    (R. Fagin, J. Nievergelt, N. Pippenger and H. R. Strong, ACM Transactions on Database Systems 4,
    1979).

    Parameters
    ----------
    recordings : iterable of str
        Names such as ``3mm/r07``, no name twice.
    most : int
        Largest number of recordings in a set.

    Returns
    -------
    dict of str to list of str
        The recordings of each set, sorted, by the set's name: ``3mm/set-01`` for the bits 01.
    """
    waiting: dict[str, list[str]] = {}
    for name in sorted(recordings):
        waiting.setdefault(f"{folder_of(name)}/set", []).append(name)
    # A name is divided several times.
    bits_of = functools.cache(_bits)
    sets = {}
    while waiting:
        label, names = waiting.popitem()
        if len(names) <= most:
            sets[label] = names
            continue
        # "3mm/set" is divided into "3mm/set-0" and "3mm/set-1", and these into "3mm/set-00" ...
        beginning = label if "-" in label else f"{label}-"
        place = len(beginning.partition("-")[2])
        for name in names:
            waiting.setdefault(beginning + bits_of(name)[place], []).append(name)
    return dict(sorted(sets.items()))


def search_sets(recordings: Iterable[str]) -> dict[str, list[str]]:
    """Divide recordings into sets for the jobs that search and score them.

    Parameters
    ----------
    recordings : iterable of str
        Names of all recordings of the archive.

    Returns
    -------
    dict of str to list of str
        The recordings of each set: ``3mm`` for all of a small folder, ``3mm/set-01`` for a part.
    """
    sets = job_sets(recordings, _SEARCHED_TOGETHER)
    return {label.removesuffix("/set"): names for label, names in sets.items()}


def _bits(name: str) -> str:
    return f"{int.from_bytes(hashlib.sha256(name.encode()).digest()):0256b}"
