"""Read the signals of some recordings, for the jobs that search and score them."""

import argparse
import json
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from capsule.arrays import FloatArray


def search_arguments() -> argparse.ArgumentParser:
    """Return a parser of the arguments that every such job has."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("recordings", nargs="+", help="names of recordings, such as 3mm/r07")
    parser.add_argument("--signals", type=Path, required=True, help="the folder of signals")
    parser.add_argument("--rate-hz", type=float, required=True, help="sampling rate")
    parser.add_argument("--settings", type=json.loads, required=True, help="config section, JSON")
    return parser


def usable_signals(
    signals: Path, recordings: Iterable[str], what: str
) -> Iterator[tuple[str, FloatArray]]:
    """Read the readings of the usable recordings, and print the names of the others.

    Copies of other recordings are read too: only the rule index rejects them, and these jobs do
    not wait for it.

    Parameters
    ----------
    signals : Path
        results/signals/.
    recordings : iterable of str
        Names of the recordings.
    what : str
        A participle for the printed line, such as ``searched``.

    Yields
    ------
    name : str
        Name of the recording.
    values : (S, K) array
        Readings; NaN if a sample is missing.
    """
    for name in recordings:
        values = np.load(signals / f"{name}.npy")
        if np.isnan(values).all():
            print(f"{name}: rejected, not {what}")
            continue
        yield name, values
