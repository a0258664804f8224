"""Stored results of recordings for the page, without files."""

from collections.abc import Iterable

import numpy as np

from capsule.page.packing import deflated, to_json
from capsule.page.sketches import Felt
from capsule.store.batches import divide
from capsule.store.results import BATCH_COLUMNS


class Named(dict):
    """A mapping that makes the value of a missing name from the name."""

    def __init__(self, make):
        self._make = make

    def __missing__(self, name):
        return self._make(name)


class StoredResults:
    """Results for `capsule.page.evidence`."""

    def __init__(self, matrix=None):
        self._matrix = np.zeros((4, 1000)) if matrix is None else matrix
        self.described = Named(
            lambda name: {
                "drawn": deflated(to_json({"recording": name, "peaks": []})),
                "quality": f"{name}: no gap, no loose sensor",
            }
        )

    def matrix(self, name):
        """Return the same matrix for every recording."""
        return self._matrix

    def felt(self, name):
        """Return one bump on one sensor after the other."""
        time_s = np.arange(40.0)
        rows = 1 + np.exp(-(((time_s - np.array([[5.0], [15], [25], [35]])) / 3) ** 2))
        return Felt(time_s, rows, True, [5.0, 15.0, 25.0, 35.0])

    def fit(self, name):
        """Return no fit."""


def rows_of(names: Iterable[str], size: int = 1) -> dict[str, dict[str, str]]:
    """Return the batches of recordings as the table of recordings names them."""
    division = divide(names, size)
    cells: dict[str, dict[str, str]] = {}
    for column, divided in zip(BATCH_COLUMNS, (division.batches, division.described), strict=True):
        for batch, members in divided.items():
            for name in members:
                cells.setdefault(name, {})[column] = batch
    return cells
