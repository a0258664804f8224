"""Stored results of recordings for the page, without files."""

from collections.abc import Iterable

import numpy as np

from capsule.page.packing import deflated, pack, to_json
from capsule.store.results import BATCH_COLUMNS, divide


class Described(dict):
    """What `capsule.page.plot_data` stores of a recording: a bump on one sensor after the other."""

    def __missing__(self, name):
        centre_s = [5.0, 15.0, 25.0, 35.0]
        depth = 1 + np.exp(-(((np.arange(40) - np.array(centre_s)[:, np.newaxis]) / 3) ** 2))
        passed_s = [each + 1.0 for each in centre_s]
        beats = {"first_s": 1.0, "step_s": 1.0, "passed_s": passed_s, **pack(depth)}
        drawn = deflated(to_json({"facts": {"File": f"raw/{name}.csv"}, "beats": beats}))
        return {"drawn": drawn, "quality": f"{name}: gaps"}


def rows_of(names: Iterable[str], size: int = 1) -> dict[str, dict[str, str]]:
    """Return the batches of recordings as the table of recordings names them."""
    division = divide(names, size)
    cells: dict[str, dict[str, str]] = {}
    for column, divided in zip(BATCH_COLUMNS, (division.batches, division.described), strict=True):
        for batch, members in divided.items():
            for name in members:
                cells.setdefault(name, {})[column] = batch
    return cells
