"""Check what programs give to public functions, before the method computes with it.

Each error names the argument, its value and what is allowed. The workflow calls the functions
themselves, and so is not slowed down.
"""

import inspect
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from numbers import Integral, Real
from typing import Any

import numpy as np

from capsule.arrays import FloatArray
from capsule.errors import CapsuleError
from capsule.recording import Recording

_Check = Callable[[str, Any], Any]


class ArgumentError(CapsuleError, ValueError):
    """The error of an argument; a ValueError too, as users of numpy and scikit-learn expect."""


def refuse(name: str, value: object, allowed: str) -> ArgumentError:
    """Return the error of an argument."""
    shape = np.shape(value) if isinstance(value, np.ndarray) else ()
    shown = f"an array of shape {shape}" if shape else repr(value)
    return ArgumentError(f"{name}: {shown} is not allowed; allowed is {allowed}")


def sensor_rows(name: str, value: object) -> FloatArray:
    """Return an array (S, K) or (S, L), with one row per sensor.

    More rows than columns are refused: they are samples. No recording can be judged that has fewer
    samples than sensors, since one window of the envelope holds more.
    """
    try:
        # In the workflow's order, so that sums are taken alike.
        rows = np.asarray(value, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise refuse(name, value, "an array of numbers, one row per sensor") from None
    if rows.ndim != 2 or not rows.size:
        shown = rows if rows.ndim else value
        raise refuse(name, shown, "an array of numbers, one row per sensor")
    if rows.shape[0] > rows.shape[1]:
        raise refuse(
            name, rows, f"one row per sensor; transpose it: {name}.T has one row per sensor"
        )
    return rows


def _each_sensor_rows(name: str, value: Iterable[object]) -> list[FloatArray]:
    return [sensor_rows(f"{name}[{place}]", each) for place, each in enumerate(value)]


def _recording(name: str, value: Recording) -> Recording:
    sensor_rows(f"{name}.values", value.values)
    return value


def _at_least(least: int) -> _Check:
    def check(name: str, value: object) -> int:
        if not isinstance(value, Integral) or isinstance(value, bool) or value < least:
            raise refuse(name, value, f"a whole number of at least {least}")
        return int(value)

    return check


def _threshold(name: str, value: object) -> float:
    if not isinstance(value, Real) or isinstance(value, bool) or not 0 <= float(value) < np.inf:
        raise refuse(name, value, "a number of at least 0")
    return float(value)


CHECKS: Mapping[str, Mapping[str, _Check]] = {
    "normalize": {"values": sensor_rows},
    "rms_envelope": {"normalized": sensor_rows, "window": _at_least(1)},
    # It treats each value alone, so rows may be anything.
    "rectify": {"threshold": _threshold},
    "preprocess": {
        "values": sensor_rows,
        "window": _at_least(1),
        "threshold": _threshold,
        "length": _at_least(1),
    },
    "render": {"length": _at_least(1)},
    "fit_generator": {"seed": _at_least(0), "values": sensor_rows},
    "fit_particle": {
        "matrix": sensor_rows,
        "particles": _at_least(1),
        "iterations": _at_least(0),
        "first_peak": _at_least(1),
    },
    "fit_recording": {"matrix": sensor_rows, "values": sensor_rows},
    "build_templates": {
        "sensors": _at_least(1),
        "first_peak": _at_least(1),
        "length": _at_least(1),
    },
    "template_distances": {"matrix": sensor_rows, "templates": _each_sensor_rows},
    "read_recording": {"sensors": _at_least(1), "max_bytes": _at_least(1)},
    "format_recording": {"recording": _recording},
}


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a public function that checks its arguments first."""
    signature, checks = inspect.signature(function), CHECKS[function.__name__]

    @wraps(function)
    def call(*args: object, **named: object) -> object:
        bound = signature.bind(*args, **named)
        given = bound.arguments
        for name, check in checks.items():
            if name in given:
                given[name] = check(name, given[name])
        if "length" in given and "values" in given and given["values"].shape[1] > given["length"]:
            samples = given["values"].shape[1]
            raise refuse("length", given["length"], f"{samples}, the number of samples, or more")
        try:
            return function(*bound.args, **bound.kwargs)
        except ValueError as error:
            raise ArgumentError(f"{function.__name__}: {error}") from error

    # So that a pickle finds this function, and not the method's.
    call.__module__ = "capsule"
    return call
