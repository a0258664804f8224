"""Archives of a bench, and many healthy recordings beside them, as judge_thresholds.py needs them.

To simulate and describe recordings takes longer than all that is computed with them. So a folder
may keep what describes them.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from unseen_archives import (
    Description,
    Readings,
    UnseenArchive,
    describe,
    read_description,
    simulated,
    stored,
    write_description,
)

from capsule.detectors.described import read_scorer
from capsule.detectors.taught import Taught
from capsule.phantom.files import BENCHES, DEFAULT_TABLE
from capsule.phantom.simulation import SIMULATOR_VERSION
from capsule.recordings.names import size_mm

# No earlier table, search or choice used these seeds. Each healthy recording has one of its own,
# and so a set-up of its own.
FIRST_SEED, FIRST_HEALTHY_SEED = 460_000, 465_000
ARCHIVES, HEALTHY = 40, 1200
# In the place of an archive's number: a healthy recording outside all archives.
OUTSIDE = -1


@dataclass(frozen=True)
class Pool:
    """What the detectors see of the recordings of one bench; NaN of those without a verdict.

    Attributes
    ----------
    bench
        Name of the bench.
    archive
        Number of each recording's archive, or `OUTSIDE`, (n,).
    sizes_mm
        True sizes, (n,).
    seen
        What the detector `taught` sees, (n, 194).
    evidence
        Score of the detector `diagonal`, (n,).
    """

    bench: str
    archive: np.ndarray
    sizes_mm: np.ndarray
    seen: np.ndarray
    evidence: np.ndarray


def pool_of(
    bench: str, folder: Path | None, config: Mapping, weights: Path, cache: Path | None
) -> Pool:
    """Simulate, or read, the recordings of a bench and describe them.

    Parameters
    ----------
    bench
        Name of the bench.
    folder
        Folder of stored archives; None for a bench that is simulated.
    config, weights
        The configuration, and the file of the network's weights.
    cache
        Folder that keeps what describes the recordings; code that describes them in another way
        needs another one.
    """
    path = cache and cache / f"{bench}.npz"
    key = _key(bench, folder, config, weights)
    described = read_description(path, key) if path else None
    if described is None:
        readings = dict(_named(bench, folder))
        archive = UnseenArchive(readings, {name: name for name in readings}, {})
        described = describe(archive, config, read_scorer(weights))
        if path:
            write_description(path, described, key)
    return _seen(bench, described)


def _named(bench: str, folder: Path | None) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the recordings, by names such as ``2mm/r01 7`` of archive 7, ``0mm/r01 outside 7``."""
    archives = stored(folder) if folder else simulated(bench, ARCHIVES, FIRST_SEED)
    for number, readings in enumerate(archives):
        yield from ((f"{name} {number}", values) for name, values in readings.items())
    outside: Iterator[Readings] = iter(())
    if folder is None:
        outside = simulated(bench, HEALTHY, FIRST_HEALTHY_SEED, 1, (0,))
    for number, readings in enumerate(outside):
        yield from ((f"{name} outside {number}", each) for name, each in readings.items())


def _key(bench: str, folder: Path | None, config: Mapping, weights: Path) -> str:
    """Return a text that differs if the recordings, or what describes them, would differ."""
    made_from = [bench, ARCHIVES, HEALTHY, FIRST_SEED, FIRST_HEALTHY_SEED, SIMULATOR_VERSION]
    made_from += [config["recording"], config["diagonal"]]
    digest = hashlib.sha256(json.dumps(made_from, sort_keys=True).encode())
    files = sorted(folder.glob("*.npz")) if folder else BENCHES.glob(f"{bench}.yaml")
    for path in (weights, DEFAULT_TABLE, *files):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _seen(bench: str, described: Description) -> Pool:
    names = list(described.places)
    recordings = [
        SimpleNamespace(features=described.features[name], passage=described.passages[name])
        for name in names
    ]
    seen = np.array([Taught.seen(each) for each in recordings], dtype=float)
    evidence = np.array([each.passage.evidence for each in recordings])
    unknown = np.array([bool(described.no_verdict[name]) for name in names])
    seen[unknown | np.isnan(seen[:, 0])] = np.nan
    evidence[unknown] = np.nan
    return Pool(
        bench,
        np.array([OUTSIDE if "outside" in name else int(name.split()[-1]) for name in names]),
        np.array([size_mm(name) for name in names]),
        seen,
        evidence,
    )
