"""Judge what counts as familiar: on benches, and on noise that travels like a wave.

    python tests/benchmarks/judge_familiar.py --folders FOLDER ...
        --page workflow/studies/results/detection-familiar.md

The recordings of one archive teach; those of the other archives of the same bench are judged.
Simulated archives have seeds that chose nothing. What the shipped archive teaches judges noise.
--folders are recordings of other benches, as for judge_unseen.py. --page writes the tables into a
document.
"""

import argparse
from collections.abc import Callable, Iterable
from dataclasses import astuple
from pathlib import Path

import numpy as np
from judge_unseen import CONFIGURATION, Readings, bench_names, part_of, simulated, stored
from tables import filled_page, table

import capsule
from capsule.arguments import natural
from capsule.detectors.described_recording import DescribedRecording
from capsule.detectors.familiar import FamiliarKind, learn_familiar
from capsule.detectors.wave_traits import WaveTraits
from capsule.engine.forks import Forks
from capsule.engine.project import PROJECT
from capsule.recordings.held_out import teaching
from capsule.recordings.names import size_mm
from capsule.seeding import generator

FIRST_SEED = 470_000
# Archives of a bench that teach, in turn.
TEACHERS = 3
SAMPLES, RATE_HZ, SENSORS = 600, 10.0, 4
Numbers = np.random.Generator


def chirp(numbers: Numbers, samples: int) -> np.ndarray:
    """Return a tone whose frequency rises or falls through that of the wave."""
    first, last = numbers.permutation([numbers.uniform(0.1, 0.3), numbers.uniform(0.32, 0.7)])
    return 25 * np.sin(2 * np.pi * np.linspace(first, last, samples).cumsum() / RATE_HZ)


def sawtooth(numbers: Numbers, samples: int) -> np.ndarray:
    """Return a sawtooth with pauses, as of a pump that is switched."""
    period = int(numbers.integers(20, 50))
    running = np.repeat(numbers.random(samples // 60 + 2) < 0.75, 60)[:samples]
    return 30 * np.where(running, np.arange(samples) % period, 0) / period


def two_rhythms(numbers: Numbers, samples: int) -> np.ndarray:
    """Return two rhythms at once, as of heart and breath."""
    time_s = np.arange(samples) / RATE_HZ
    made = np.zeros(samples)
    for low, high in ((0.15, 0.4), (0.8, 1.6)):
        made += numbers.uniform(5, 20) * np.sin(2 * np.pi * numbers.uniform(low, high) * time_s)
    return made


# None had a part in choosing the traits of a wave or what counts as familiar.
NOISES: dict[str, Callable[[Numbers, int], np.ndarray]] = {
    "a rising or falling tone that travels": chirp,
    "a switched sawtooth that travels": sawtooth,
    "two rhythms at once that travel": two_rhythms,
}


def travelling(noise: Callable[[Numbers, int], np.ndarray], numbers: Numbers) -> np.ndarray:
    """Return readings (S, K) of noise that reaches one sensor after the other."""
    delay = int(numbers.integers(1, 12))
    row = noise(numbers, SAMPLES + SENSORS * delay)
    made = np.stack([row[sensor * delay :][:SAMPLES] for sensor in range(SENSORS)])
    loud = 500 + made[:: numbers.choice([-1, 1])] * numbers.uniform(0.5, 4)
    hiss = numbers.normal(0, numbers.uniform(0, 2), made.shape)
    return (np.clip(loud, 1, 1022) + hiss).round()


def traits_of(readings: Readings) -> dict[str, WaveTraits]:
    """Return the traits of the recordings that the detectors would judge."""
    every = {name: DescribedRecording(each, CONFIGURATION) for name, each in readings.items()}
    return {name: each.traits for name, each in every.items() if not each.no_verdict}


def taught_by(traits: Iterable[WaveTraits]) -> FamiliarKind:
    """Return what recordings teach, each of a place of its own."""
    rows = np.array([astuple(each) for each in traits])
    return learn_familiar(rows, np.arange(len(rows)))


def unfamiliar(kind: FamiliarKind, traits: Iterable[WaveTraits]) -> float:
    """Return the share of recordings that are called unfamiliar."""
    return float(np.mean([each.familiar is False for each in kind.judge_all(list(traits))]))


def bench_row(bench: str, archives: Iterable[Readings]) -> dict[str, object]:
    """Judge the recordings of a bench by what other archives of it teach."""
    described = [traits_of(each) for each in archives]
    shares, of_largest = [], []
    for number, teacher in enumerate(described[:TEACHERS]):
        others = [other for n, other in enumerate(described) if n != number]
        rest = [each for other in others for each in other.values()]
        shares.append(unfamiliar(taught_by(teacher.values()), rest))
        small = taught_by(each for name, each in teacher.items() if (size_mm(name) or 0) < 4)
        largest = [each for other in others for name, each in other.items() if size_mm(name) == 5]
        of_largest.append(unfamiliar(small, largest))
    return {
        "bench": bench,
        "part": part_of(bench),
        "judged": str(sum(map(len, described)) - min(map(len, described))),
        "called unfamiliar, worst archive": max(shares),
        "mean": float(np.mean(shares)),
        "5 mm, taught without 4 and 5 mm, worst archive": max(of_largest),
    }


def noise_rows(runs: int) -> list[dict[str, object]]:
    """Judge noise by what the shipped archive teaches."""
    archive = capsule.load(PROJECT / "raw")
    names = teaching(archive.index(archive.labelled), CONFIGURATION["evaluation"]["held_out"])
    kind = taught_by(traits_of({name: archive.readings[name] for name in names}).values())
    rows = []
    for what, noise in NOISES.items():
        seeds = (generator(2, "foreign", what, str(run)) for run in range(runs))
        judged = traits_of({str(n): travelling(noise, each) for n, each in enumerate(seeds)})
        label = {"readings": what, "recordings": str(runs)}
        familiar = 1 - unfamiliar(kind, judged.values()) if judged else float("nan")
        rows.append(label | {"get a verdict": len(judged) / runs, "of these familiar": familiar})
    return rows


def main() -> None:
    """Print both tables, and write them into a document."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folders", type=Path, nargs="*", default=[], metavar="FOLDER")
    parser.add_argument("--archives", type=natural, default=6, metavar="N", help="of each bench")
    parser.add_argument("--runs", type=natural, default=1000, metavar="N", help="of each noise")
    parser.add_argument("--processes", type=natural, default=1, metavar="N")
    parser.add_argument("--page", type=Path, metavar="FILE", help="the document")
    arguments = parser.parse_args()
    folders = {folder.name: folder for folder in arguments.folders}
    seeds = range(FIRST_SEED, FIRST_SEED + arguments.archives)

    def row_of(bench: str) -> dict[str, object]:
        if bench in folders:
            return bench_row(bench, map(stored, sorted(folders[bench].glob("*.npz"))))
        return bench_row(bench, (simulated(bench, seed) for seed in seeds))

    rows = Forks(arguments.processes)(row_of, [*bench_names(), *folders])
    blocks = {
        "familiar benches": table(list(rows)),
        "familiar noise": table(noise_rows(arguments.runs)),
    }
    print("\n\n".join(blocks.values()))
    if arguments.page:
        page = filled_page(arguments.page.read_text(encoding="utf-8"), blocks, "judge_familiar")
        arguments.page.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
