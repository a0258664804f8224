"""Read the signals of one folder under raw/, for the jobs that work on a whole folder."""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from capsule.arrays import FloatArray
from edges import files


def folder_arguments() -> argparse.ArgumentParser:
    """Return a parser of the arguments that every job of a folder has."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--raw", type=Path, required=True, help="the folder raw")
    parser.add_argument("--folder", required=True, help="a folder of recordings, such as 3mm")
    parser.add_argument("--signals", type=Path, required=True, help="the folder of signals")
    parser.add_argument("--rate-hz", type=float, required=True, help="sampling rate")
    parser.add_argument("--settings", type=json.loads, required=True, help="config section, JSON")
    return parser


def usable_signals(
    raw: Path, folder: str, signals: Path, what: str
) -> Iterator[tuple[str, FloatArray]]:
    """Read the readings of a folder's usable recordings, and print the names of the others.

    Copies of other recordings are read too: only the rule index rejects them, and these jobs do
    not wait for it.

    Parameters
    ----------
    raw, signals : Path
        raw/ and results/signals/.
    folder : str
        Name of the folder under raw/.
    what : str
        A participle for the printed line, such as ``searched``.

    Yields
    ------
    name : str
        Name of the recording.
    values : (S, K) array
        Readings; NaN if a sample is missing.
    """
    for name in files.list_folder(raw, folder):
        signal = signals / f"{name}.npy"
        if not signal.exists():
            print(f"{name}: added while the workflow ran; run the workflow again to include it")
            continue
        values = np.load(signal)
        if np.isnan(values).all():
            print(f"{name}: rejected, not {what}")
            continue
        yield name, values
