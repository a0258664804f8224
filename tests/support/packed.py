"""Unpack the numbers and texts of `capsule.page.packing`, as the page does."""

import base64
import zlib

import numpy as np


def inflated(packed):
    """Return the text that was deflated."""
    return zlib.decompress(base64.b64decode(packed)).decode("utf-8")


def unpack(packed):
    """Return the unpacked numbers."""
    numbers = np.frombuffer(base64.b64decode(packed["data"]), f"<u{packed['bits'] // 8}")
    values = packed["low"] + packed["scale"] * numbers.astype(float)
    values[numbers == 2 ** packed["bits"] - 1] = np.nan
    return values.reshape(packed["rows"], -1)
