"""How good the detectors are on simulated archives that were not used to design them.

    python tests/benchmarks/judge_detectors.py --output docs/detection-results.md
    python tests/benchmarks/judge_detectors.py --export archives/

Every archive holds 20 recordings a size, of its own seed; every condition changes parameters of
the simulated bench. Each detector judges each recording by what the others of its archive teach.
The paper's detector needs a particle fit for each recording, so it judges only the unchanged bench,
with as many particles and iterations as --fit says. With --export, the recordings of the unchanged
bench are written for peers/run_peers.py, whose answers --peers takes in.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import yaml

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "workflow" / "scripts"), str(Path(__file__).parent)]

from judge_rates import error_row, mean_or_unknown, mean_row, rates, table

from capsule.detectors.diagonal import DiagonalDetector
from capsule.detectors.passage import Passage
from capsule.detectors.search import search
from capsule.detectors.template import TemplateDetector
from capsule.detectors.verdicts import Verdict
from capsule.evaluation import roc
from capsule.evaluation.retest import combined_detections, first_passes
from capsule.fitting import fit_particle
from capsule.particles import ParameterSpace
from capsule.phantom.parameters import Phantom, value_of, with_values
from capsule.phantom.simulation import simulate_run
from capsule.preprocessing import preprocess
from capsule.seeding import generator
from capsule.templates import build_templates
from edges.phantom import DEFAULT_TABLE, read_phantom

# The detector was designed on seeds 5000 to 9999; nothing here may use those.
FIRST_SEED = 60_000
SIZES = (0, 1, 2, 3, 4, 5)
RUNS = 20
# What changes, by what factor.
CONDITIONS = {
    "as configured": {},
    "noise and drift + 50 %": {
        "sensor.noise": 1.5,
        "sensor.drift_per_s": 1.5,
        "sensor.settling": 1.5,
    },
    "capsule 25 % slower": {"advance.speed_mm_s": 0.75},
    "wave 20 % faster": {"wall.speed_mm_s": 1.2},
    "contact - 30 %": {"contact.patch_mm2": 0.7, "contact.reach_mm": 0.7},
    "wall and seat + 30 %": {"wall.unevenness_mm": 1.3, "contact.wander_mm": 1.3},
}
# How far the nodule lies above or below the capsule: what a detector cannot make up for.
HEIGHTS = ("contact.series_offset_mm", "contact.height_offset_mm")
HEIGHT_FACTORS = (0.0, 0.5, 1.0, 1.25, 1.5, 2.0)


def settings() -> dict:
    """Read config.yaml."""
    return yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))


def passage_of(values: np.ndarray, config: dict) -> Passage:
    """Search one recording with the configured detector."""
    return search(values, config["recording"]["rate_hz"], config["diagonal"])


def archive(phantom: Phantom, seed: int, passes: int = 1) -> Iterator[tuple[str, float, object]]:
    """Simulate the recordings of an archive: name, size, run."""
    for size in SIZES:
        for number in range(1, RUNS + 1):
            site = f"{size}mm/r{number:02d}"
            for attempt in range(1, passes + 1):
                yield (
                    f"{site}p{attempt}",
                    float(size),
                    simulate_run(phantom, size, seed, site, str(attempt)),
                )


def learn_diagonal(runs: list, config: dict) -> DiagonalDetector:
    """Search all recordings of an archive, and prepare what they teach."""
    judged = config["evaluation"]
    return DiagonalDetector(
        {name: passage_of(run.counts.astype(float), config) for name, _, run in runs},
        {name: size for name, size, _ in runs},
        specificity=judged["specificity"], prevalence=judged["prevalence"],
        size_ridge=config["diagonal"]["size_ridge"],
    )  # fmt: skip


def judge_diagonal(runs: list, config: dict) -> tuple[dict, DiagonalDetector]:
    """Judge each recording of an archive by what its others teach; give rates and detector."""
    started = time.process_time()
    detector = learn_diagonal(runs, config)
    verdicts = [detector.judge(name, [name]) for name, _, _ in runs]
    seconds = time.process_time() - started
    return diagonal_row(runs, verdicts) | {"seconds": seconds}, detector


def judge_strangers(runs: list, detector: DiagonalDetector, teacher: DiagonalDetector) -> dict:
    """Judge an archive by what another taught: nothing was set up for both."""
    model = teacher.model([])
    return diagonal_row(runs, [model.verdict(detector.passages[name]) for name, _, _ in runs])


def diagonal_row(runs: list, verdicts: list[Verdict]) -> dict:
    """Give the rates of the diagonal detector's verdicts on an archive."""
    true_mm = np.array([size for _, size, _ in runs])
    row = rates(true_mm, np.array([verdict.predicted_mm for verdict in verdicts]))
    scores = np.array([verdict.score for verdict in verdicts])
    row["AUC of 1 mm"] = roc.auc(scores[true_mm == 0], scores[true_mm == 1])
    estimate = np.array([verdict.estimate_mm for verdict in verdicts])
    found = ~np.isnan(estimate) & (true_mm >= 2)
    row["size estimate's error (mm)"] = mean_or_unknown(np.abs(estimate - true_mm)[found])
    where = np.array([run.nodule_at_mm for _, _, run in runs])
    place = np.array([verdict.location_mm for verdict in verdicts])
    error = np.abs(place - where)[found]
    row["place's error, median (mm)"] = float(np.median(error)) if error.size else float("nan")
    return row


def judge_paper(runs: list, config: dict, count: int, seed: int) -> dict[str, dict]:
    """Judge one archive by the paper's detector and by its margin against a threshold."""
    shape = config["preprocessing"]
    fit = {key: value for key, value in config["fit"].items() if key not in ("seed",)}
    first_peak = fit.pop("first_peak")
    fit.pop("particles"), fit.pop("iterations")
    space, sizes = ParameterSpace(**fit), {name: size for name, size, _ in runs}
    started = time.process_time()
    matrices = {name: preprocess(run.counts.astype(float), **shape) for name, _, run in runs}
    particles, by_size = {}, {}
    for name, size in sizes.items():
        if size > 0:
            numbers = generator(seed, "fit", name)
            found = fit_particle(
                matrices[name], numbers, particles=count, iterations=count,
                first_peak=first_peak, space=space,
            )  # fmt: skip
            particles[name] = found.particle
            by_size.setdefault(size, []).append(found.particle)
    templates = build_templates(by_size, sensors=4, first_peak=first_peak, length=shape["length"])
    detector = TemplateDetector(
        templates, particles, sizes, matrices.__getitem__, config["evaluation"]["specificity"]
    )
    verdicts = [detector.judge(name, detector.without([name]))[1:] for name in sizes]
    seconds = time.process_time() - started
    true_mm, rows = np.array(list(sizes.values())), {}
    for place, label in enumerate(("template", "template_threshold")):
        row = rates(true_mm, np.array([each[place].predicted_mm for each in verdicts]))
        scores = np.array([each[place].score for each in verdicts])
        row["AUC of 1 mm"] = roc.auc(scores[true_mm == 0], scores[true_mm == 1])
        rows[label] = row | {"seconds": seconds}
    return rows


def permuted(runs: list, config: dict, seed: int) -> dict:
    """Judge an archive whose labels were dealt out anew, by the whole detector."""
    sizes = np.array([size for _, size, _ in runs])
    dealt = generator(seed, "labels").permutation(sizes)
    shuffled = [(name, float(size), run) for (name, _, run), size in zip(runs, dealt, strict=True)]
    return judge_diagonal(shuffled, config)[0]


def retest_rows(phantom: Phantom, config: dict, seeds: list[int]) -> Iterator[dict]:
    """Judge several passes over each place together."""
    counts = config["evaluation"]["passes"]
    sums: dict[tuple[int, float], list[float]] = {}
    for seed in seeds:
        runs = list(archive(phantom, seed, max(counts)))
        scores = np.array([passage_of(run.counts.astype(float), config).evidence
                           for _, _, run in runs])  # fmt: skip
        sizes = np.array([size for _, size, _ in runs])
        sites = [name.rpartition("p")[0] for name, _, _ in runs]
        for count in counts:
            true_mm, detected = combined_detections(
                scores, sizes, first_passes(sites, count), config["evaluation"]["specificity"]
            )
            for size in SIZES:
                sums.setdefault((count, size), []).append(float(detected[true_mm == size].mean()))
    for count in counts:
        yield {"passes": str(count), "false alarms": np.mean(sums[count, 0])} | {
            f"found at {size} mm": np.mean(sums[count, size]) for size in SIZES[1:]
        }


def changed(phantom: Phantom, factors: dict[str, float]) -> Phantom:
    """Change parameters of the bench by factors."""
    return with_values(
        phantom, {key: factor * value_of(phantom, key) for key, factor in factors.items()}
    )


def judge_bench(phantom: Phantom, seeds: list[int], config: dict) -> list[dict]:
    """Judge archives of one bench by the diagonal detector."""
    rows = [judge_diagonal(list(archive(phantom, seed)), config)[0] for seed in seeds]
    print(table([mean_row({}, rows)]), file=sys.stderr, flush=True)
    return rows


def judge_all(
    phantom: Phantom, seeds: list[int], config: dict, by_paper: int, count: int
) -> dict[str, list[dict]]:
    """Judge archives by each detector, the first of them by the paper's as well."""
    found: dict[str, list[dict]] = {}
    # The last archive teaches the first one.
    teacher = learn_diagonal(list(archive(phantom, seeds[-1])), config)
    for number, seed in enumerate(seeds):
        runs = list(archive(phantom, seed))
        rows = judge_paper(runs, config, count, seed) if number < by_paper else {}
        rows["diagonal"], detector = judge_diagonal(runs, config)
        rows["diagonal, taught by another archive"] = judge_strangers(runs, detector, teacher)
        rows["diagonal, labels dealt out anew"] = permuted(runs, config, seed)
        for name, row in rows.items():
            found.setdefault(name, []).append(row)
        teacher = detector
    return found


def main() -> None:
    """Simulate, judge, and write the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--archives", type=int, default=60, help="archives a condition")
    parser.add_argument(
        "--paper-archives", type=int, default=60, help="those that the paper's judges"
    )
    parser.add_argument("--fit", type=int, default=300, help="particles and iterations of a fit")
    parser.add_argument(
        "--retest-archives", type=int, default=20, help="archives of several passes"
    )
    parser.add_argument("--export", type=Path, help="write archives for peers/run_peers.py")
    parser.add_argument("--peers", type=Path, help="what peers/run_peers.py wrote, JSON")
    parser.add_argument("--limit", type=Path, help="what peers/find_limit.py wrote, JSON")
    parser.add_argument("--parameters", type=Path, default=DEFAULT_TABLE, help="phantom.yaml")
    parser.add_argument("--output", type=Path, help="output: the tables, Markdown")
    arguments = parser.parse_args()
    config, phantom = settings(), read_phantom(arguments.parameters, [])
    # No more can be judged in these ways than there are.
    arguments.paper_archives = min(arguments.paper_archives, arguments.archives)
    arguments.retest_archives = min(arguments.retest_archives, arguments.archives)
    seeds = [FIRST_SEED + number for number in range(arguments.archives)]
    if arguments.export:
        arguments.export.mkdir(parents=True, exist_ok=True)
        for seed in seeds:
            runs = list(archive(phantom, seed))
            arrays = {name.replace("/", "_"): run.counts for name, _, run in runs}
            np.savez(arguments.export / f"{seed}.npz", **arrays)
        return
    judged = judge_all(phantom, seeds, config, arguments.paper_archives, arguments.fit)

    def rows_of(factors: dict[str, float]) -> list[dict]:
        # The bench as configured is judged already.
        if all(factor == 1.0 for factor in factors.values()):
            return judged["diagonal"]
        return judge_bench(changed(phantom, factors), seeds, config)

    conditions = [
        mean_row({"condition": label}, rows_of(factors)) for label, factors in CONDITIONS.items()
    ]
    conditions.append(error_row({"condition": "standard error, as configured"}, judged["diagonal"]))
    heights = [
        mean_row({"heights": f"{factor:g} times"}, rows_of(dict.fromkeys(HEIGHTS, factor)))
        for factor in HEIGHT_FACTORS
    ]
    peers = json.loads(arguments.peers.read_text()) if arguments.peers else {}
    judged_peers = "".join(f" {name}: {len(rows)} archives." for name, rows in peers.items())
    detectors = [mean_row({"detector": name}, rows) for name, rows in (judged | peers).items()]
    margins = [row["AUC of 1 mm"] for row in judged["template"]]
    wins = sum(
        row["AUC of 1 mm"] > margin
        for row, margin in zip(judged["diagonal"], margins, strict=False)
    )
    retests = list(retest_rows(phantom, config, seeds[: arguments.retest_archives]))
    text = (
        "# What the detectors reach on simulated recordings\n\n"
        "Made by `tests/benchmarks/judge_detectors.py`; docs/detection.md explains it. Means over "
        f"{arguments.archives} simulated archives of 120 recordings, seeds {seeds[0]} to "
        f"{seeds[-1]}, leave-one-out.\n\n## The diagonal detector on changed benches\n\n"
        f"{table(conditions)}\n## How well nodule and capsule are set up\n\n"
        "The diagonal detector. The spreads of the nodule's height against the capsule, times the "
        "calibrated ones: a nodule that the capsule passes by leaves no trace.\n\n"
        f"{table(heights)}\n"
        "## The detectors on the bench as configured\n\n"
        f"The paper's with {arguments.fit} particles and iterations, on "
        f"{arguments.paper_archives} archives. The diagonal's AUC of 1 mm is above the paper's "
        f"margin's on {wins} of {len(margins)}.{judged_peers}\n\n{table(detectors)}\n"
        "## Several passes over one place, judged together\n\n"
        f"The diagonal detector on {arguments.retest_archives} archives.\n\n{table(retests)}"
    )
    if arguments.limit:
        text += (
            "\n## What can be told from none at all on this bench\n\nMiniRocket with ridge, taught "
            "by thousands of recordings, on 1200 others (`peers/find_limit.py`).\n\n"
            + table(json.loads(arguments.limit.read_text()))
        )
    if arguments.output:
        arguments.output.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
