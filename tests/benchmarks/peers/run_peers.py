"""Judge the usual alternatives: MiniRocket with a ridge classifier, and the nearest neighbour.

    python -m venv peers && peers/bin/pip install -r tests/benchmarks/peers/requirements.txt
    python tests/benchmarks/export_archives.py archives/
    peers/bin/python tests/benchmarks/peers/run_peers.py archives/ --output peers.json
    python tests/benchmarks/judge_detectors.py --peers peers.json

Leave-one-out on the same recordings. MiniRocket's kernels are drawn once an archive, which favours
it: their thresholds are quantiles of the recording that is judged, too. The nearest neighbour is
that of aeon's sliding distance (sbd) between the normalized readings, of each pair once; and, as a
stronger one, by the sliding RMSE of the paper's matrices, whose spectra are shared by all pairs.
All name one of six classes: no nodule, or a size. What each takes where every fold is taught and
asked by itself, as cross-validation by a library does, is measured on some folds.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", NUMBA_NUM_THREADS="1")

import numpy as np
from aeon.classification.distance_based import KNeighborsTimeSeriesClassifier
from aeon.distances import sbd_pairwise_distance
from aeon.transformations.collection.convolution_based import MiniRocket
from scipy.signal import correlate
from sklearn.linear_model import RidgeClassifierCV
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(ROOT / "workflow" / "scripts"), str(Path(__file__).parents[1])]

from judge_rates import rates

from capsule.method.preprocessing import normalize, preprocess

LENGTH, TIMED_FOLDS = 1000, 6


def read_archive(path: Path) -> tuple[np.ndarray, list[np.ndarray]]:
    """Read the true sizes and the readings of an exported archive."""
    with np.load(path) as stored:
        names = list(stored)
        readings = [stored[name].astype(float) for name in names]
    return np.array([float(name.split("mm_")[0]) for name in names]), readings


def padded(readings: list[np.ndarray]) -> np.ndarray:
    """Lay the normalized readings out in one array (n, S, L), with zeros behind each."""
    series = np.zeros((len(readings), readings[0].shape[0], LENGTH))
    for place, values in enumerate(readings):
        series[place, :, : values.shape[1]] = normalize(values)
    return series


def kernels() -> MiniRocket:
    """Return the transform of MiniRocket."""
    return MiniRocket(random_state=1, n_jobs=1)


def classifier() -> Pipeline:
    """Return the ridge classifier behind it, its penalty found by cross-validation."""
    return make_pipeline(
        StandardScaler(with_mean=False), RidgeClassifierCV(alphas=np.logspace(-3, 3, 10))
    )


def minirocket(sizes: np.ndarray, readings: list[np.ndarray]) -> np.ndarray:
    """Predict every recording's size by MiniRocket and ridge, the recording itself left out."""
    features = np.asarray(kernels().fit_transform(padded(readings)))
    predicted = np.empty(sizes.size)
    for place in range(sizes.size):
        others = np.arange(sizes.size) != place
        model = classifier().fit(features[others], sizes[others].astype(int))
        predicted[place] = model.predict(features[place : place + 1])[0]
    return predicted


def minirocket_fold(taught: np.ndarray, sizes: np.ndarray, asked: np.ndarray) -> float:
    """Predict one recording's size by kernels and ridge that are taught by the others alone."""
    model = make_pipeline(kernels(), classifier()).fit(taught, sizes.astype(int))
    return float(model.predict(asked[np.newaxis])[0])


def library_neighbour(sizes: np.ndarray, readings: list[np.ndarray]) -> np.ndarray:
    """Predict every recording's size by that of the nearest other one, as aeon measures it."""
    distances = np.asarray(sbd_pairwise_distance(padded(readings)))
    np.fill_diagonal(distances, np.inf)
    return sizes[distances.argmin(axis=1)]


def library_neighbour_fold(taught: np.ndarray, sizes: np.ndarray, asked: np.ndarray) -> float:
    """Predict one recording's size by aeon's classifier."""
    model = KNeighborsTimeSeriesClassifier(n_neighbors=1, distance="sbd")
    return float(model.fit(taught, sizes.astype(int)).predict(asked[np.newaxis])[0])


def matrices(readings: list[np.ndarray]) -> np.ndarray:
    """Make the paper's matrices, (n, S, L)."""
    return np.array(
        [preprocess(values, window=84, threshold=1.0, length=LENGTH) for values in readings]
    )


def nearest_neighbour(sizes: np.ndarray, readings: list[np.ndarray]) -> np.ndarray:
    """Predict every recording's size by that of the nearest other one, in the paper's matrices."""
    recordings = matrices(readings)
    spectra = np.fft.rfft(recordings, 2 * LENGTH, axis=2)
    energy = (recordings**2).sum(axis=(1, 2))
    predicted = np.empty(sizes.size)
    for place in range(sizes.size):
        product = (spectra * np.conj(spectra[place])).sum(axis=1)
        overlap = np.fft.irfft(product, 2 * LENGTH, axis=1).max(axis=1)
        distance = energy - 2 * overlap
        distance[place] = np.inf
        predicted[place] = sizes[distance.argmin()]
    return predicted


def nearest_neighbour_fold(taught: np.ndarray, sizes: np.ndarray, asked: np.ndarray) -> float:
    """Predict one recording's size by scipy's correlation of each pair and sensor."""
    distances = []
    for matrix in taught:
        overlap = sum(correlate(row, other) for row, other in zip(matrix, asked, strict=True))
        distances.append((matrix**2).sum() - 2 * overlap.max())
    return float(sizes[int(np.argmin(distances))])


PEERS = {
    "MiniRocket and ridge": minirocket,
    "nearest neighbour (aeon, sbd)": library_neighbour,
    "nearest neighbour (sliding RMSE)": nearest_neighbour,
}
# How each peer lays out the recordings, which is not timed, and a fold of it by itself.
FOLDS: dict[str, tuple[Callable, Callable]] = {
    "MiniRocket and ridge": (padded, minirocket_fold),
    "nearest neighbour (aeon, sbd)": (padded, library_neighbour_fold),
    "nearest neighbour (sliding RMSE)": (matrices, nearest_neighbour_fold),
}


def folds_seconds(
    name: str, sizes: np.ndarray, readings: list[np.ndarray], predicted: np.ndarray
) -> float:
    """Return the CPU time of all folds of a peer, each by itself, told from some.

    Raises
    ------
    AssertionError
        If a neighbour is not the one that was predicted from all pairs. (MiniRocket's kernels are
        others in every fold.)
    """
    lay_out, predict = FOLDS[name]
    recordings, seconds = lay_out(readings), []
    for place in range(0, sizes.size, sizes.size // TIMED_FOLDS):
        others = np.arange(sizes.size) != place
        taught = recordings[others]
        started = time.process_time()
        said = predict(taught, sizes[others], recordings[place])
        seconds.append(time.process_time() - started)
        if PEERS[name] is not minirocket and said != predicted[place]:
            raise AssertionError(f"{name}, fold {place}: {said} mm, not {predicted[place]} mm")
    return float(np.median(seconds)) * sizes.size


def main() -> None:
    """Judge every archive by all peers."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("archives", type=Path, help="folder of exported archives")
    parser.add_argument("--output", type=Path, required=True, help="output: JSON")
    arguments = parser.parse_args()
    rows: dict[str, list[dict]] = {}
    each_by_itself: dict[str, float] = {}
    paths = sorted(arguments.archives.glob("*.npz"))
    # The first calls compile.
    sizes, readings = read_archive(paths[0])
    for name, peer in PEERS.items():
        few, of_few = sizes[::20], readings[::20]
        folds_seconds(name, few, of_few, peer(few, of_few))
    for path in paths:
        sizes, readings = read_archive(path)
        for name, peer in PEERS.items():
            started = time.process_time()
            predicted = peer(sizes, readings)
            row = rates(sizes, predicted) | {"seconds": time.process_time() - started}
            if path == paths[0]:
                each_by_itself[name] = folds_seconds(name, sizes, readings, predicted)
            row["seconds, each fold by itself"] = each_by_itself[name]
            rows.setdefault(name, []).append(row)
            print(path.name, name, row, flush=True)
    arguments.output.write_text(json.dumps(rows, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
