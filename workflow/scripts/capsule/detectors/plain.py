"""Conversion of a detector's model to values that JSON can store."""

from collections.abc import Mapping

import numpy as np


def plain(value: object) -> object:
    """Return a value for JSON: NaN and infinity become None (null), arrays become lists."""
    if isinstance(value, Mapping):
        return {key: plain(part) for key, part in value.items()}
    if isinstance(value, np.ndarray | tuple | list):
        return [plain(part) for part in value]
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value
