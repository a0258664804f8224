"""Check what programs give to public functions, before the method computes with it.

Each error names the argument, its value and what is allowed. The workflow calls the functions
themselves, and so is not slowed down.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import wraps
from inspect import signature
from numbers import Integral, Real
from typing import TypeVar, cast

import numpy as np

from capsule.arrays import FloatArray
from capsule.errors import CapsuleError
from capsule.method.particle import ParameterSpace, Particle
from capsule.recordings.recording import Recording

_Result = TypeVar("_Result")

# Arguments that may have any shape: they are used value by value.
_ANY_SHAPE = {"envelope", "distances"}
# Whole numbers that may be 0; all others are at least 1.
_FROM_ZERO = {"seed", "iterations"}
_CLASSES = {np.random.Generator, ParameterSpace, Particle, Recording}


class ArgumentError(CapsuleError, ValueError):
    """The error of an argument; a ValueError too, as users of numpy and scikit-learn expect."""


def refuse(name: str, value: object, allowed: str) -> ArgumentError:
    """Return the error of an argument."""
    shape = value.shape if isinstance(value, np.ndarray) else ()
    shown = f"an array of shape {shape}" if shape else repr(value)
    return ArgumentError(f"{name}: {shown} is not allowed; allowed is {allowed}")


def with_missing(value: object) -> object:
    """Return a masked array as an array with NaN under the mask; all else as it is."""
    if isinstance(value, np.ma.MaskedArray):
        return np.where(np.ma.getmaskarray(value), np.nan, value.data)
    return value


def _numbers(name: str, value: object, allowed: str) -> FloatArray:
    """Return an array of finite numbers; NaN where a sample is missing."""
    try:
        # In the workflow's order, so that sums are taken alike.
        numbers = np.asarray(with_missing(value), dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise refuse(name, value, allowed) from None
    for place in np.argwhere(np.isinf(numbers))[:1]:
        where = ", ".join(map(str, place))
        allowed = "a finite number, or NaN where a sample is missing"
        raise refuse(f"{name}[{where}]", float(numbers[tuple(place)]), allowed)
    return numbers


def _sensor_rows(name: str, value: object) -> FloatArray:
    """Return an array (S, K) or (S, L), with one row per sensor.

    More rows than columns are refused: they are samples. No recording can be judged that has fewer
    samples than sensors, since one window of the envelope holds more.
    """
    allowed = "an array of numbers, one row per sensor"
    rows = _numbers(name, value, allowed)
    if rows.ndim != 2 or not rows.size:
        raise refuse(name, rows if rows.ndim else value, allowed)
    if rows.shape[0] > rows.shape[1]:
        remedy = f"transpose it: {name}.T has one row per sensor"
        raise refuse(name, rows, f"one row per sensor; {remedy}")
    return rows


def _accepted(name: str, value: object, kind: object) -> object:
    """Return the value of an argument, whose kind is the type in the function's signature."""
    if kind is FloatArray:
        if name in _ANY_SHAPE:
            return _numbers(name, value, "an array of numbers")
        return _sensor_rows(name, value)
    if kind == Iterable[FloatArray]:
        if not isinstance(value, Iterable):
            raise refuse(name, value, "a sequence of arrays, each with one row per sensor")
        return [_sensor_rows(f"{name}[{place}]", each) for place, each in enumerate(value)]
    if isinstance(kind, type) and kind in _CLASSES and not isinstance(value, kind):
        raise refuse(name, value, f"a {kind.__name__}")
    if isinstance(value, Recording):
        _sensor_rows(f"{name}.values", value.values)
        return replace(value, values=cast(FloatArray, with_missing(value.values)))
    if kind is int:
        least = 0 if name in _FROM_ZERO else 1
        if not isinstance(value, Integral) or isinstance(value, bool) or value < least:
            raise refuse(name, value, f"a whole number of at least {least}")
        return int(value)
    if kind is float:
        if not isinstance(value, Real) or isinstance(value, bool) or not 0 <= float(value) < np.inf:
            raise refuse(name, value, "a number of at least 0")
        return float(value)
    return value


def checked(function: Callable[..., _Result]) -> Callable[..., _Result]:
    """Return a function of the library that checks its arguments first."""
    shape = signature(function)

    @wraps(function)
    def call(*args: object, **named: object) -> _Result:
        bound = shape.bind(*args, **named)
        given = bound.arguments
        for name, value in given.items():
            given[name] = _accepted(name, value, shape.parameters[name].annotation)
        samples = given["values"].shape[1] if {"values", "length"} <= given.keys() else 0
        if samples > given.get("length", samples):
            raise refuse("length", given["length"], f"{samples}, the number of samples, or more")
        try:
            return function(*bound.args, **bound.kwargs)
        except ValueError as error:
            raise ArgumentError(f"{function.__name__}: {error}") from error

    # So that a pickle finds this function, and not the method's.
    call.__module__ = "capsule"
    return call
