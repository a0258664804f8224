"""Divide an archive into batches of recordings: what one job does.

A recording is a unit of work of its own in an archive of up to 500. Beyond, batches are the unit,
so that the start of a job costs less than its work. Only the rules divide, and the table of
recordings names the batch of each.

The Snakefile uses this module at every start, so it imports only fast modules.
"""

import functools
import hashlib
from collections.abc import Iterable
from dataclasses import dataclass

from capsule.recordings.names import folder_of

# Up to this many recordings, each is a batch of its own; beyond, batches of some ten, then of some
# hundred. Batches are divided in halves, so most hold less than the largest number.
_EACH_ALONE, _IN_TENS = 500, 5000
TENS, HUNDREDS = 16, 160
# To describe a recording takes some 10 ms, and to collect what the page draws of it some 30: a job
# of its own would take many times as long.
DESCRIBED_TOGETHER = 100


@dataclass(frozen=True)
class Division:
    """An archive, divided into batches.

    Attributes
    ----------
    size : int
        Largest number of recordings in a batch; of the rules describe and plot, it may be more.
    batches, described : dict of str to list of str
        The recordings of each batch, and of each batch of the rules describe and plot, which join
        batches because their work on a recording is short.
    """

    size: int
    batches: dict[str, list[str]]
    described: dict[str, list[str]]

    @property
    def alone(self) -> bool:
        """Whether each recording is a batch of its own."""
        return self.size == 1

    def joined(self) -> dict[str, list[str]]:
        """Return the batches that each batch of the rules describe and plot joins."""
        batch_of = {name: batch for batch, names in self.batches.items() for name in names}
        return {
            batch: sorted({batch_of[name] for name in names})
            for batch, names in self.described.items()
        }


def divide(recordings: Iterable[str], wanted: int | str) -> Division:
    """Divide an archive into batches; `wanted` is the key ``recordings_per_job``."""
    names = list(recordings)
    size = batch_size(len(names), wanted)
    return Division(size, batches(names, size), batches(names, max(size, DESCRIBED_TOGETHER)))


def batch_size(recordings: int, wanted: int | str) -> int:
    """Return the largest number of recordings in a batch; `wanted` is ``recordings_per_job``."""
    if isinstance(wanted, int):
        return wanted
    if recordings <= _EACH_ALONE:
        return 1
    return TENS if recordings <= _IN_TENS else HUNDREDS


def batches(recordings: Iterable[str], most: int) -> dict[str, list[str]]:
    """Divide recordings into batches.

    With ``most`` 1, each recording is a batch and gives it its name. Otherwise, a batch holds the
    recordings of one folder whose checksums begin with the same bits. A larger batch than allowed
    is divided by the next bit. A recording that comes or goes therefore changes only its own batch,
    which is then divided, or joined with its other half. This is extendible hashing (R. Fagin, J.
    Nievergelt, N. Pippenger and H. R. Strong, ACM Transactions on Database Systems 4, 1979).

    Each batch of a small size lies within one batch of a larger size.

    Parameters
    ----------
    recordings : iterable of str
        Names such as ``3mm/r07``, no name twice.
    most : int
        Largest number of recordings in a batch.

    Returns
    -------
    dict of str to list of str
        The recordings of each batch, sorted, by the batch's name: ``3mm/batch`` for all of a small
        folder, ``3mm/batch-01`` for the bits 01.
    """
    if most == 1:
        return {name: [name] for name in sorted(recordings)}
    waiting: dict[str, list[str]] = {}
    for name in sorted(recordings):
        waiting.setdefault(f"{folder_of(name)}/batch", []).append(name)
    # A name is divided several times.
    bits_of = functools.cache(_bits)
    divided = {}
    while waiting:
        label, names = waiting.popitem()
        if len(names) <= most:
            divided[label] = names
            continue
        # "3mm/batch" is divided into "3mm/batch-0" and "3mm/batch-1", and so on.
        beginning = label if "-" in label else f"{label}-"
        place = len(beginning.partition("-")[2])
        for name in names:
            waiting.setdefault(beginning + bits_of(name)[place], []).append(name)
    return dict(sorted(divided.items()))


def _bits(name: str) -> str:
    return f"{int.from_bytes(hashlib.sha256(name.encode()).digest()):0256b}"
