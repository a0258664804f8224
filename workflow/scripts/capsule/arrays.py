"""Type names for arrays, whose shapes docstrings state; and plain values for JSON."""

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

#: Readings, times, voltages, forces, sizes: 64-bit floating-point numbers of any shape.
FloatArray: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.float64]]

#: Floating-point numbers of 64 or 32 bits, for arrays where 32 bits are enough and save memory.
RealArray: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.floating[Any]]]

#: Positions in another array, counts: integers of any width and shape.
IntArray: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.integer[Any]]]

#: Readings as they were recorded: volts, or an ADC's whole counts.
NumberArray: TypeAlias = FloatArray | IntArray

#: Phasors: amplitude and phase of a beat as one complex number, of any shape.
ComplexArray: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.complex128]]

#: Truth values of any shape, such as a mask for another array.
BoolArray: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.bool_]]

#: Rows of a table in one piece, so that some are chosen fast: a structured array with named fields.
RecordArray: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.void]]

#: Words, such as the state at each moment, of any shape.
TextArray: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.str_]]


def plain(value: object) -> object:
    """Return a value for JSON: NaN and infinity become None (null), arrays become lists."""
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {key: plain(part) for key, part in value.items()}
    if isinstance(value, tuple | list):
        return [plain(part) for part in value]
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value
