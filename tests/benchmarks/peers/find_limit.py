"""How well a nodule of one size can be told from none at all: a classifier taught by thousands.

    peers/bin/python tests/benchmarks/peers/find_limit.py --train 10000 --output limit.json

MiniRocket with ridge regression learns from that many simulated recordings, half of them over a
nodule, and judges 1200 others. It may use where along the run the simulated nodule usually lies,
which no real detector could: so it shows a limit, not a rival.
"""

import argparse
import json
import os
import sys
from pathlib import Path

os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", NUMBA_NUM_THREADS="1")

import numpy as np
from aeon.transformations.collection.convolution_based import MiniRocket

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "workflow" / "scripts"))

from capsule.evaluation.roc import auc, height_at
from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import simulate_run
from capsule.preprocessing import normalize
from edges.phantom import DEFAULT_TABLE, read_phantom

LENGTH, TEACHING_SEED, FRESH_SEED, FRESH = 1000, 70_000, 80_000, 600
# Recordings of one series, over one nodule as it was set up once; the next has the next seed.
SERIES = 20
PENALTY = 1000.0


def series_of(phantom: Phantom, size: int, seed: int, count: int) -> np.ndarray:
    """Simulate recordings of one size, normalized and padded with zeros: (count, S, L)."""
    series = np.zeros((count, 4, LENGTH), dtype=np.float32)
    for number in range(count):
        run = simulate_run(phantom, size, seed + number // SERIES, f"{size}mm/r{number}")
        series[number, :, : run.counts.shape[1]] = normalize(run.counts.astype(float))
    return series


def ridge_scores(taught: np.ndarray, target: np.ndarray, fresh: np.ndarray) -> np.ndarray:
    """Score fresh recordings by ridge regression on standardised features."""
    mean, scale = taught.mean(axis=0), taught.std(axis=0) + 1e-6
    taught, fresh = (taught - mean) / scale, (fresh - mean) / scale
    gram = taught @ taught.T
    gram[np.diag_indices_from(gram)] += PENALTY
    return fresh @ (taught.T @ np.linalg.solve(gram, target - target.mean()))


def main() -> None:
    """Find the limit of every size."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--train", type=int, default=10_000, help="recordings that teach, a size")
    parser.add_argument("--sizes", type=int, nargs="+", default=[1, 2, 3], help="nodules, mm")
    parser.add_argument("--specificity", type=float, default=0.95, help="at which recall is given")
    parser.add_argument("--output", type=Path, required=True, help="output: JSON")
    arguments = parser.parse_args()
    phantom, half = read_phantom(DEFAULT_TABLE, []), arguments.train // 2
    healthy = series_of(phantom, 0, TEACHING_SEED, half)
    fresh_healthy = series_of(phantom, 0, FRESH_SEED, FRESH)
    target = np.repeat([0.0, 1.0], half).astype(np.float32)
    rows = []
    for size in arguments.sizes:
        kernels = MiniRocket(random_state=1, n_jobs=1)
        taught = np.concatenate([healthy, series_of(phantom, size, TEACHING_SEED, half)])
        features = np.asarray(kernels.fit_transform(taught), dtype=np.float32)
        fresh = np.concatenate([fresh_healthy, series_of(phantom, size, FRESH_SEED, FRESH)])
        scores = ridge_scores(
            features, target, np.asarray(kernels.transform(fresh), dtype=np.float32)
        )
        none, nodule = scores[:FRESH], scores[FRESH:]
        recall = height_at(none, nodule, np.array([1 - arguments.specificity]))[0]
        row = {"size": f"{size} mm", "taught by": str(2 * half), "AUC": auc(none, nodule)}
        rows.append(row | {f"recall at {100 * arguments.specificity:g} %": float(recall)})
        print(rows[-1], flush=True)
        arguments.output.write_text(json.dumps(rows, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
