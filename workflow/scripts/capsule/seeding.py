"""The one place where random generators are made, and the checksum that those of a fit go by."""

import hashlib

import numpy as np

from capsule.arrays import FloatArray


def generator(seed: int, *names: str) -> np.random.Generator:
    """Make the random generator that belongs to a configured seed and a name.

    The stream depends on the seed and the names alone, never on the order or the number of
    jobs, so that everything gives the same result whatever else runs beside it.

    Parameters
    ----------
    seed : int
        The configured seed.
    *names : str
        What the generator is for, such as ``"roc", "template"``.

    Returns
    -------
    numpy.random.Generator
        A PCG64 generator.
    """
    text = "\x1f".join([str(int(seed)), *names])
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return np.random.Generator(np.random.PCG64(int.from_bytes(digest, "big")))


def readings_checksum(values: FloatArray) -> str:
    """Return the SHA-256 of a recording's readings.

    By this, not by its name, a recording is told from another, takes its turn in sums and draws,
    and seeds its fit: the same readings give the same numbers whatever they are called.

    Parameters
    ----------
    values : (S, K) array of float64
        The readings on an even grid; NaN where a sample is missing.
    """
    return hashlib.sha256(values.tobytes()).hexdigest()


def fit_generator(seed: int, values: FloatArray) -> np.random.Generator:
    """Make the random generator of the fit to a recording, from its readings (S, K)."""
    return generator(seed, "fit", readings_checksum(values))
