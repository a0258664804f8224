"""Judge the detectors, and what counts as familiar, on benches that had no part in making them.

    python tests/benchmarks/judge_unseen.py --folders FOLDER ... --archives 40 --write

Judged are the benches of judged_only.py, the usual bench, every bench of config/benches/, and
folders of recordings of other benches: each file of a folder is an archive, an .npz of arrays
(S, K) by names such as 3mm/r07. Each detector judges the recordings of each place by what the other
places of the archive teach, and fresh healthy recordings of the bench by what the whole archive
teaches. A recording without a verdict is a failure: it counts neither as found nor as healthy.
What one archive teaches as familiar judges the other archives of its bench. --write writes the
tables into the documents that show them, and the range for the report.
"""

import argparse
import sys
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple
from functools import partial
from itertools import islice, product
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pandas as pd
from tables import ROOT, filled_page, table
from threadpoolctl import threadpool_limits

# isort: split
import judged_only

from capsule.commands.options import natural
from capsule.detectors.base import NO_VERDICT, TrainingArchive
from capsule.detectors.described_recording import DescribedRecording
from capsule.detectors.familiar import FamiliarKind, learn_familiar
from capsule.detectors.registry import detector_class
from capsule.detectors.wave_traits import WaveTraits
from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG
from capsule.phantom.files import BENCHES, DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import planned_runs, simulate_run
from capsule.recordings.names import size_mm
from capsule.store.files import write_csv
from support.training import NO_TEMPLATES

SIZES_MM, RUNS = (0, 1, 2, 3, 4, 5), 20
USUAL = "usual"
# No earlier table, search or choice used these seeds: archives, and fresh healthy recordings, each
# with a seed of its own and so with a set-up of its own.
FIRST_SEED, FIRST_FRESH_SEED = 420_000, 430_000
FRESH = 60
# Archives of a bench that teach what is familiar, in turn.
TEACHERS = 3
# Last the one that is our best.
DETECTORS = ("diagonal", "taught")
# The closest part that a bench had in making the detectors; what a reader should look at first
# stands first. docs/detection.md tells what each bench taught or chose.
TAUGHT, CHOSE, JUDGED_ONLY = "taught", "chose", "judged only"
PARTS = (JUDGED_ONLY, CHOSE, TAUGHT)
# The documents that show the tables.
PAGES = [
    *("docs/detection.md", "workflow/studies/benches.md"),
    *(f"workflow/studies/results/detection-{name}.md" for name in ("benches", "familiar")),
]
SHOWN = ("specificity", "recall at 1 mm", "recall from 2 mm")
FOUND = SHOWN[2]
CONFIGURATION = read_config_file(CONFIG / "config.yaml")
Readings = Mapping[str, np.ndarray]
Traits = Mapping[str, WaveTraits]


def part_of(bench: str) -> str:
    """Return the part of a bench; one that is not known may have had any, so it chose."""
    if bench in judged_only.BENCHES:
        return JUDGED_ONLY
    return TAUGHT if bench == USUAL else CHOSE


def simulated(bench: str, number: int) -> tuple[Readings, list[np.ndarray]]:
    """Simulate an archive by its number from 0, and fresh healthy recordings."""
    trouble = judged_only.BENCHES.get(bench)
    phantom = read_phantom(DEFAULT_TABLE, [], None if trouble or bench == USUAL else bench)

    def readings(nodule_mm: float, seed: int, site: str) -> np.ndarray:
        run = simulate_run(phantom, nodule_mm, seed, site)
        passed = judged_only.Passed(phantom, run, seed, site)
        return (trouble(passed) if trouble else run.counts).astype(float)

    runs = planned_runs(SIZES_MM, RUNS, 1)
    archive = {run.name: readings(run.size_mm, FIRST_SEED + number, run.site) for run in runs}
    first = FIRST_FRESH_SEED + FRESH * number
    return archive, [readings(0, seed, "fresh") for seed in range(first, first + FRESH)]


def stored(paths: Sequence[Path], number: int) -> tuple[Readings, list[np.ndarray]]:
    """Read an archive; the fresh recordings are the healthy ones of the next archives."""

    def read(path: Path) -> Readings:
        with np.load(path) as archive:
            return {name: archive[name].astype(float) for name in archive.files}

    others = map(read, [*paths[number + 1 :], *paths[:number]])
    healthy = (values for each in others for name, values in each.items() if size_mm(name) == 0)
    return read(paths[number]), list(islice(healthy, FRESH))


def judge(readings: Readings, fresh: Sequence[np.ndarray]) -> tuple[list[dict], Traits]:
    """Return each detector's rates on an archive and fresh recordings, and the archive's traits."""
    every = readings | {f"fresh/{number}": values for number, values in enumerate(fresh)}
    recordings = {name: DescribedRecording(each, CONFIGURATION) for name, each in every.items()}
    sizes = {name: size_mm(name) for name in readings}
    no_verdicts = {name: each.no_verdict for name, each in recordings.items()}
    archive = TrainingArchive(sizes, recordings, NO_TEMPLATES, {}, CONFIGURATION, no_verdicts)
    rows = [{"detector": each} | rates(archive, each, list(readings)) for each in DETECTORS]
    judged = [name for name in readings if not archive.no_verdict[name]]
    return rows, {name: recordings[name].traits for name in judged}


def rates(archive: TrainingArchive, detector: str, labelled: Sequence[str]) -> dict[str, float]:
    """Return the rates of a detector; what is not labelled is healthy, and teaches nothing."""
    taught = detector_class(detector)
    whole = taught.taught(archive)
    verdicts = dict.fromkeys(archive.recordings, NO_VERDICT)
    for name, recording in archive.recordings.items():
        if not archive.no_verdict[name]:
            model = taught.taught(archive, [name]) if name in archive.sizes_mm else whole
            verdicts[name] = model.verdict(recording)
    every = pd.DataFrame([vars(each) for each in verdicts.values()], index=list(verdicts))
    known, true_mm = every.loc[labelled], np.array([size_mm(name) for name in labelled])
    predicted, low, high = (
        known[f"{name}_mm"].to_numpy() for name in ("predicted", "estimate_low", "estimate_high")
    )
    found, large = predicted > 0, true_mm >= 2
    near = found & (np.abs(predicted - true_mm) <= 1)
    sized = ~np.isnan(low) & (true_mm > 0)
    held = (low <= true_mm + 1e-9) & (true_mm <= high + 1e-9)
    # An interval without an upper end counts up to the largest size of the archive.
    width = pd.Series(np.minimum(high, true_mm.max()) - low)[sized]
    means = {
        "specificity": every["predicted_mm"].drop(labelled) == 0,
        "specificity, left out": predicted[true_mm == 0] == 0,
        "recall at 1 mm": found[true_mm == 1],
        "recall from 2 mm": found[large],
        "within 1 mm, from 2 mm": near[large],
        "no verdict": every["predicted_mm"].isna(),
        "intervals that hold the size": held[sized],
    }
    made = {name: float(pd.Series(values).mean()) for name, values in means.items()}
    return made | {"their median width (mm)": float(width.median())}


def mean_rows(judged: pd.DataFrame) -> pd.DataFrame:
    """Return the mean rates of every detector on every bench, the worst bench of each part first.

    The order of the benches is that of what our best detector finds from 2 mm on.
    """
    of_bench = judged.groupby(["part", "bench", "detector"], sort=False)
    means = of_bench.mean().reset_index()
    means.insert(2, "archives", of_bench.size().astype(str).to_numpy())
    found = means[means["detector"] == DETECTORS[-1]].set_index("bench")[FOUND]
    turns = [means["detector"].map(DETECTORS.index), means["bench"].map(found)]
    return means.iloc[np.lexsort([*turns, means["part"].map(PARTS.index)])]


def range_rows(means: pd.DataFrame) -> list[dict]:
    """Return each detector's worst, middle and best bench of each part, as the report reads them.

    The order is by recall from 2 mm on. The bench with the lowest specificity has a row of its own,
    since it need not be the worst one. Rates are rounded as tables show them.
    """
    rows = []
    for detector, part in product(DETECTORS, PARTS):
        some = means[(means["detector"] == detector) & (means["part"] == part)]
        benches = some.sort_values(FOUND).to_dict("records")
        if not benches:
            continue
        chosen = {"worst": 0, "middle": (len(benches) - 1) // 2, "best": len(benches) - 1}
        chosen["least specific"] = int(np.argmin([row[SHOWN[0]] for row in benches]))
        for label, place in ({"only": 0} if len(benches) == 1 else chosen).items():
            row = {"detector": detector, "part": part, "of the benches the": label}
            row["bench"] = benches[place]["bench"]
            shown = {name: f"{100 * benches[place][name]:.1f}" for name in SHOWN}
            rows.append(row | {name: round(float(cell) / 100, 3) for name, cell in shown.items()})
    return rows


def taught_by(traits: Iterable[WaveTraits]) -> FamiliarKind:
    """Return what recordings teach as familiar, each of a place of its own."""
    rows = np.array([astuple(each) for each in traits])
    return learn_familiar(rows, np.arange(len(rows)))


def unfamiliar(kind: FamiliarKind, traits: Iterable[WaveTraits]) -> float:
    """Return the share of recordings that are called unfamiliar."""
    return float(np.mean([each.familiar is False for each in kind.judge_all(list(traits))]))


def familiar_row(bench: str, archives: Sequence[Traits]) -> dict[str, object]:
    """Judge the recordings of a bench by what other archives of it teach as familiar."""
    shares, of_largest = [], []
    for number, teacher in enumerate(archives[:TEACHERS]):
        others = [other for n, other in enumerate(archives) if n != number]
        rest = [each for other in others for each in other.values()]
        shares.append(unfamiliar(taught_by(teacher.values()), rest))
        small = taught_by(each for name, each in teacher.items() if (size_mm(name) or 0) < 4)
        largest = [each for other in others for name, each in other.items() if size_mm(name) == 5]
        of_largest.append(unfamiliar(small, largest))
    return {
        "bench": bench,
        "part": part_of(bench),
        "judged": str(sum(map(len, archives)) - min(map(len, archives))),
        "called unfamiliar, worst archive": max(shares),
        "mean": float(np.mean(shares)),
        "5 mm, taught without 4 and 5 mm, worst archive": max(of_largest),
    }


def judged(folders: Mapping[str, list[Path]], task: tuple[str, int]) -> tuple:
    """Return a bench, and what is judged of an archive of it, of its folder or simulated."""
    bench, number = task
    archive = stored(folders[bench], number) if bench in folders else simulated(bench, number)
    return bench, *judge(*archive)


def main() -> None:
    """Judge every bench, and write the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    every = [*judged_only.BENCHES, USUAL, *(path.stem for path in sorted(BENCHES.glob("*.yaml")))]
    add = parser.add_argument
    add("--archives", type=natural, default=40, help="of each simulated bench (default: 40)")
    add("--processes", type=natural, default=2, help="archives at a time (default: 2)")
    add("--benches", nargs="*", choices=every, default=every, help="simulated (default: all)")
    add("--folders", nargs="*", type=Path, default=[], help="archives of other benches")
    add("--write", action="store_true", help="write the tables into documents and report")
    arguments = parser.parse_args()
    folders = {folder.name: sorted(folder.glob("*.npz")) for folder in arguments.folders}
    tasks = list(product(arguments.benches, range(arguments.archives)))
    tasks += [(bench, number) for bench, paths in folders.items() for number in range(len(paths))]
    made: list[dict] = []
    traits: dict[str, list[Traits]] = defaultdict(list)
    with get_context("fork").Pool(arguments.processes, threadpool_limits, (1,)) as pool:
        for bench, rows, of_archive in pool.imap(partial(judged, folders), tasks):
            made += [{"part": part_of(bench), "bench": bench, **row} for row in rows]
            traits[bench].append(of_archive)
            print(f"{bench}: {len(traits[bench])} archives", file=sys.stderr, flush=True)
    means = mean_rows(pd.DataFrame(made))
    only = means.loc[means["part"] == JUDGED_ONLY, ["bench", "detector", *SHOWN]]
    several = {bench: each for bench, each in traits.items() if len(each) > 1}
    ranges = range_rows(means)
    blocks = {
        "ranges": table(ranges),
        "judged only": table(only.to_dict("records")),
        "benches": table(means.to_dict("records")),
        "familiar benches": table([familiar_row(*each) for each in several.items()]),
    }
    print("\n".join(blocks.values()))
    if arguments.write:
        write_csv(ROOT / "workflow/report/benches.csv", list(ranges[0]), ranges)
        for page in PAGES:
            filled = filled_page((ROOT / page).read_text("utf-8"), blocks, "judge_unseen")
            (ROOT / page).write_text(filled, encoding="utf-8")


if __name__ == "__main__":
    main()
