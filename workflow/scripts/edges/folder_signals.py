"""The signals of one folder under raw/, as the jobs of a folder read them."""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from capsule.arrays import FloatArray
from edges import files


def folder_arguments() -> argparse.ArgumentParser:
    """Return a parser of what every job of a folder takes."""
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
    """Read the readings of a folder's usable recordings, and print which are left aside.

    Copies of other recordings are read too: only the index, which nobody waits for here, rejects
    them.

    Parameters
    ----------
    raw, signals : Path
        raw/ and results/signals/.
    folder : str
        The folder below raw/.
    what : str
        What is done with them, such as ``searched``.

    Yields
    ------
    name : str
        The recording.
    values : (S, K) array
        Its readings; NaN where a sample is missing.
    """
    for name in files.list_archive(raw).by_folder().get(folder, []):
        signal = signals / f"{name}.npy"
        if not signal.exists():
            print(f"{name}: added while the workflow ran; run the workflow again to include it")
            continue
        values = np.load(signal)
        if np.isnan(values).all():
            print(f"{name}: rejected, not {what}")
            continue
        yield name, values
