"""Split a table into runs, by a column that names the runs or by gaps in time."""

from collections.abc import Sequence

import numpy as np

from capsule.errors import CapsuleError

MOST_RUNS = 1000


def runs_by_value(values: Sequence[str]) -> list[tuple[str, slice]]:
    """Return the runs of a table, split where a column's value changes.

    Parameters
    ----------
    values : sequence of K str
        The column.

    Returns
    -------
    list of (str, slice)
        Value and rows of each run.

    Raises
    ------
    CapsuleError
        If there are more than `MOST_RUNS` runs.
    """
    array = np.array(values, dtype=object)
    starts = [0, *(np.flatnonzero(array[1:] != array[:-1]) + 1).tolist()]
    _check_number(len(starts), "run_column")
    ends = [*starts[1:], array.size]
    return [(str(array[a]), slice(a, b)) for a, b in zip(starts, ends, strict=True)]


def runs_by_gap(time_s: np.ndarray, run_gap_s: float) -> list[slice]:
    """Return the rows of each run, split at gaps in time and where time runs backwards.

    Parameters
    ----------
    time_s : (K,) array
        Time of each sample in seconds.
    run_gap_s : float
        Longest gap within a run, in s.
    """
    steps = np.diff(time_s)
    starts = [0, *(np.flatnonzero((steps > run_gap_s) | (steps < 0)) + 1).tolist()]
    _check_number(len(starts), "run_gap_s")
    return [slice(a, b) for a, b in zip(starts, [*starts[1:], time_s.size], strict=True)]


def _check_number(runs: int, key: str) -> None:
    if runs > MOST_RUNS:
        raise CapsuleError(
            f"{key} splits the table into {runs} runs, more than {MOST_RUNS}; choose another value"
        )
