"""Judge what counts as familiar: on benches, on noise and on other sensors.

    python tests/benchmarks/judge_familiar.py --real FOLDER --folders FOLDER ...
        --page workflow/studies/results/detection-familiar.md

The recordings of one archive teach; those of the other archives of the same bench are judged.
Simulated archives have seeds that chose nothing. What the shipped archive teaches judges noise,
and the recordings in the folder --real, as `foreign_readings.other_sensors` reads them. --folders
are recordings of other benches, as for judge_unseen.py. --page writes the tables into a document.
"""

import argparse
import sys
import time
from collections.abc import Iterable, Mapping
from dataclasses import astuple
from pathlib import Path

import numpy as np

FOLDERS = [Path(__file__).parents[2] / "workflow" / each for each in ("scripts", "studies")]
sys.path[:0] = map(str, FOLDERS)

import foreign_readings as foreign
from judge_rates import table
from judged_only import BENCHES as JUDGED_ONLY_BENCHES
from unseen_archives import CHOSE, JUDGED_ONLY, Readings, bench_names, part_of, simulated, stored
from unseen_report import filled_page

import capsule
from capsule.arguments import natural
from capsule.detectors.familiar import FamiliarKind, learn_familiar
from capsule.detectors.wave import missing_wave, wave_of
from capsule.detectors.wave_traits import WaveTraits, wave_traits
from capsule.engine.configuration import read_config_file
from capsule.engine.forks import Forks
from capsule.engine.project import CONFIG, PROJECT
from capsule.recordings.held_out import teaching
from capsule.recordings.names import size_mm
from capsule.seeding import generator

FIRST_SEED = 470_000
# Archives of a bench that teach, in turn.
TEACHERS = 3
CONFIGURATION = read_config_file(CONFIG / "config.yaml")
RULES, BENCH = CONFIGURATION["recording"], CONFIGURATION["diagonal"]


def judged(values: np.ndarray) -> bool:
    """Return whether the detectors would judge a recording."""
    return not missing_wave(
        wave_of(values, RULES["rate_hz"], BENCH), BENCH, RULES["wave_false_rate"]
    )


def traits_of(readings: Readings) -> dict[str, WaveTraits]:
    """Return the traits of the recordings that the detectors would judge."""
    usable = {name: values for name, values in readings.items() if judged(values)}
    return {
        name: wave_traits(wave_of(each, RULES["rate_hz"], BENCH), RULES["rate_hz"])
        for name, each in usable.items()
    }


def taught_by(traits: Iterable[WaveTraits]) -> FamiliarKind:
    """Return what recordings teach, each of a place of its own."""
    rows = np.array([astuple(each) for each in traits])
    return learn_familiar(rows, np.arange(len(rows)))


def unfamiliar(kind: FamiliarKind, traits: Iterable[WaveTraits]) -> float:
    """Return the share of recordings that are called unfamiliar."""
    return float(np.mean([each.familiar is False for each in kind.judge_all(list(traits))]))


def bench_row(bench: str, archives: Iterable[Readings]) -> dict[str, str]:
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
        "called unfamiliar, worst archive": _percent(max(shares)),
        "mean": _percent(np.mean(shares)),
        "5 mm, taught without 4 and 5 mm, worst archive": _percent(max(of_largest)),
    }


def foreign_row(
    what: str, part: str, kind: FamiliarKind, readings: Iterable[np.ndarray]
) -> dict[str, str]:
    """Judge readings that come from no capsule."""
    every = list(readings)
    described = traits_of({str(number): values for number, values in enumerate(every)})
    passed = [each.familiar is not False for each in kind.judge_all([*described.values()])]
    return {
        "readings": what,
        "part": part,
        "recordings": str(len(every)),
        "get a verdict": _percent(len(described) / len(every)),
        "of these familiar": _percent(np.mean(passed)) if passed else "",
        "familiar": str(sum(passed)),
    }


def foreign_rows(real: Path | None, runs: int) -> list[dict[str, str]]:
    """Judge noise and other sensors by what the shipped archive teaches."""
    archive = capsule.load(PROJECT / "raw")
    names = teaching(archive.index(archive.labelled), CONFIGURATION["evaluation"]["held_out"])
    kind = taught_by(traits_of({name: archive.readings[name] for name in names}).values())
    kinds = {
        JUDGED_ONLY: foreign.JUDGED_ONLY,
        CHOSE: foreign.INDEPENDENT | foreign.COUPLED | foreign.TRAVELLING,
    }
    rows = []
    for part, noises in kinds.items():
        for what, noise in noises.items():
            made = (noise(generator(2, "foreign", what, str(run))) for run in range(runs))
            usable = (values for values in made if (values.std(axis=1) > 0).all())
            rows.append(foreign_row(what, part, kind, usable))
    sensors: dict[str, list[np.ndarray]] = {}
    for what, values in foreign.other_sensors(real) if real else ():
        sensors.setdefault(what, []).append(values)
    return rows + [foreign_row(what, CHOSE, kind, each) for what, each in sensors.items()]


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def _seconds_each(readings: Mapping[str, np.ndarray]) -> float:
    """Return the median time for the traits of one recording."""
    taken = []
    for values in readings.values():
        begun = time.perf_counter()
        wave_traits(wave_of(values, RULES["rate_hz"], BENCH), RULES["rate_hz"])
        taken.append(time.perf_counter() - begun)
    return float(np.median(taken))


def main() -> None:
    """Print both tables, and write them into a document."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--real", type=Path, metavar="FOLDER", help="recordings of other sensors")
    parser.add_argument("--folders", type=Path, nargs="*", default=[], metavar="FOLDER")
    parser.add_argument("--archives", type=natural, default=6, metavar="N", help="of each bench")
    parser.add_argument("--runs", type=natural, default=1000, metavar="N", help="of each noise")
    parser.add_argument("--processes", type=natural, default=1, metavar="N")
    parser.add_argument("--page", type=Path, metavar="FILE", help="the document")
    arguments = parser.parse_args()
    folders = {folder.name: folder for folder in arguments.folders}

    def row_of(bench: str) -> dict[str, str]:
        known = folders.get(bench)
        return bench_row(
            bench, stored(known) if known else simulated(bench, arguments.archives, FIRST_SEED)
        )

    names = [*JUDGED_ONLY_BENCHES, *bench_names(), *folders]
    blocks = {
        "familiar benches": table(list(Forks(arguments.processes)(row_of, names))),
        "familiar others": table(foreign_rows(arguments.real, arguments.runs)),
    }
    print("\n\n".join(blocks.values()))
    usual = next(iter(simulated("usual", 1, FIRST_SEED)))
    print(f"\ntraits of one recording: {1000 * _seconds_each(usual):.1f} ms")
    if arguments.page:
        page = filled_page(arguments.page.read_text(encoding="utf-8"), blocks, "judge_familiar")
        arguments.page.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
