"""The archives by which judge_unseen.py judges, and what describes their recordings.

Describing a recording (its best place, the network's features) takes longer than judging it, and no
archive teaches it. So a folder may keep what describes an archive, and several versions of the
detectors can be judged on the same archives.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from judged_only import BENCHES as JUDGED_ONLY_BENCHES
from judged_only import simulate_judged_only

from capsule.detectors.beats import series_of
from capsule.detectors.network import Features, Scorer
from capsule.detectors.search import Passage, passage_of
from capsule.detectors.wave import missing_wave, wave_of
from capsule.errors import CapsuleError
from capsule.phantom.files import BENCHES, DEFAULT_TABLE, read_phantom
from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import SIMULATOR_VERSION, planned_runs, simulate_run
from capsule.recordings.names import size_mm
from capsule.store.files import write_whole

SIZES_MM, RUNS = (0, 1, 2, 3, 4, 5), 20
USUAL = "usual"
# No earlier table, search or choice used these seeds: archives, and fresh healthy recordings, each
# with a seed of its own and so with a set-up of its own.
FIRST_SEED, FIRST_FRESH_SEED = 420_000, 430_000
FRESH = 60
Readings = Mapping[str, np.ndarray]

# What each bench did in making the detectors: what it taught, and what it chose. A bench that is
# neither listed nor in judged_only.py may have had any part, so it counts as one that chose.
_RELATIVES = "the network learned from its random relatives"
_CHOSE = "projection, penalties and form of the threshold; the present adaptation"
HAD_A_PART = {
    USUAL: (_RELATIVES, f"the diagonal detector; {_CHOSE}"),
    "uneven-wall": ("", f"{_CHOSE}; the evidence of `diagonal` in it"),
    "hysteretic-sensors": ("", f"{_CHOSE}; the evidence of `diagonal` in it"),
    "missed-nodules": ("", _CHOSE),
    "pulsed-wave": ("", _CHOSE),
    "slipping-capsule": ("", _CHOSE),
    "wandering-seats": ("", _CHOSE),
    "b": ("", "the size of the network; the present adaptation"),
    "b-clear": ("", "the present adaptation"),
}
TAUGHT, CHOSE, JUDGED_ONLY = "taught", "chose", "judged only"
# The first is what a reader should look at first.
PARTS = (JUDGED_ONLY, CHOSE, TAUGHT)


def part_of(bench: str) -> str:
    """Return the closest part that a bench had: it taught, it chose, or it judged only."""
    if bench in JUDGED_ONLY_BENCHES:
        return JUDGED_ONLY
    taught, _ = HAD_A_PART.get(bench, ("", ""))
    return TAUGHT if taught else CHOSE


def bench_names() -> list[str]:
    """Return the usual bench and those of config/benches/, which all had a part."""
    return [USUAL, *(path.stem for path in sorted(BENCHES.glob("*.yaml")))]


class UnseenArchive(NamedTuple):
    """One archive, and healthy recordings of the same bench that are not in it.

    Attributes
    ----------
    readings
        The labelled recordings, arrays (S, K) by names such as 3mm/r07.
    places
        The place of each of them.
    fresh
        The healthy recordings, by names such as fresh/07.
    """

    readings: Readings
    places: Mapping[str, str]
    fresh: Readings


@dataclass(frozen=True)
class Source:
    """Where the archives of a bench come from, each by its number from 0.

    Attributes
    ----------
    bench
        Name of the bench.
    folder
        Folder of stored archives, each an .npz of arrays (S, K) by names such as 3mm/r07; None for
        a bench that is simulated here.
    runs, passes
        Places of each size in a simulated archive, and passes over each.
    fresh
        Number of fresh healthy recordings.
    """

    bench: str
    folder: Path | None = None
    runs: int = RUNS
    passes: int = 1
    fresh: int = FRESH

    @property
    def files(self) -> list[Path]:
        """The stored archives."""
        return [] if self.folder is None else sorted(self.folder.glob("*.npz"))

    def archive(self, number: int) -> UnseenArchive:
        """Simulate or read an archive and its fresh healthy recordings."""
        if self.folder is not None:
            return self._stored(number)
        phantom = _phantom(self.bench)
        readings, places = {}, {}
        for run in planned_runs(SIZES_MM, self.runs, self.passes):
            readings[run.name] = _readings(
                phantom, self.bench, run.size_mm, FIRST_SEED + number, run.site, run.attempt
            )
            places[run.name] = run.site
        first = FIRST_FRESH_SEED + self.fresh * number
        fresh = {
            f"fresh/{each:02d}": _readings(phantom, self.bench, 0, first + each, "fresh")
            for each in range(self.fresh)
        }
        return UnseenArchive(readings, places, fresh)

    def _stored(self, number: int) -> UnseenArchive:
        """Read a stored archive; the fresh ones are the healthy recordings of the next archives."""
        paths = self.files
        readings = _read(paths[number])
        healthy = (
            values
            for path in paths[number + 1 :] + paths[:number]
            for name, values in _read(path).items()
            if size_mm(name) == 0
        )
        fresh = {f"fresh/{n:02d}": each for n, each in enumerate(islice(healthy, self.fresh))}
        return UnseenArchive(readings, {name: name for name in readings}, fresh)


def simulated(
    bench: str,
    archives: int,
    first_seed: int = FIRST_SEED,
    runs: int = RUNS,
    sizes_mm: Sequence[int] = SIZES_MM,
) -> Iterator[Readings]:
    """Simulate archives of a bench, one at a time, with some runs of each size."""
    phantom = _phantom(bench)
    for seed in range(first_seed, first_seed + archives):
        yield {
            run.name: _readings(phantom, bench, run.size_mm, seed, run.site)
            for run in planned_runs(sizes_mm, runs, 1)
        }


def stored(folder: Path) -> Iterator[Readings]:
    """Read the archives of a folder, one at a time."""
    yield from map(_read, sorted(folder.glob("*.npz")))


def _read(path: Path) -> Readings:
    with np.load(path) as archive:
        return {name: archive[name].astype(float) for name in archive.files}


def _phantom(bench: str) -> Phantom:
    """Return the phantom of a bench; a bench that judges only adds its trouble to the usual one."""
    usual = bench == USUAL or bench in JUDGED_ONLY_BENCHES
    return read_phantom(DEFAULT_TABLE, [], None if usual else bench)


def _readings(
    phantom: Phantom, bench: str, nodule_mm: float, seed: int, site: str, attempt: str = "1"
) -> np.ndarray:
    if bench in JUDGED_ONLY_BENCHES:
        return simulate_judged_only(phantom, bench, nodule_mm, seed, site, attempt).astype(float)
    return simulate_run(phantom, nodule_mm, seed, site, attempt).counts.astype(float)


@dataclass(frozen=True)
class Description:
    """What describes the recordings of an archive to the detectors; no archive teaches it.

    Attributes
    ----------
    places
        The place of each labelled recording.
    fresh
        Names of the fresh healthy recordings.
    passages, features, no_verdict
        Of labelled and fresh recordings: as in `capsule.detectors.base.StoredRecording`, and the
        reason why no detector judges a recording.
    """

    places: Mapping[str, str]
    fresh: list[str]
    passages: Mapping[str, Passage]
    features: Mapping[str, Features]
    no_verdict: Mapping[str, str]


def describe(archive: UnseenArchive, config: Mapping, scorer: Scorer) -> Description:
    """Describe the recordings of an archive, and its fresh ones."""
    rate_hz, bench = config["recording"]["rate_hz"], config["diagonal"]
    false_rate = config["recording"]["wave_false_rate"]
    every = {**archive.readings, **archive.fresh}
    return Description(
        archive.places,
        list(archive.fresh),
        {name: passage_of(wave_of(each, rate_hz, bench), bench) for name, each in every.items()},
        {
            name: scorer.features(series_of(wave_of(each, rate_hz, bench)))
            for name, each in every.items()
        },
        {
            name: missing_wave(wave_of(each, rate_hz, bench), bench, false_rate)
            for name, each in every.items()
        },
    )


def write_description(path: Path, description: Description, key: str) -> None:
    """Write what describes an archive, with the key of what it was made from."""
    names = list(description.no_verdict)
    places, fresh = description.places, set(description.fresh)
    arrays = {
        "key": np.array(key),
        "names": np.array(names),
        "places": np.array([places.get(name, "") for name in names]),
        "fresh": np.array([name in fresh for name in names]),
        "sizes_mm": np.array([0.0 if name in fresh else size_mm(name) for name in names]),
        "no_verdict": np.array([description.no_verdict[name] for name in names]),
    }
    for kind, of in ((Passage, description.passages), (Features, description.features)):
        for field in fields(kind):
            arrays[field.name] = np.array([getattr(of[name], field.name) for name in names])
    path.parent.mkdir(parents=True, exist_ok=True)
    with write_whole(path, "wb") as stream:
        np.savez(stream, **arrays)


def read_description(path: Path, key: str) -> Description | None:
    """Read what `write_description` has written; None if it was made from something else.

    It may hold more than the detectors use today.
    """
    if not path.exists():
        return None
    with np.load(path) as stored_arrays:
        arrays = dict(stored_arrays.items())
    needed = {field.name for kind in (Passage, Features) for field in fields(kind)}
    if str(arrays["key"]) != key or not needed <= set(arrays):
        return None
    names, places = arrays["names"].tolist(), arrays["places"].tolist()
    made = {
        kind: {
            name: kind(*values)
            for name, *values in zip(
                names, *(_plain(arrays[field.name]) for field in fields(kind)), strict=True
            )
        }
        for kind in (Passage, Features)
    }
    fresh = arrays["fresh"].tolist()
    return Description(
        {name: place for name, place in zip(names, places, strict=True) if place},
        [name for name, new in zip(names, fresh, strict=True) if new],
        made[Passage],
        made[Features],
        dict(zip(names, arrays["no_verdict"].tolist(), strict=True)),
    )


def _plain(values: np.ndarray) -> list:
    """Return numbers as Python's, and rows as arrays."""
    return values.tolist() if values.ndim == 1 else list(values)


def key_of(source: Source, number: int, config: Mapping, weights: Path) -> str:
    """Return a text that differs if an archive or what describes it would differ.

    It covers all settings and stored numbers, but no code: see `described`.
    """
    made_from = [source.bench, number, source.runs, source.passes, source.fresh, FIRST_SEED]
    made_from += [FIRST_FRESH_SEED, SIMULATOR_VERSION, config["recording"], config["diagonal"]]
    digest = hashlib.sha256(json.dumps(made_from, sort_keys=True).encode())
    for path in (weights, DEFAULT_TABLE, *BENCHES.glob(f"{source.bench}.yaml")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def described(
    source: Source, number: int, config: Mapping, scorer: Scorer, weights: Path, cache: Path | None
) -> Description:
    """Return what describes an archive, from the folder `cache` if it holds it.

    The first archive of each bench is always described anew, to see whether the code still
    describes recordings as it did when the folder was filled.

    Raises
    ------
    CapsuleError
        The folder was filled by code that describes recordings in another way.
    """
    if cache is None:
        return describe(source.archive(number), config, scorer)
    path, key = cache / f"{source.bench}-{number + 1}.npz", key_of(source, number, config, weights)
    known = read_description(path, key)
    if known is not None and number > 0:
        return known
    new = describe(source.archive(number), config, scorer)
    if known is not None and not _alike(known, new):
        raise CapsuleError(f"{path}: other code has filled this folder; give --cache another one")
    write_description(path, new, key)
    return new


def _alike(one: Description, other: Description) -> bool:
    """Return whether two descriptions have the same numbers, but for rounding."""
    if one.no_verdict != other.no_verdict or one.places != other.places:
        return False
    return all(
        np.allclose(getattr(known, field.name), getattr(new, field.name), 1e-3, 1e-4, True)
        for kind in ("passages", "features")
        for known, new in zip(
            getattr(one, kind).values(), getattr(other, kind).values(), strict=True
        )
        for field in fields(known)
    )
