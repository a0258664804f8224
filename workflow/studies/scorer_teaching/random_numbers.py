"""Make random courses in time for the simulated benches, from separate random streams."""

import numpy as np
from scipy.signal import lfilter

from capsule.seeding import generator
from scorer_teaching.bench_family import Wander


class Streams:
    """Random streams, one for each subject, so that the subjects do not affect one another.

    Parameters
    ----------
    seed : int
        Seed of the training.
    *names : str
        Names of the streams' purpose, such as the name of a bench.
    """

    def __init__(self, seed: int, *names: str) -> None:
        self._seed, self._names = seed, names

    def of(self, subject: str) -> np.random.Generator:
        """Return the stream of a subject, from its beginning."""
        return generator(self._seed, *self._names, subject)


def smooth_noise(
    numbers: np.random.Generator, shape: tuple[int, ...], count: int, time: float, kind: int
) -> np.ndarray:
    """Return random courses of unit variance.

    Parameters
    ----------
    numbers : numpy.random.Generator
        Random numbers.
    shape : tuple of int
        Numbers of courses along each axis.
    count : int
        Number of samples of each course.
    time : float
        Time within which a course changes, in samples.
    kind : int
        0: smooth (Gaussian spectrum), 1: rough (Ornstein-Uhlenbeck), 2: one over the frequency.

    Returns
    -------
    (*shape, count) array
    """
    # The courses are twice as long as needed, since the Fourier transform joins their ends.
    length = 2 * count
    frequency = np.fft.rfftfreq(length)
    if kind == 0:
        gain = np.exp(-0.5 * (np.pi * frequency * time) ** 2)
    elif kind == 1:
        gain = 1 / np.sqrt(1 + (2 * np.pi * frequency * time) ** 2)
    else:
        gain = 1 / np.sqrt(np.maximum(frequency, 1 / count))
        gain *= np.exp(-0.5 * (frequency * 20) ** 2)
        gain[0] = 0
    white = np.fft.rfft(numbers.standard_normal((*shape, length), dtype=np.float32), axis=-1)
    values = np.fft.irfft(white * gain, length, axis=-1)[..., :count]
    power = (gain[0] ** 2 + 2 * (gain[1:-1] ** 2).sum() + gain[-1] ** 2) / length
    return values / np.sqrt(power)


def wandering(
    numbers: np.random.Generator, wander: Wander, shape: tuple[int, ...], count: int
) -> np.ndarray:
    """Return random courses of a bench's wander, (*shape, count); each run has its own size."""
    runs = numbers.standard_normal((shape[0],) + (1,) * len(shape))
    course = smooth_noise(numbers, shape, count, wander.time, wander.kind)
    return wander.size * np.exp(wander.run_spread * runs) * course


def jumps(
    numbers: np.random.Generator, shape: tuple[int, ...], count: int, rate: float, size: float
) -> np.ndarray:
    """Return random courses (*shape, count) with `rate` sudden jumps in each on average."""
    happens = numbers.random((*shape, count), dtype=np.float32) < rate / count
    return np.cumsum(happens * numbers.normal(0, size, (*shape, count)), axis=-1)


def followed(values: np.ndarray, time: float) -> np.ndarray:
    """Return courses (..., K) after a first-order lag with a time constant in samples."""
    decay = np.exp(-1 / time)
    begin = values[..., :1]
    return begin + lfilter([1 - decay], [1, -decay], values - begin, axis=-1)
