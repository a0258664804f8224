"""Measure the sliding comparison beside simple alternatives, and a whole fit.

    python tests/benchmarks/compare_fits.py raw/3mm/r07.csv

Every way renders the same particles and slides them over the same matrix, in turn, in one
process, and must find the same RMSE and lag; the table gives medians of the rounds.
"""

import argparse
import functools
import os
import platform
import statistics
import time
from pathlib import Path

# One thread, as in the workflow's jobs; must be set before numpy is loaded.
os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")

import numpy as np
from tables import table

from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG
from capsule.method.particle import (
    CANDIDATES_AT_ONCE,
    Particle,
    ParticleRenderer,
    compare_vectors,
    fit_options,
    fit_recording,
    render,
)
from capsule.method.preprocessing import preprocess
from capsule.method.sliding import SlidingComparison
from capsule.recordings.recording import read_recording
from capsule.seeding import generator

SETTINGS = read_config_file(CONFIG / "config.yaml")
OPTIONS = fit_options(SETTINGS["fit"])
FIRST_PEAK, SPACE = OPTIONS["first_peak"], OPTIONS["space"]


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


def plain_fft(matrix: np.ndarray, particle: np.ndarray) -> tuple[float, int]:
    """Correlate by numpy's FFT, without keeping anything from call to call."""
    length = matrix.shape[1]
    spectrum = np.fft.rfft(matrix, 2 * length) * np.conj(np.fft.rfft(particle, 2 * length))
    circular = np.fft.irfft(spectrum.sum(axis=0), 2 * length)
    products = np.concatenate([circular[length:], circular[:length]])
    squares = np.sum(matrix**2) + np.sum(particle**2) - 2.0 * products
    best = int(np.argmin(squares))
    return float(np.sqrt(max(squares[best], 0.0) / (3 * matrix.size))), best + 1


def one_by_one(method: object, matrix: np.ndarray, vectors: np.ndarray) -> list[tuple]:
    """Render every particle, and compare it in one way."""
    particles = (Particle.from_vector(vector) for vector in vectors)
    return [method(matrix, render(each, FIRST_PEAK, matrix.shape[1])) for each in particles]


def ours(matrix: np.ndarray, vectors: np.ndarray) -> list[tuple]:
    """Render and compare every particle as a fit does."""
    sensors, length = matrix.shape
    comparison = SlidingComparison(matrix, CANDIDATES_AT_ONCE)
    renderer = ParticleRenderer(sensors, length, FIRST_PEAK, SPACE)
    energy = float(np.sum(matrix**2))
    results = []
    for start in range(0, len(vectors), CANDIDATES_AT_ONCE):
        group = vectors[start : start + CANDIDATES_AT_ONCE]
        gains, lags = compare_vectors(group, renderer, comparison)
        distances = np.sqrt((energy - gains) / (3 * matrix.size))
        results.extend(zip(distances.tolist(), lags.tolist(), strict=True))
    return results


WAYS = {
    "literal formula": functools.partial(one_by_one, literal),
    "plain numpy FFT": functools.partial(one_by_one, plain_fft),
    "ours": ours,
}
SLOW = {"literal formula"}  # too slow for all particles of a round


def cpu_seconds(function: object, *arguments: object) -> tuple[float, object]:
    """Call once; give the CPU time and the result."""
    start = time.process_time()
    result = function(*arguments)
    return time.process_time() - start, result


def measure(matrix: np.ndarray, rounds: int, count: int) -> dict[str, float]:
    """Compare `count` particles in every way; give the median CPU times per particle in s."""
    vectors = SPACE.draw(count, matrix.shape[0], generator(SETTINGS["fit"]["seed"], "benchmark"))
    expected = np.array(ours(matrix, vectors))
    times: dict[str, list[float]] = {name: [] for name in WAYS}
    for round_number in range(rounds + 1):
        for name, way in WAYS.items():
            some = vectors[:4] if name in SLOW else vectors
            seconds, results = cpu_seconds(way, matrix, some)
            # Lags are whole numbers, so within this they are the same.
            np.testing.assert_allclose(
                results, expected[: len(some)], rtol=0, atol=1e-9, err_msg=name
            )
            if round_number:  # the first round warms caches
                times[name].append(seconds / len(some))
    return {name: statistics.median(measured) for name, measured in times.items()}


def main() -> None:
    """Measure and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", type=Path, help="a recording, such as raw/3mm/r07.csv")
    parser.add_argument("--rounds", type=int, default=5, help="rounds to take medians of")
    parser.add_argument("--particles", type=int, default=1000, help="particles in a round")
    arguments = parser.parse_args()
    with arguments.recording.open("rb") as stream:
        values = read_recording(stream, SETTINGS["recording"]["sensors"]).values
    matrix = preprocess(values, **SETTINGS["preprocessing"])
    medians = measure(matrix, arguments.rounds, arguments.particles)

    print(f"{platform.machine()}, Python {platform.python_version()}, numpy {np.__version__}")
    print(f"{arguments.recording}: {matrix.shape[0]} x {matrix.shape[1]}, rendering included\n")
    rows = [
        {"comparison": name, "median per particle": f"{1e6 * median:,.0f} us"}
        | {"ours is faster by": f"{median / medians['ours']:,.1f}"}
        for name, median in medians.items()
    ]
    print(table(rows))
    fit = functools.partial(fit_recording, matrix, values, SETTINGS["fit"])
    fits = [cpu_seconds(fit)[0] for _ in range(arguments.rounds)]
    comparisons = OPTIONS["particles"] + OPTIONS["iterations"]
    print(f"\nA whole fit, {comparisons} comparisons: {statistics.median(fits):.3f} s of CPU.")


if __name__ == "__main__":
    main()
