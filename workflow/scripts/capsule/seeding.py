"""Random generators for the whole project, and the checksum of readings that seeds a fit."""

import hashlib

import numpy as np  # its random numbers are imported late: half of the jobs need none

from capsule.arrays import FloatArray


def generator(seed: int, *names: str) -> "np.random.Generator":
    """Return the random generator of a configured seed and some names.

    Its random numbers depend only on the seed and the names. The order and the number of jobs
    change no result.

    Parameters
    ----------
    seed : int
        The configured seed.
    *names : str
        The use of the generator, such as ``"roc", "template"``.

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

    The checksum identifies a recording, orders it in sums and draws, and seeds its fit. The same
    readings therefore give the same numbers under any file name.

    Parameters
    ----------
    values : (S, K) array of float64
        The readings on an even grid; NaN where a sample is missing.
    """
    return hashlib.sha256(values.tobytes()).hexdigest()


def fit_generator(seed: int, values: FloatArray) -> "np.random.Generator":
    """Return the random generator for the fit to a recording with these readings (S, K)."""
    return generator(seed, "fit", readings_checksum(values))
