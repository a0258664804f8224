"""The paper's formulas, written element by element with the paper's indices from 1.

Tests compare the library with them. They share no code with it.
"""

import math

import numpy as np


def normalization(readings: list[float]) -> list[float]:
    """Return eq. normalization for one sensor, with the sample standard deviation."""
    mean = math.fsum(readings) / len(readings)
    deviation = math.sqrt(math.fsum((v - mean) ** 2 for v in readings) / (len(readings) - 1))
    return [(v - mean) / deviation for v in readings]


def rms_envelope(normalized: list[float], window: int) -> list[float]:
    """Return eq. RMS_envelope for one sensor; W'(k) is the number of terms in the sum."""
    count = len(normalized)
    envelope = []
    for k in range(1, count + 1):
        terms = [
            normalized[j - 1] ** 2
            for j in range(max(1, k - window // 2), min(count, k + window // 2) + 1)
        ]
        envelope.append(math.sqrt(math.fsum(terms) / len(terms)))
    return envelope


def preprocess(values: np.ndarray, window: int, threshold: float, length: int) -> np.ndarray:
    """Return the result of eq. normalization to eq. extended."""
    sensors, samples = values.shape
    matrix = np.zeros((sensors, length))
    for i in range(1, sensors + 1):
        envelope = rms_envelope(normalization(list(values[i - 1])), window)
        for k in range(1, samples + 1):
            matrix[i - 1, k - 1] = max(envelope[k - 1] - threshold, 0.0)
    return matrix


def render(
    amplitude: list, vertical: list, spacing: list, horizontal: list, first_peak: float, length: int
) -> np.ndarray:
    """Return the result of eq. generateP to eq. sigma; `spacing` holds Delta mu_s for s = 2..S."""
    sensors = len(amplitude)
    mean = [first_peak]
    for s in range(2, sensors + 1):
        mean.append(mean[s - 2] + spacing[s - 2])
    particle = np.zeros((sensors, length))
    for i in range(1, sensors + 1):
        for j in range(1, length + 1):
            surfaces = []
            for s in range(1, sensors + 1):
                offset = np.array([i - s, j - mean[s - 1]])
                covariance = np.diag([vertical[s - 1] ** 2, horizontal[s - 1] ** 2])
                exponent = -0.5 * offset @ np.linalg.inv(covariance) @ offset
                surfaces.append(amplitude[s - 1] * math.exp(exponent))
            particle[i - 1, j - 1] = max(surfaces)
    return particle


def sliding_rmse(matrix: np.ndarray, particle: np.ndarray) -> list[float]:
    """Return RMSE(tau) for tau = 1..2L, eq. F' to eq. RMSE, with the shift matrix R of 3L x 3L."""
    sensors, length = matrix.shape
    zeros = np.zeros((sensors, length))
    extended_matrix = np.hstack([zeros, matrix, zeros])
    shifted = np.hstack([particle, zeros, zeros])
    shift_matrix = np.eye(3 * length, k=1)
    values = []
    for _tau in range(1, 2 * length + 1):
        difference = extended_matrix - shifted
        values.append(np.linalg.norm(difference, "fro") / math.sqrt(sensors * 3 * length))
        shifted = shifted @ shift_matrix
    return values


def smallest_rmse(matrix: np.ndarray, particle: np.ndarray) -> float:
    """Return eq. RMSEmin."""
    return min(sliding_rmse(matrix, particle))
