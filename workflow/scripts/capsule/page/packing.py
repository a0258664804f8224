"""Pack arrays into short text: differences of whole numbers, or rounded numbers.

The page's scripts restore the values with a scale. Readings that are ADC counts stay exact. What
holds such arrays becomes JSON, and is deflated where it is stored: small differences take less room
than values.
"""

import base64
import json
import zlib
from collections.abc import Iterable

import numpy as np

from capsule.arrays import FloatArray, RealArray
from capsule.kinds import Cells, Row


def pack(values: RealArray, bits: int = 16) -> Cells:
    """Return an (S, N) array as the differences of whole numbers of 8 or 16 bits.

    value = low + scale * sum of the differences up to it; None where a sample is missing. Integer
    values whose range fits are kept exactly.
    """
    most = 2**bits - 2
    known = values[~np.isnan(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    whole = bool(np.all(known == np.rint(known))) and high - low <= most
    scale = 1.0 if whole or high == low else (high - low) / most
    return {
        "low": low,
        "scale": scale,
        "rows": [_differences(row) for row in (values - low) / scale],
    }


def _differences(numbers: RealArray) -> list[int | None]:
    """Return the first known number, rounded, then the difference of each from the one before."""
    known = ~np.isnan(numbers)
    differences = iter(np.diff(np.rint(numbers[known]), prepend=0.0).astype(int).tolist())
    return [next(differences) if each else None for each in known.tolist()]


def unpack(packed: Row) -> FloatArray:
    """Return the (S, N) array that `pack` packed; NaN where a sample is missing."""
    differences = np.array(packed["rows"], dtype=np.float64)
    numbers = np.nancumsum(differences, axis=1)
    values: FloatArray = packed["low"] + packed["scale"] * numbers
    values[np.isnan(differences)] = np.nan
    return values


def rounded(values: Iterable[float], digits: int = 5) -> list[float]:
    """Return numbers rounded to a number of significant digits."""
    return [float(f"{value:.{digits}g}") for value in values]


def to_json(content: object) -> str:
    """Return JSON in which no tag can begin, so that it is safe inside a script element."""
    text = json.dumps(content, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def deflated(text: str) -> str:
    """Return a text compressed with zlib, in the letters and digits of base64."""
    return base64.b64encode(zlib.compress(text.encode("utf-8"), 6)).decode("ascii")


def inflated(text: str) -> Row:
    """Return the content of JSON that `deflated` compressed."""
    content: Row = json.loads(zlib.decompress(base64.b64decode(text)))
    return content
