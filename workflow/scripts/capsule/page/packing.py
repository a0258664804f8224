"""Pack arrays into short text: integers of one or two bytes in base64, or rounded numbers.

The page's scripts restore the values with a scale. Readings that are ADC counts stay exact. What
holds such arrays becomes JSON, and is deflated where it is stored.
"""

import base64
import json
import zlib
from collections.abc import Iterable

import numpy as np

from capsule.arrays import FloatArray, RealArray
from capsule.kinds import Cells, Row


def pack(values: RealArray, bits: int = 16) -> Cells:
    """Return an array as integers of 8 or 16 bits in base64.

    Parameters
    ----------
    values : (S, N) array
        NaN where a sample is missing.
    bits : {8, 16}
        Bits per value.

    Returns
    -------
    dict
        ``bits``, ``rows``, ``low``, ``scale`` and ``data``: value = low + scale * number, row after
        row, little-endian. The largest number marks a missing sample. Integer values whose range
        fits are kept exactly.
    """
    missing = 2**bits - 1
    known = values[~np.isnan(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    whole = bool(np.all(known == np.rint(known))) and high - low < missing
    scale = 1.0 if whole or high == low else (high - low) / (missing - 1)
    numbers = np.where(np.isnan(values), missing, np.rint((values - low) / scale))
    data = numbers.astype(f"<u{bits // 8}").tobytes()
    return {
        "bits": bits,
        "rows": values.shape[0],
        "low": low,
        "scale": scale,
        "data": base64.b64encode(data).decode("ascii"),
    }


def unpack(packed: Row) -> FloatArray:
    """Return the (S, N) array that `pack` packed; NaN where a sample is missing."""
    numbers = np.frombuffer(base64.b64decode(packed["data"]), f"<u{packed['bits'] // 8}")
    values = packed["low"] + packed["scale"] * numbers.astype(np.float64)
    values[numbers == 2 ** packed["bits"] - 1] = np.nan
    rows: FloatArray = values.reshape(packed["rows"], -1)
    return rows


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
