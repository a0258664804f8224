"""Convert rows of results to tables of pandas."""

from collections.abc import Iterable, Sequence
from typing import Any

import pandas as pd

from capsule.kinds import Row


def frame(columns: Sequence[str], rows: Iterable[Row]) -> pd.DataFrame:
    """Return rows as a table; unknown values are NaN, as in a table that pandas reads.

    Parameters
    ----------
    columns : sequence of str
        Names of the columns, in order; each row has all of them.
    rows : iterable of mapping

    Returns
    -------
    DataFrame
    """
    cells: dict[str, list[Any]] = {name: [] for name in columns}
    for row in rows:
        for name, values in cells.items():
            values.append(float("nan") if row[name] in (None, "") else row[name])
    return pd.DataFrame(cells, columns=list(columns))
