"""Compare thresholds for the scores of the taught detector, all learned from the same folds.

    python tests/benchmarks/compare_thresholds.py

A threshold sees the cross-validated scores of the healthy recordings that teach. It should keep the
wanted specificity on every bench, whatever the distribution of the scores, and scatter little.
These archives chose the threshold of the detector, so they judge nothing.
"""

import argparse
import functools
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from scipy.stats import t as student

sys.path.insert(0, str(Path(__file__).parents[2] / "workflow" / "scripts"))

import judge_unseen
from judge_rates import mean_row, rates
from judge_report import table

from capsule.configuration_files import read_config_file
from capsule.detectors.adaptation import Adaptation
from capsule.detectors.described import read_scorer
from capsule.detectors.operating_point import threshold_at
from capsule.detectors.taught import adaptation_features, upper_bound
from capsule.detectors.training import TrainingArchive
from capsule.forks import Forks
from capsule.number_arguments import natural
from capsule.project import CONFIG, WEIGHTS

FIRST_SEED = 230_000
SHOWN = ("specificity", "recall at 1 mm", "recall from 2 mm")
# True size, adapted score, and the scores of the healthy recordings that teach its threshold.
Fold = tuple[float, float, np.ndarray]


def by_deviation(scores: np.ndarray, share: float, factor: float) -> float:
    """Return the mean plus `factor` times the standard deviations that Student's t asks for."""
    count = scores.size
    deviations = student.ppf(share, count - 1) * np.sqrt(1 + 1 / count)
    return float(scores.mean() + factor * deviations * scores.std(ddof=1))


THRESHOLDS: dict[str, Callable[[np.ndarray, float], float]] = {
    "mean + t sd": functools.partial(by_deviation, factor=1.0),
    "mean + 1.15 t sd": functools.partial(by_deviation, factor=1.15),
    "rank": threshold_at,
    "median and upper half": upper_bound,
}


def folds_of(archive: TrainingArchive) -> Iterator[Fold]:
    """Yield the fold of each recording with a score; without a verdict, its score is NaN."""
    settings, features = archive.settings["taught"], archive.features
    names = [name for name in archive.sizes_mm if not np.isnan(features[name].score)]
    weight = settings["evidence_weight"]
    described = [adaptation_features(features[n], archive.passages[n], weight) for n in names]
    scores = np.array([features[name].score for name in names])
    sizes_mm = np.array([archive.sizes_mm[name] for name in names])
    adaptation = Adaptation(
        np.array(described), scores, sizes_mm, settings["height"], settings["penalties"]
    )
    for place, name in enumerate(names):
        adapted = adaptation.without(np.array([place]))
        score = scores[place] + adapted.correction.of(described[place])
        healthy = adapted.scores[np.delete(sizes_mm, place) == 0]
        yield sizes_mm[place], np.nan if archive.no_verdict[name] else score, healthy


def rates_of(folds: list[Fold], threshold: Callable, specificity: float) -> dict[str, float]:
    """Return specificity and recalls of an archive with one kind of threshold."""
    sizes_mm = np.array([size for size, _, _ in folds])
    found = np.array([score > threshold(healthy, specificity) for _, score, healthy in folds])
    row = rates(sizes_mm, found.astype(float))
    return {name: row[name] for name in SHOWN}


def main() -> None:
    """Print a row for each threshold: the means over the benches, and the range."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = functools.partial(parser.add_argument, metavar="N", type=natural)
    add("--archives", default=60, help="archives of each bench (default: 60)")
    add("--processes", default=2, help="benches that are simulated at a time (default: 2)")
    arguments = parser.parse_args()
    config, scorer = read_config_file(CONFIG / "config.yaml"), read_scorer(WEIGHTS)
    specificity = config["evaluation"]["specificity"]

    def means_of(bench: str) -> dict[str, dict]:
        rows: dict[str, list[dict]] = {name: [] for name in THRESHOLDS}
        for readings in judge_unseen.simulated(bench, arguments.archives, FIRST_SEED):
            folds = list(folds_of(judge_unseen.training_archive(readings, config, scorer, 0)))
            for name, threshold in THRESHOLDS.items():
                rows[name].append(rates_of(folds, threshold, specificity))
        print(f"simulated: {bench}", file=sys.stderr, flush=True)
        return {name: mean_row({}, each) for name, each in rows.items()}

    of_benches = list(Forks(arguments.processes)(means_of, judge_unseen.bench_names()))
    rows = []
    for name in THRESHOLDS:
        each = [means[name] for means in of_benches]
        ends = [f"{100 * end(row['specificity'] for row in each):.1f} %" for end in (min, max)]
        label = {"threshold": name, "specificity of the benches": " to ".join(ends)}
        rows.append(mean_row(label, each))
    print(table(rows))


if __name__ == "__main__":
    main()
