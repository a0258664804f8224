"""The paper's formulas, written element by element with the paper's indices from 1.

Tests compare the library with them. They share no code with it.
"""

import math

import numpy as np


def preprocess(values: np.ndarray, window: int, threshold: float, length: int) -> np.ndarray:
    """Return the result of eq. normalization to eq. extended, with the sample deviation."""
    sensors, samples = values.shape
    matrix = np.zeros((sensors, length))
    for i in range(1, sensors + 1):
        mean = math.fsum(values[i - 1]) / samples
        deviation = math.sqrt(math.fsum((v - mean) ** 2 for v in values[i - 1]) / (samples - 1))
        for k in range(1, samples + 1):
            # W'(k) is the number of terms in the sum.
            around = range(max(1, k - window // 2), min(samples, k + window // 2) + 1)
            squares = [((values[i - 1, j - 1] - mean) / deviation) ** 2 for j in around]
            envelope = math.sqrt(math.fsum(squares) / len(squares))
            matrix[i - 1, k - 1] = max(envelope - threshold, 0.0)
    return matrix


def render(
    amplitude: list, vertical: list, spacing: list, horizontal: list, first_peak: float, length: int
) -> np.ndarray:
    """Return the result of eq. generateP to eq. sigma; `spacing` holds Delta mu_s for s = 2..S."""
    sensors, particle = len(amplitude), np.zeros((len(amplitude), length))
    for i in range(1, sensors + 1):
        for j in range(1, length + 1):
            surfaces = []
            for s in range(1, sensors + 1):
                offset = np.array([i - s, j - first_peak - sum(spacing[: s - 1])])
                covariance = np.diag([vertical[s - 1] ** 2, horizontal[s - 1] ** 2])
                exponent = -0.5 * offset @ np.linalg.inv(covariance) @ offset
                surfaces.append(amplitude[s - 1] * math.exp(exponent))
            particle[i - 1, j - 1] = max(surfaces)
    return particle


def sliding_rmse(matrix: np.ndarray, particle: np.ndarray) -> list[float]:
    """Return RMSE(tau) for tau = 1..2L, eq. F' to eq. RMSE, with the shift matrix R of 3L x 3L."""
    sensors, length = matrix.shape
    zeros = np.zeros((sensors, length))
    shifted, values = np.hstack([particle, zeros, zeros]), []
    for _tau in range(1, 2 * length + 1):
        difference = np.hstack([zeros, matrix, zeros]) - shifted
        values.append(np.linalg.norm(difference, "fro") / math.sqrt(sensors * 3 * length))
        shifted = shifted @ np.eye(3 * length, k=1)
    return values


def smallest_rmse(matrix: np.ndarray, particle: np.ndarray) -> float:
    """Return eq. RMSEmin."""
    return min(sliding_rmse(matrix, particle))
