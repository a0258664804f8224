"""Measure the sliding comparison and a whole fit beside simple alternatives.

    python tests/benchmarks/compare_fits.py raw/3mm/r07.csv
    python tests/benchmarks/compare_fits.py raw/3mm/r07.csv --recordings raw/*mm/r12.csv

Every way renders the same particles and slides them over the same matrix, in turn, in one
process, and must find the same RMSE and lag; the table gives medians of the rounds. With
--recordings a second table gives the ratios on other recordings: a short one takes shorter FFTs.
stumpy is measured where it is installed (`pip install stumpy`); nothing else here needs it.
"""

import argparse
import functools
import importlib.util
import os
import platform
import statistics
import sys
import time
from pathlib import Path

# One thread, as in the workflow's jobs; must be set before numpy is loaded.
os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", NUMBA_NUM_THREADS="1")

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "workflow" / "scripts"))

import numpy as np
import scipy.signal
import yaml

from capsule.method.particle import (
    CANDIDATES_AT_ONCE,
    ParameterSpace,
    Particle,
    ParticleRenderer,
    compare_vectors,
    fit_particle,
    render,
)
from capsule.method.preprocessing import preprocess
from capsule.method.sliding import SlidingComparison
from capsule.recordings.recording import read_recording
from capsule.seeding import generator

CONFIG = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
FIT = dict(CONFIG["fit"])
SEED = FIT.pop("seed")
COUNTS = {key: FIT.pop(key) for key in ("particles", "iterations", "first_peak")}
SPACE = ParameterSpace(**FIT)


def best_of(squares: np.ndarray, matrix: np.ndarray) -> tuple[float, int]:
    """Return the smallest RMSE and its lag from |F' - P'|^2 at every lag."""
    best = int(np.argmin(squares))
    return float(np.sqrt(max(squares[best], 0.0) / (3 * matrix.size))), best + 1


def literal(matrix: np.ndarray, particle: np.ndarray) -> tuple[float, int]:
    """Shift the particle by one column after the other and take every RMSE (eq. RMSE)."""
    sensors, length = matrix.shape
    frame = np.pad(matrix, ((0, 0), (length, length)))
    shifted = np.pad(particle, ((0, 0), (0, 2 * length)))
    values = []
    for _ in range(2 * length):
        values.append(np.linalg.norm(frame - shifted) / np.sqrt(sensors * 3 * length))
        # Nothing falls off the right edge before the last lag, so this is the shift matrix R.
        shifted = np.roll(shifted, 1, axis=1)
    return min(values), int(np.argmin(values)) + 1


def from_correlation(matrix: np.ndarray, particle: np.ndarray, correlation: np.ndarray) -> tuple:
    """Return the best lag from the correlation at the shifts -(L - 1)..L - 1."""
    products = np.concatenate([[0.0], correlation])
    squares = np.sum(matrix**2) + np.sum(particle**2) - 2.0 * products
    return best_of(squares, matrix)


def numpy_correlate(matrix: np.ndarray, particle: np.ndarray) -> tuple[float, int]:
    """Correlate each sensor in the time domain."""
    rows = zip(matrix, particle, strict=True)
    total = sum(np.correlate(data, shape, "full") for data, shape in rows)
    return from_correlation(matrix, particle, total)


def scipy_correlate(matrix: np.ndarray, particle: np.ndarray) -> tuple[float, int]:
    """Correlate each sensor with SciPy's FFT method."""
    rows = zip(matrix, particle, strict=True)
    total = sum(scipy.signal.correlate(data, shape, "full", "fft") for data, shape in rows)
    return from_correlation(matrix, particle, total)


def stumpy_mass(matrix: np.ndarray, particle: np.ndarray) -> tuple[float, int]:
    """Take stumpy's distance profile of each sensor, and the energy outside the window."""
    import stumpy

    length = matrix.shape[1]
    frame = np.pad(matrix, ((0, 0), (length, length)))
    squares = np.zeros(2 * length)
    for data, shape in zip(frame, particle, strict=True):
        inside = stumpy.mass(shape, data, normalize=False)[: 2 * length] ** 2
        energy = np.concatenate([[0.0], np.cumsum(data**2)])
        covered = energy[length : 3 * length] - energy[: 2 * length]
        squares += inside + energy[-1] - covered
    return best_of(squares, matrix)


def plain_fft(matrix: np.ndarray, particle: np.ndarray) -> tuple[float, int]:
    """Correlate by numpy's FFT, without keeping anything from call to call."""
    length = matrix.shape[1]
    spectrum = np.fft.rfft(matrix, 2 * length) * np.conj(np.fft.rfft(particle, 2 * length))
    circular = np.fft.irfft(spectrum.sum(axis=0), 2 * length)
    products = np.concatenate([circular[length:], circular[:length]])
    squares = np.sum(matrix**2) + np.sum(particle**2) - 2.0 * products
    return best_of(squares, matrix)


METHODS = {"literal formula": literal, "numpy.correlate": numpy_correlate}
SLOW = set(METHODS)  # too slow for all particles of a round
METHODS["scipy.signal.correlate, fft"] = scipy_correlate
if importlib.util.find_spec("stumpy"):
    METHODS["stumpy.mass, normalize=False"] = stumpy_mass
METHODS["plain numpy FFT"] = plain_fft


def compare_with(method: object, matrix: np.ndarray, vectors: np.ndarray) -> list[tuple]:
    """Render and compare every particle in one way."""
    length, first_peak = matrix.shape[1], COUNTS["first_peak"]
    return [
        method(matrix, render(Particle.from_vector(vector), first_peak, length))
        for vector in vectors
    ]


def ours(matrix: np.ndarray, vectors: np.ndarray) -> list[tuple]:
    """Render and compare every particle as a fit does."""
    sensors, length = matrix.shape
    comparison = SlidingComparison(matrix, CANDIDATES_AT_ONCE)
    renderer = ParticleRenderer(sensors, length, COUNTS["first_peak"], SPACE)
    energy = float(np.sum(matrix**2))
    results = []
    for start in range(0, len(vectors), CANDIDATES_AT_ONCE):
        group = vectors[start : start + CANDIDATES_AT_ONCE]
        gains, lags = compare_vectors(group, renderer, comparison)
        distances = np.sqrt((energy - gains) / (3 * matrix.size))
        results.extend(zip(distances.tolist(), lags.tolist(), strict=True))
    return results


def plain_fit(matrix: np.ndarray) -> float:
    """Fit as one would with plain numpy and its FFT; the same random numbers as ours."""
    sensors = matrix.shape[0]
    numbers = generator(SEED, "benchmark")
    candidates = SPACE.draw(COUNTS["particles"], sensors, numbers)
    distances = [rmse for rmse, _ in compare_with(plain_fft, matrix, candidates)]
    best, smallest = candidates[int(np.argmin(distances))], min(distances)
    for step in SPACE.draw_steps(COUNTS["iterations"], sensors, numbers):
        proposal = np.clip(best + step, *SPACE.bounds(sensors))
        (rmse, _), *_ = compare_with(plain_fft, matrix, proposal[np.newaxis])
        if rmse < smallest:
            best, smallest = proposal, rmse
    return smallest


def our_fit(matrix: np.ndarray) -> float:
    """Fit with the library."""
    return fit_particle(matrix, generator(SEED, "benchmark"), **COUNTS, space=SPACE).rmse


def cpu_seconds(function: object, *arguments: object) -> tuple[float, object]:
    """Call once; give the CPU time and the result."""
    start = time.process_time()
    result = function(*arguments)
    return time.process_time() - start, result


def read_matrix(path: Path) -> np.ndarray:
    """Read a recording and preprocess it as the workflow does."""
    with path.open("rb") as stream:
        recording = read_recording(stream, CONFIG["recording"]["sensors"])
    return preprocess(recording.values, **CONFIG["preprocessing"])


def measure(matrix: np.ndarray, rounds: int, count: int) -> dict[str, float]:
    """Compare `count` particles in every way; give the median CPU times per particle in s."""
    vectors = SPACE.draw(count, matrix.shape[0], generator(SEED, "benchmark"))
    expected = ours(matrix, vectors)
    methods = {name: functools.partial(compare_with, method) for name, method in METHODS.items()}
    times: dict[str, list[float]] = {name: [] for name in [*methods, "ours"]}
    for round_number in range(rounds + 1):
        for name, method in {**methods, "ours": ours}.items():
            some = vectors[:4] if name in SLOW else vectors
            seconds, results = cpu_seconds(method, matrix, some)
            assert [lag for _, lag in results] == [lag for _, lag in expected[: len(some)]], name
            np.testing.assert_allclose(
                [rmse for rmse, _ in results],
                [rmse for rmse, _ in expected[: len(some)]],
                atol=1e-9,
                err_msg=name,
            )
            if round_number:  # the first round warms caches and compiles stumpy
                times[name].append(seconds / len(some))
    return {name: statistics.median(measured) for name, measured in times.items()}


def filled_columns(matrix: np.ndarray) -> int:
    """Count the columns from the recording's first value to its last."""
    filled = np.flatnonzero(matrix.any(axis=0))
    return int(filled[-1] - filled[0] + 1) if filled.size else 0


def print_recordings(paths: list[Path], rounds: int, count: int) -> None:
    """Print how much faster ours is on each recording, and the smallest and largest ratios."""
    matrices = [(path, read_matrix(path)) for path in paths]
    measured = [(path, matrix, measure(matrix, rounds, count)) for path, matrix in matrices]
    print(f"\n| recording | columns | ours | {' | '.join(METHODS)} |")
    print(f"|---|---:|---:|{'---:|' * len(METHODS)}")
    ratios = {name: [] for name in METHODS}
    for path, matrix, medians in measured:
        for name in METHODS:
            ratios[name].append(medians[name] / medians["ours"])
        cells = " | ".join(f"{values[-1]:,.1f}" for values in ratios.values())
        mine = f"{1e6 * medians['ours']:,.0f} us"
        print(f"| {path.parent.name}/{path.stem} | {filled_columns(matrix)} | {mine} | {cells} |")
    for word, choose in (("smallest", min), ("median", statistics.median), ("largest", max)):
        cells = " | ".join(f"{choose(values):,.1f}" for values in ratios.values())
        print(f"| {word} | | | {cells} |")


def main() -> None:
    """Measure and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", type=Path, help="a recording, such as raw/3mm/r07.csv")
    parser.add_argument("--rounds", type=int, default=5, help="rounds to take medians of")
    parser.add_argument("--particles", type=int, default=1000, help="particles in a round")
    parser.add_argument(
        "--recordings", type=Path, nargs="+", default=[], help="others, for a table of ratios"
    )
    arguments = parser.parse_args()
    matrix = read_matrix(arguments.recording)
    medians = measure(matrix, arguments.rounds, arguments.particles)

    print(f"{platform.machine()}, Python {platform.python_version()}, numpy {np.__version__}")
    print(f"{arguments.recording}: {matrix.shape[0]} x {matrix.shape[1]}, rendering included\n")
    print("| comparison | median per particle | ours is faster by |")
    print("|---|---:|---:|")
    for name, median in medians.items():
        print(f"| {name} | {1e6 * median:,.0f} us | {median / medians['ours']:,.1f} |")
    if arguments.recordings:
        print_recordings(arguments.recordings, arguments.rounds, arguments.particles)

    fits: dict[str, list[float]] = {"plain numpy FFT": [], "ours": []}
    for _ in range(arguments.rounds):
        plain_seconds, plain_rmse = cpu_seconds(plain_fit, matrix)
        our_seconds, our_rmse = cpu_seconds(our_fit, matrix)
        np.testing.assert_allclose(our_rmse, plain_rmse, atol=1e-9)
        fits["plain numpy FFT"].append(plain_seconds)
        fits["ours"].append(our_seconds)
    comparisons = COUNTS["particles"] + COUNTS["iterations"]
    print(f"\n| whole fit, {comparisons} comparisons | median CPU time |\n|---|---:|")
    for name, measured in fits.items():
        print(f"| {name} | {statistics.median(measured):.3f} s |")


if __name__ == "__main__":
    main()
