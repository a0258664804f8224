"""What a user would pick instead: MiniRocket with a ridge classifier, and the nearest neighbour.

    python -m venv peers && peers/bin/pip install -r tests/benchmarks/peers/requirements.txt
    python tests/benchmarks/judge_detectors.py --archives 5 --export archives/
    peers/bin/python tests/benchmarks/peers/run_peers.py archives/ --output peers.json
    python tests/benchmarks/judge_detectors.py --peers peers.json

Leave-one-out on the same recordings. MiniRocket's kernels are drawn once an archive, which favours
it: nothing of the labels enters them. The neighbour is the nearest by the sliding RMSE of the
paper's matrices. Both name one of six classes: no nodule, or a size.
"""

import argparse
import json
import os
import sys
import time
from pathlib import Path

os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", NUMBA_NUM_THREADS="1")

import numpy as np
from aeon.transformations.collection.convolution_based import MiniRocket
from sklearn.linear_model import RidgeClassifierCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(ROOT / "workflow" / "scripts"), str(Path(__file__).parents[1])]

from judge_rates import rates  # noqa: E402

from capsule.preprocessing import normalize, preprocess  # noqa: E402

LENGTH = 1000


def read_archive(path: Path) -> tuple[np.ndarray, list[np.ndarray]]:
    """Read the true sizes and the readings of an exported archive."""
    with np.load(path) as stored:
        names = list(stored)
        readings = [stored[name].astype(float) for name in names]
    return np.array([float(name.split("mm_")[0]) for name in names]), readings


def minirocket(sizes: np.ndarray, readings: list[np.ndarray]) -> np.ndarray:
    """Predict every recording's size by MiniRocket and ridge, the recording itself left out."""
    series = np.zeros((len(readings), readings[0].shape[0], LENGTH))
    for place, values in enumerate(readings):
        series[place, :, : values.shape[1]] = normalize(values)
    features = np.asarray(MiniRocket(random_state=1, n_jobs=1).fit_transform(series))
    predicted = np.empty(sizes.size)
    for place in range(sizes.size):
        others = np.arange(sizes.size) != place
        model = make_pipeline(
            StandardScaler(with_mean=False), RidgeClassifierCV(alphas=np.logspace(-3, 3, 10))
        )
        model.fit(features[others], sizes[others].astype(int))
        predicted[place] = model.predict(features[place : place + 1])[0]
    return predicted


def nearest_neighbour(sizes: np.ndarray, readings: list[np.ndarray]) -> np.ndarray:
    """Predict every recording's size by the nearest other recording's."""
    matrices = np.array(
        [preprocess(values, window=84, threshold=1.0, length=LENGTH) for values in readings]
    )
    spectra = np.fft.rfft(matrices, 2 * LENGTH, axis=2)
    energy = (matrices**2).sum(axis=(1, 2))
    predicted = np.empty(sizes.size)
    for place in range(sizes.size):
        product = (spectra * np.conj(spectra[place])).sum(axis=1)
        overlap = np.fft.irfft(product, 2 * LENGTH, axis=1).max(axis=1)
        distance = energy - 2 * overlap
        distance[place] = np.inf
        predicted[place] = sizes[distance.argmin()]
    return predicted


def main() -> None:
    """Judge every archive by both peers."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("archives", type=Path, help="folder of exported archives")
    parser.add_argument("--output", type=Path, required=True, help="output: JSON")
    arguments = parser.parse_args()
    rows: dict[str, list[dict]] = {}
    for path in sorted(arguments.archives.glob("*.npz")):
        sizes, readings = read_archive(path)
        for name, peer in (
            ("MiniRocket and ridge", minirocket),
            ("nearest neighbour", nearest_neighbour),
        ):
            started = time.process_time()
            predicted = peer(sizes, readings)
            row = rates(sizes, predicted) | {"seconds": time.process_time() - started}
            rows.setdefault(name, []).append(row)
            print(path.name, name, row, flush=True)
    arguments.output.write_text(json.dumps(rows, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
