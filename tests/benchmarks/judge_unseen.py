"""Judge the detectors on simulated benches, of which some had no part in making them.

    python tests/benchmarks/judge_unseen.py --folders FOLDER ... --archives 40
        --output workflow/studies/results/detection-benches.md --ranges workflow/report/benches.csv
        --pages docs/detection.md workflow/studies/benches.md

Judged are the benches of judged_only.py, the usual bench, every bench of config/benches/, and
folders of recordings of other benches: each file of a folder is an archive, an .npz of arrays
(S, K) by names such as 3mm/r07. Each detector judges the recordings of each place by what the other
places of the archive teach, and fresh healthy recordings of the bench by what the whole archive
teaches. A recording without a verdict is a failure: it counts neither as found nor as healthy.
--pages writes the tables into documents.
"""

import argparse
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path

import numpy as np

FOLDERS = [Path(__file__).parents[2] / "workflow" / each for each in ("scripts", "studies")]
sys.path[:0] = map(str, FOLDERS)

from judged_only import BENCHES as JUDGED_ONLY_BENCHES
from judged_only import simulate_judged_only
from tables import filled_page, table

from capsule.arguments import natural
from capsule.detectors.base import NO_VERDICT, TrainingArchive
from capsule.detectors.described_recording import DescribedRecording
from capsule.detectors.registry import detector_class
from capsule.engine.configuration import read_config_file
from capsule.engine.forks import Forks
from capsule.engine.project import CONFIG
from capsule.method.templates import TemplateSet, no_nodule_template
from capsule.phantom.files import BENCHES, DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import planned_runs, simulate_run
from capsule.recordings.names import size_mm
from capsule.store.files import write_csv

SIZES_MM, RUNS = (0, 1, 2, 3, 4, 5), 20
USUAL = "usual"
# No earlier table, search or choice used these seeds: archives, and fresh healthy recordings, each
# with a seed of its own and so with a set-up of its own.
FIRST_SEED, FIRST_FRESH_SEED = 420_000, 430_000
FRESH = 60
# Last the one that is our best.
DETECTORS = ("diagonal", "taught")
# The closest part that a bench had in making the detectors; what a reader should look at first
# stands first. docs/detection.md tells what each bench taught or chose.
TAUGHT, CHOSE, JUDGED_ONLY = "taught", "chose", "judged only"
PARTS = (JUDGED_ONLY, CHOSE, TAUGHT)
SHOWN = ("specificity", "recall at 1 mm", "recall from 2 mm")
FOUND = SHOWN[2]
CONFIGURATION = read_config_file(CONFIG / "config.yaml")
Readings = Mapping[str, np.ndarray]
# The rows of every archive, by bench and detector.
Judged = Mapping[str, Mapping[str, list[dict]]]


def part_of(bench: str) -> str:
    """Return the part of a bench; one that is not known may have had any, so it chose."""
    if bench in JUDGED_ONLY_BENCHES:
        return JUDGED_ONLY
    return TAUGHT if bench == USUAL else CHOSE


def bench_names() -> list[str]:
    """Return the benches that are simulated here: those that judge only first."""
    return [*JUDGED_ONLY_BENCHES, USUAL, *(path.stem for path in sorted(BENCHES.glob("*.yaml")))]


def simulator(bench: str) -> Callable[[float, int, str], np.ndarray]:
    """Return a function of size, seed and place that simulates the readings of one pass, (S, K)."""
    usual = bench == USUAL or bench in JUDGED_ONLY_BENCHES
    phantom = read_phantom(DEFAULT_TABLE, [], None if usual else bench)

    def readings(nodule_mm: float, seed: int, site: str) -> np.ndarray:
        if bench in JUDGED_ONLY_BENCHES:
            return simulate_judged_only(phantom, bench, nodule_mm, seed, site).astype(float)
        return simulate_run(phantom, nodule_mm, seed, site).counts.astype(float)

    return readings


def simulated(bench: str, seed: int, runs: int = RUNS) -> Readings:
    """Simulate an archive of a bench, with some runs of each size."""
    readings = simulator(bench)
    return {
        run.name: readings(run.size_mm, seed, run.site) for run in planned_runs(SIZES_MM, runs, 1)
    }


def stored(path: Path) -> Readings:
    """Read an archive."""
    with np.load(path) as archive:
        return {name: archive[name].astype(float) for name in archive.files}


def simulated_parts(bench: str, number: int, runs: int) -> tuple[Readings, list[np.ndarray]]:
    """Simulate an archive by its number from 0, and fresh healthy recordings."""
    seeds = range(FIRST_FRESH_SEED + FRESH * number, FIRST_FRESH_SEED + FRESH * (number + 1))
    readings = simulator(bench)
    fresh = [readings(0, seed, "fresh") for seed in seeds]
    return simulated(bench, FIRST_SEED + number, runs), fresh


def stored_parts(paths: Sequence[Path], number: int) -> tuple[Readings, list[np.ndarray]]:
    """Read an archive; the fresh recordings are the healthy ones of the next archives."""

    def healthy() -> Iterator[np.ndarray]:
        for path in [*paths[number + 1 :], *paths[:number]]:
            yield from (values for name, values in stored(path).items() if size_mm(name) == 0)

    return stored(paths[number]), list(islice(healthy(), FRESH))


def judge(readings: Readings, fresh: Sequence[np.ndarray]) -> dict[str, dict[str, float]]:
    """Judge an archive and fresh healthy recordings of the same bench by each detector."""
    every = {**readings, **{f"fresh/{number}": values for number, values in enumerate(fresh)}}
    recordings = {name: DescribedRecording(values, CONFIGURATION) for name, values in every.items()}
    archive = TrainingArchive(
        {name: size_mm(name) for name in readings},
        recordings,
        TemplateSet((0.0,), (), (no_nodule_template(1, 1),), 1),
        {},
        CONFIGURATION,
        {name: each.no_verdict for name, each in recordings.items()},
    )
    return {detector: _rates(archive, detector, list(readings)) for detector in DETECTORS}


def _rates(archive: TrainingArchive, detector: str, labelled: Sequence[str]) -> dict[str, float]:
    """Return the rates of a detector; what is not labelled is healthy, and teaches nothing."""
    taught = detector_class(detector)
    whole = taught.taught(archive)
    verdicts = dict.fromkeys(archive.recordings, NO_VERDICT)
    for name, recording in archive.recordings.items():
        if not archive.no_verdict[name]:
            model = taught.taught(archive, [name]) if name in archive.sizes_mm else whole
            verdicts[name] = model.verdict(recording)

    def column(field: str) -> np.ndarray:
        return np.array([getattr(verdicts[name], field) for name in labelled])

    true_mm = np.array([size_mm(name) for name in labelled])
    predicted, low, high = map(column, ("predicted_mm", "estimate_low_mm", "estimate_high_mm"))
    found, large = predicted > 0, true_mm >= 2
    near = found & (np.abs(predicted - true_mm) <= 1)
    sized = ~np.isnan(low) & (true_mm > 0)
    held = (low <= true_mm + 1e-9) & (true_mm <= high + 1e-9)
    # An interval without an upper end counts up to the largest size of the archive.
    width = np.minimum(high, true_mm.max()) - low
    healthy = [verdicts[name].predicted_mm == 0 for name in archive.recordings.keys() - labelled]
    return {
        "specificity": _mean(np.array(healthy)),
        "specificity, left out": _mean(predicted[true_mm == 0] == 0),
        "recall at 1 mm": _mean(found[true_mm == 1]),
        "recall from 2 mm": _mean(found[large]),
        "within 1 mm, from 2 mm": _mean(near[large]),
        "no verdict": _mean(np.isnan([each.predicted_mm for each in verdicts.values()])),
        "intervals that hold the size": _mean(held[sized]),
        "their median width (mm)": float(np.median(width[sized])) if sized.any() else np.nan,
    }


def _mean(values: np.ndarray) -> float:
    """Return the mean of what is known; NaN where nothing is."""
    known = values[~np.isnan(values)]
    return float(known.mean()) if known.size else np.nan


def mean_rows(judged: Judged, detector: str, part: str) -> list[dict]:
    """Return the means of a detector on the benches of a part, the worst bench first."""
    rows = []
    for bench in [bench for bench in judged if part_of(bench) == part]:
        each = judged[bench][detector]
        label = {"part": part, "bench": bench, "archives": str(len(each)), "detector": detector}
        rows.append(label | {key: _mean(np.array([row[key] for row in each])) for key in each[0]})
    return sorted(rows, key=lambda row: row[FOUND])


def bench_rows(judged: Judged) -> list[dict]:
    """Return the mean rates of every detector on every bench, the worst of each part first."""
    rows = []
    for part in PARTS:
        means = {detector: mean_rows(judged, detector, part) for detector in DETECTORS}
        for bench in [row["bench"] for row in means[DETECTORS[-1]]]:
            rows += [row for of in means.values() for row in of if row["bench"] == bench]
    return rows


def range_rows(judged: Judged) -> list[dict]:
    """Return each detector's worst, middle and best bench of each part, as the report reads them.

    The order is by recall from 2 mm on. The bench with the lowest specificity has a row of its own,
    since it need not be the worst one. Rates are rounded as tables show them.
    """
    rows = []
    for detector in DETECTORS:
        for part in PARTS:
            means = mean_rows(judged, detector, part)
            chosen = {"worst": 0, "middle": (len(means) - 1) // 2, "best": len(means) - 1}
            chosen |= {"least specific": int(np.argmin([row[SHOWN[0]] for row in means] or [0]))}
            if len(means) == 1:
                chosen = {"only": 0}
            for label, place in chosen.items() if means else ():
                cells = {"detector": detector, "part": part, "of the benches the": label}
                rates = {
                    name: round(float(f"{100 * means[place][name]:.1f}") / 100, 3) for name in SHOWN
                }
                rows.append(cells | {"bench": means[place]["bench"]} | rates)
    return rows


def report(judged: Judged) -> str:
    """Return the whole document."""
    return (
        "# What the detectors reach on other benches\n\nMade by "
        "`tests/benchmarks/judge_unseen.py`; studies/detection.md tells why. Means over archives "
        f"of simulated recordings, seeds from {FIRST_SEED} on, place by place. *Specificity*: on "
        f"{FRESH} fresh healthy recordings for each archive, seeds from {FIRST_FRESH_SEED} on (of "
        "a stored bench: the healthy ones of its next archives). *Left out*: on the archive's own "
        "healthy recordings; the rank of a threshold sets it. A recording without a verdict is a "
        "failure.\n\n"
        f"## The range\n\n{table(range_rows(judged))}\n"
        "## Bench by bench\n\nThe benches that judge only first, and of each part the worst first."
        f"\n\n{table(bench_rows(judged))}"
    )


def read_arguments() -> argparse.Namespace:
    """Read what to judge."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--archives", type=natural, default=40, help="of each simulated bench (default: 40)")
    add("--runs", type=natural, default=RUNS, help=f"places of each size (default: {RUNS})")
    add("--processes", type=natural, default=2, help="archives at a time (default: 2)")
    every = bench_names()
    add("--benches", nargs="*", choices=every, default=every, help="simulated (default: all)")
    add("--folders", nargs="*", type=Path, default=[], help="archives of other benches")
    add("--output", type=Path, help="output: the tables, Markdown")
    add("--ranges", type=Path, help="output: the range, for the report, CSV")
    add("--pages", nargs="*", type=Path, default=[], help="documents that show the tables")
    return parser.parse_args()


def main() -> None:
    """Judge every bench, and write the tables."""
    arguments = read_arguments()
    folders = {folder.name: sorted(folder.glob("*.npz")) for folder in arguments.folders}
    archives = dict.fromkeys(arguments.benches, arguments.archives)
    archives |= {bench: len(paths) for bench, paths in folders.items() if paths}
    tasks = [(bench, number) for bench, count in archives.items() for number in range(count)]

    def judged_archive(task: tuple[str, int]) -> dict[str, dict[str, float]]:
        bench, number = task
        if bench in folders:
            return judge(*stored_parts(folders[bench], number))
        return judge(*simulated_parts(bench, number, arguments.runs))

    judged: Judged = {bench: {detector: [] for detector in DETECTORS} for bench in archives}
    of_tasks = Forks(arguments.processes)(judged_archive, tasks)
    for done, ((bench, _), rates) in enumerate(zip(tasks, of_tasks, strict=True), 1):
        for detector, row in rates.items():
            judged[bench][detector].append(row)
        print(f"{done} of {len(tasks)}: {bench}", file=sys.stderr, flush=True)
    text, ranges = report(judged), range_rows(judged)
    if arguments.ranges:
        write_csv(arguments.ranges, list(ranges[0]), ranges)
    if arguments.output:
        arguments.output.write_text(text, encoding="utf-8")
    only = [row for row in bench_rows(judged) if row["part"] == JUDGED_ONLY]
    shown = [{name: row[name] for name in ("bench", "detector", *SHOWN)} for row in only]
    blocks = {"ranges": table(ranges), "judged only": table(shown)}
    for page in arguments.pages:
        filled = filled_page(page.read_text(encoding="utf-8"), blocks, "judge_unseen")
        page.write_text(filled, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
