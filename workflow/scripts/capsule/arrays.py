"""Names of the kinds of arrays. Shapes stand in the docstrings, for a type cannot tell them all."""

from typing import Any, TypeAlias

import numpy as np

#: Readings, times, voltages, forces, sizes: 64-bit floating-point numbers of any shape.
FloatArray: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.float64]]

#: The same in either precision, 64 bits or 32: what is as good in half the memory.
RealArray: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.floating[Any]]]

#: Positions in another array, counts: integers of any width and shape.
IntArray: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.integer[Any]]]

#: Readings as they were recorded: volts, or an ADC's whole counts.
NumberArray: TypeAlias = FloatArray | IntArray

#: Phasors: the length and direction of a beat, of any shape.
ComplexArray: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.complex128]]

#: Choices among the elements of another array, of any shape.
BoolArray: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.bool_]]

#: Words, such as the state at each moment, of any shape.
TextArray: TypeAlias = np.ndarray[tuple[Any, ...], np.dtype[np.str_]]
