"""Judge the detectors on benches that had no part in teaching or designing them.

    python tests/benchmarks/judge_unseen.py --folders FOLDER ...
        --output docs/detection-benches.md --ranges workflow/report/benches.csv

Judged are the usual bench, every bench of config/benches/, and folders of recordings of other
benches: each file of a folder is an archive, an .npz of arrays (S, K) by names such as 3mm/r07.
Each detector judges each recording by what the others of its archive teach. The paper's margin
needs a particle fit for each recording, so it judges fewer archives, with --fit particles and
iterations. Rows are sorted by the taught detector's recall from 2 mm on, the worst first.
"""

import argparse
import functools
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "workflow" / "scripts"))

from judge_rates import mean_row, rates
from judge_report import table

from capsule.configuration_files import read_config_file
from capsule.detectors.described import read_scorer
from capsule.detectors.passage import passage_of
from capsule.detectors.scorer import Scorer, features_of
from capsule.detectors.training import TrainingArchive, detector_class
from capsule.detectors.verdicts import NO_VERDICT
from capsule.files import write_csv
from capsule.forks import Forks
from capsule.naming import size_mm
from capsule.number_arguments import natural
from capsule.phantom.files import BENCHES, DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import planned_runs, simulate_run
from capsule.preprocessing import preprocess
from capsule.project import CONFIG, WEIGHTS
from capsule.templates import TemplateSet, no_nodule_template
from capsule.wave_check import missing_wave
from phantom_study.simulated_archive import DetectorSettings, average_fits, fit_archive

# The phantom was calibrated and the detectors designed on other seeds.
FIRST_SEED = 220_000
SIZES_MM, RUNS = (0, 1, 2, 3, 4, 5), 20
USUAL = "usual"
# The paper's margin, and what learns without fits.
DETECTORS = ("template_threshold", "diagonal", "taught")
Readings = Mapping[str, np.ndarray]


def bench_names() -> list[str]:
    """Return the usual bench and those of config/benches/."""
    return [USUAL, *(path.stem for path in sorted(BENCHES.glob("*.yaml")))]


def simulated(
    bench: str, archives: int, first_seed: int = FIRST_SEED, runs: int = RUNS
) -> Iterator[Readings]:
    """Simulate archives of a bench, one at a time, with some runs of each size."""
    phantom = read_phantom(DEFAULT_TABLE, [], None if bench == USUAL else bench)
    for seed in range(first_seed, first_seed + archives):
        yield {
            run.name: simulate_run(phantom, run.size_mm, seed, run.site).counts.astype(float)
            for run in planned_runs(SIZES_MM, runs, 1)
        }


def stored(folder: Path) -> Iterator[Readings]:
    """Read the archives of a folder, one at a time."""
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as archive:
            yield {name: archive[name].astype(float) for name in archive.files}


def training_archive(
    readings: Readings, config: Mapping, scorer: Scorer, effort: int
) -> TrainingArchive:
    """Put together what the detectors learn from; without effort no particle is fitted."""
    rate_hz, sizes_mm = config["recording"]["rate_hz"], {name: size_mm(name) for name in readings}
    matrices, particles = {}, {}
    templates = TemplateSet((0.0,), (), (no_nodule_template(1, 1),), 1)
    if effort:
        fit = {**config["fit"], "particles": effort, "iterations": effort}
        settings = DetectorSettings(config["preprocessing"], fit)
        matrices = {
            name: preprocess(values, **config["preprocessing"]) for name, values in readings.items()
        }
        particles = fit_archive(matrices, settings)
        templates = average_fits(particles, settings, config["preprocessing"]["length"])
    bench = config["diagonal"]
    passages = {name: passage_of(each, rate_hz, bench) for name, each in readings.items()}
    features = {name: features_of(each, rate_hz, bench, scorer) for name, each in readings.items()}
    rate = config["recording"]["wave_false_rate"]
    no_verdict = {n: missing_wave(each, rate_hz, bench, rate) for n, each in readings.items()}
    return TrainingArchive(
        sizes_mm, templates, particles, passages, matrices.__getitem__, config, features, no_verdict
    )


def judge(archive: TrainingArchive, detector: str) -> dict[str, float]:
    """Judge each recording by what the others teach; a nodule without a verdict is missed."""
    started = time.process_time()
    taught = detector_class(detector)(archive)
    verdicts = [
        NO_VERDICT if reason else taught.without([name]).verdict(archive.recording(name))
        for name, reason in archive.no_verdict.items()
    ]
    seconds = time.process_time() - started
    true_mm = np.array([size_mm(name) for name in archive.no_verdict])
    predicted_mm = np.nan_to_num(np.array([verdict.predicted_mm for verdict in verdicts]))
    low, high = (
        np.array([getattr(verdict, f"estimate_{end}_mm") for verdict in verdicts])
        for end in ("low", "high")
    )
    sized = ~np.isnan(low) & (true_mm > 0)
    held = (low <= true_mm + 1e-9) & (true_mm <= high + 1e-9)
    row = rates(true_mm, predicted_mm)
    wanted = ("specificity", "recall at 1 mm", "recall from 2 mm", "within 1 mm, from 2 mm")
    return {name: row[name] for name in wanted} | {
        "intervals that hold the size": float(held[sized].mean()) if sized.any() else np.nan,
        "their median width (mm)": float(np.median((high - low)[sized])) if sized.any() else np.nan,
        "seconds": seconds,
    }


def judge_bench(
    archives: Iterator[Readings], config: Mapping, scorer: Scorer, effort: int, fitted: int
) -> dict[str, list[dict]]:
    """Judge the archives of one bench by every detector, the paper's margin on the first ones."""
    rows: dict[str, list[dict]] = {detector: [] for detector in DETECTORS}
    for number, readings in enumerate(archives):
        effort_here = effort if number < fitted else 0
        archive = training_archive(readings, config, scorer, effort_here)
        for detector, judged in rows.items():
            if effort_here or detector != "template_threshold":
                judged.append(judge(archive, detector))
    return rows


def ranges(judged: Mapping[str, Mapping[str, list[dict]]]) -> list[dict]:
    """Return each detector's worst, middle and best bench by its recall from 2 mm on."""
    rows = []
    for detector in DETECTORS:
        means = [mean_row({"bench": bench}, each[detector]) for bench, each in judged.items()]
        means.sort(key=lambda row: row["recall from 2 mm"])
        chosen = {"worst": 0, "middle": (len(means) - 1) // 2, "best": len(means) - 1}
        for label, place in chosen.items():
            row = means[place]
            shown = ("bench", "specificity", "recall at 1 mm", "recall from 2 mm")
            rows.append(
                {"detector": detector, "of the benches the": label} | {k: row[k] for k in shown}
            )
    return rows


def _rounded(row: Mapping) -> dict:
    """Round rates as the table does."""
    return {
        key: round(float(f"{100 * value:.1f}") / 100, 3) if isinstance(value, float) else value
        for key, value in row.items()
    }


def read_arguments() -> argparse.Namespace:
    """Read what to judge."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = functools.partial(parser.add_argument, metavar="N", type=natural)
    add("--archives", default=40, help="archives of each simulated bench (default: 40)")
    add("--fitted", default=4, help="archives that the paper's margin judges (default: 4)")
    add("--fit", default=300, help="particles and iterations of its fits (default: 300)")
    add("--processes", default=2, help="benches that are judged at a time (default: 2)")
    add = functools.partial(parser.add_argument, metavar="PATH", type=Path)
    add("--folders", nargs="*", default=[], help="folders of archives of other benches")
    add("--weights", default=WEIGHTS, help="the scorer's weights (default: those that ship)")
    add("--output", help="output: the table, Markdown")
    add("--ranges", help="output: the range, for the report, CSV")
    return parser.parse_args()


def main() -> None:
    """Judge every bench, and write the table."""
    arguments = read_arguments()
    config, scorer = read_config_file(CONFIG / "config.yaml"), read_scorer(arguments.weights)
    benches = {name: simulated(name, arguments.archives) for name in bench_names()}
    benches |= {folder.name: stored(folder) for folder in arguments.folders}

    def judged_bench(bench: str) -> dict[str, list[dict]]:
        rows = judge_bench(benches[bench], config, scorer, arguments.fit, arguments.fitted)
        print(f"judged: {bench}", file=sys.stderr, flush=True)
        return rows

    judged = dict(zip(benches, Forks(arguments.processes)(judged_bench, benches), strict=True))
    by_recall = sorted(
        judged, key=lambda bench: mean_row({}, judged[bench]["taught"])["recall from 2 mm"]
    )
    rows = [
        mean_row({"bench": bench, "archives": str(len(each)), "detector": detector}, each)
        for bench in by_recall
        for detector, each in judged[bench].items()
    ]
    text = (
        "# What the detectors reach on other benches\n\nMade by "
        "`tests/benchmarks/judge_unseen.py`; docs/detection.md explains it. Means over archives "
        f"of 120 simulated recordings, seeds from {FIRST_SEED} on, leave-one-out. The paper's "
        f"margin: fits of {arguments.fit} particles and iterations.\n\n## The range\n\n"
        f"{table(ranges(judged))}\n## Bench by bench\n\nThe worst first.\n\n{table(rows)}"
    )
    if arguments.ranges:
        rows = [_rounded(row) for row in ranges(judged)]
        write_csv(arguments.ranges, list(rows[0]), rows)
    if arguments.output:
        arguments.output.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
