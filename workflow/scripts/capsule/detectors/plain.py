"""What detectors have learned, as JSON holds it."""

from collections.abc import Mapping

import numpy as np


def plain(value: object) -> object:
    """Return a value as JSON holds it: NaN becomes null, arrays become lists."""
    if isinstance(value, Mapping):
        return {key: plain(part) for key, part in value.items()}
    if isinstance(value, np.ndarray | tuple | list):
        return [plain(part) for part in value]
    if isinstance(value, float | np.floating):
        return None if np.isnan(value) else float(value)
    return value
