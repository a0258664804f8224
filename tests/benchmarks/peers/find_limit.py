"""Find each bench's limit: the rates of a classifier taught by thousands of its recordings.

    python -m venv peers && peers/bin/pip install -r tests/benchmarks/peers/requirements.txt
    peers/bin/python tests/benchmarks/peers/find_limit.py
        --output workflow/studies/results/detection-limits.md

MiniRocket with ridge regression learns from thousands of simulated recordings of a bench, half of
them over a nodule of each size in turn, and judges others. It may use where along the run the
simulated nodule usually lies, which no real detector could: so it shows a limit, not a rival. Its
rival is the same classifier taught by the 120 recordings of an archive, leave-one-out, with the
threshold from the other healthy recordings. The detector `taught` learns from the same thousands:
what it misses then, it does not see at all, or its features do not tell.
"""

import argparse
import os
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace

os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", NUMBA_NUM_THREADS="1")

import numpy as np
from aeon.transformations.collection.convolution_based import MiniRocket

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(ROOT / "workflow" / "scripts"), str(Path(__file__).parents[1])]

from judge_rates import mean_row
from judge_report import table
from judge_unseen import USUAL, bench_names, stored
from judge_unseen import simulated as archives_of

from capsule.arguments import natural
from capsule.detectors.beats import series_of
from capsule.detectors.calibrate import rank_threshold
from capsule.detectors.described import read_scorer
from capsule.detectors.network import Scorer
from capsule.detectors.search import passage_of
from capsule.detectors.taught import Taught
from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG, WEIGHTS
from capsule.evaluation.intervals import height_at
from capsule.method.preprocessing import normalize
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import simulate_run
from capsule.recordings.names import size_mm

LENGTH, TEACHING_SEED, FRESH_SEED, FRESH = 1000, 70_000, 80_000, 600
ARCHIVE_SEED = 110_000
SIZES_MM = (1, 2, 3, 4, 5)
# Recordings of one series, over one nodule as it was set up once; the next has the next seed.
SERIES = 20
PENALTY = 1000.0
SPECIFICITY = 0.95
MINIROCKET, TAUGHT = "MiniRocket", "`taught`"


def lay_out(recordings: Iterable[np.ndarray], count: int) -> np.ndarray:
    """Normalize recordings and pad them with zeros: (count, S, L)."""
    series = np.zeros((count, 4, LENGTH), dtype=np.float32)
    for place, values in enumerate(recordings):
        series[place, :, : values.shape[1]] = normalize(values.astype(float))
    return series


def simulated(phantom: Phantom, size: int, seed: int, count: int) -> Iterator[np.ndarray]:
    """Simulate recordings of one size."""
    for number in range(count):
        name = f"{size}mm/r{number}"
        yield simulate_run(phantom, size, seed + number // SERIES, name).counts.astype(float)


def standardized(features: np.ndarray, like: np.ndarray) -> np.ndarray:
    """Scale features by the mean and deviation of others, in place."""
    mean, scale = like.mean(axis=0), like.std(axis=0) + 1e-6
    features -= mean
    features /= scale
    return features


def ridge_scores(taught: np.ndarray, target: np.ndarray, fresh: np.ndarray) -> np.ndarray:
    """Score fresh recordings by ridge regression on standardised features."""
    fresh = standardized(fresh, taught)
    taught = standardized(taught, taught)
    gram = taught @ taught.T
    gram[np.diag_indices_from(gram)] += PENALTY
    return fresh @ (taught.T @ np.linalg.solve(gram, target - target.mean()))


def left_out_scores(features: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Score each recording by ridge regression that the others teach."""
    features = standardized(features, features)
    gram = features @ features.T
    hat = np.linalg.solve(gram + PENALTY * np.eye(target.size), gram) + 1 / target.size
    return target - (target - hat @ target) / (1 - np.diagonal(hat))


def limits_of(
    phantom: Phantom, teaching: int, config: Mapping, scorer: Scorer
) -> dict[str, dict[str, float]]:
    """Teach MiniRocket and `taught` by thousands of recordings of a bench, and judge others."""
    half, share = teaching // 2, teaching // 2 // len(SIZES_MM)
    counts = {0: half} | dict.fromkeys(SIZES_MM, share)
    sizes_mm = np.repeat(list(counts), list(counts.values())).astype(float)
    taught = _recordings(phantom, TEACHING_SEED, counts)
    fresh = _recordings(phantom, FRESH_SEED, dict.fromkeys(counts, FRESH))
    return {
        MINIROCKET: _recalls(_by_minirocket(taught, sizes_mm, fresh)),
        TAUGHT: _recalls(_by_taught(taught, sizes_mm, fresh, config, scorer)),
    }


def _recordings(phantom: Phantom, seed: int, counts: Mapping[int, int]) -> list[np.ndarray]:
    """Simulate recordings of each size in turn; the readings take a quarter of the memory."""
    return [
        values.astype(np.int16)
        for size, count in counts.items()
        for values in simulated(phantom, size, seed, count)
    ]


def _by_minirocket(
    taught: list[np.ndarray], sizes_mm: np.ndarray, fresh: list[np.ndarray]
) -> np.ndarray:
    """Score fresh recordings by what others teach MiniRocket."""
    kernels = MiniRocket(random_state=1, n_jobs=1)
    features = np.asarray(kernels.fit_transform(lay_out(taught, len(taught))), dtype=np.float32)
    others = np.asarray(kernels.transform(lay_out(fresh, len(fresh))), dtype=np.float32)
    return ridge_scores(features, (sizes_mm > 0).astype(np.float32), others)


def _by_taught(
    taught: list[np.ndarray],
    sizes_mm: np.ndarray,
    fresh: list[np.ndarray],
    config: Mapping,
    scorer: Scorer,
) -> np.ndarray:
    """Score fresh recordings by what others teach the detector; without a wave, the lowest."""

    def described(recordings: list[np.ndarray]) -> list[SimpleNamespace]:
        rate_hz, bench = config["recording"]["rate_hz"], config["diagonal"]
        return [
            SimpleNamespace(
                features=scorer.features(series_of(values.astype(float), rate_hz, bench)),
                passage=passage_of(values.astype(float), rate_hz, bench),
            )
            for values in recordings
        ]

    seen = np.array([Taught.seen(recording) for recording in described(taught)])
    known = ~np.isnan(seen[:, 0])
    # Each recording is a place of its own.
    places = np.arange(np.count_nonzero(known))
    learned, _ = Taught.learn(seen[known], sizes_mm[known], places, config["taught"])
    model = Taught(np.nan, learned, None, None)
    scores = np.array([model.score(Taught.seen(recording)) for recording in described(fresh)])
    return np.where(np.isnan(scores), np.nanmin(scores), scores)


def _threshold(scores: np.ndarray) -> float:
    return rank_threshold(scores, np.arange(scores.size), SPECIFICITY)


def _recalls(scores: np.ndarray) -> dict[str, float]:
    """Return the rates of fresh recordings, the same number of each size."""
    none, *nodules = np.split(scores, 1 + len(SIZES_MM))
    at = np.array([1 - SPECIFICITY])
    return row_of(SPECIFICITY, [float(height_at(none, nodule, at)[0]) for nodule in nodules])


def row_of(specificity: float, recalls: Sequence[float]) -> dict[str, float]:
    """Lay out the rates, sizes from 1 mm on."""
    names = [f"recall at {size} mm" for size in SIZES_MM]
    rates = dict(zip(names, recalls, strict=True))
    return {"specificity": specificity} | rates | {"recall from 2 mm": float(np.mean(recalls[1:]))}


def rival_of(readings: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Judge each recording of an archive by what the others teach MiniRocket."""
    sizes = np.array([size_mm(name) for name in readings])
    kernels = MiniRocket(random_state=1, n_jobs=1)
    features = np.asarray(kernels.fit_transform(lay_out(readings.values(), sizes.size)), float)
    scores = left_out_scores(features, (sizes > 0).astype(float))
    healthy = np.flatnonzero(sizes == 0)
    alarms = [scores[i] > _threshold(scores[healthy[healthy != i]]) for i in healthy]
    threshold = _threshold(scores[healthy])
    recalls = [float(np.mean(scores[sizes == size] > threshold)) for size in SIZES_MM]
    return row_of(1 - float(np.mean(alarms)), recalls)


def judged(bench: str, archives: Iterable[Mapping[str, np.ndarray]]) -> dict:
    """Return the row of the classifier that the archive's own recordings teach."""
    label = {
        "bench": bench, "classifier": MINIROCKET, "taught by": "the other 119 of an archive",
    }  # fmt: skip
    row = mean_row(label, [rival_of(readings) for readings in archives])
    print(row, file=sys.stderr, flush=True)
    return row


def main() -> None:
    """Find the limit of every bench."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--train", type=natural, default=10_000, help="recordings that teach (default: 10,000)")
    add("--archives", type=natural, default=20, help="archives for the rival (default: 20)")
    add("--benches", nargs="+", help="which (default: the usual one and all of config/benches/)")
    add("--folders", nargs="*", type=Path, default=[], help="folders of archives of other benches")
    add("--output", type=Path, required=True, help="output: the table, Markdown")
    arguments = parser.parse_args()
    names = arguments.benches or bench_names()
    config, scorer = read_config_file(CONFIG / "config.yaml"), read_scorer(WEIGHTS)
    rows = []
    for bench in names:
        phantom = read_phantom(DEFAULT_TABLE, [], None if bench == USUAL else bench)
        rows.append(judged(bench, archives_of(bench, arguments.archives, ARCHIVE_SEED)))
        for classifier, row in limits_of(phantom, arguments.train, config, scorer).items():
            label = {"bench": bench, "classifier": classifier}
            label["taught by"] = f"{arguments.train:,} others of the bench"
            rows.append(label | row)
            print(rows[-1], file=sys.stderr, flush=True)
    rows += [judged(folder.name, stored(folder)) for folder in arguments.folders]
    arguments.output.write_text(
        "# What can be found on each bench\n\nMade by `tests/benchmarks/peers/find_limit.py`; "
        "studies/detection.md tells why. MiniRocket with ridge regression, and the features of the "
        "detector `taught` with its own adaptation, at a specificity of 95 %. "
        f"Taught by an archive: leave-one-out, means over {arguments.archives} archives of 120 "
        f"(of a folder: all its archives), seeds from {ARCHIVE_SEED} on. Taught by thousands: half "
        f"of them without a nodule, judged on {FRESH} others of each size.\n\n{table(rows)}",
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
