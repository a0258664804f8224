"""The one place where random generators are made."""

import hashlib

import numpy as np


def generator(seed: int, *names: str) -> np.random.Generator:
    """Make the random generator that belongs to a configured seed and a name.

    The stream depends on the seed and the names alone, never on the order or the number of
    jobs, so that every recording gives the same result whatever else runs beside it.

    Parameters
    ----------
    seed : int
        The configured seed.
    *names : str
        What the generator is for, such as ``"fit", "3mm/r07"``.

    Returns
    -------
    numpy.random.Generator
        A PCG64 generator.
    """
    text = "\x1f".join([str(int(seed)), *names])
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return np.random.Generator(np.random.PCG64(int.from_bytes(digest, "big")))
