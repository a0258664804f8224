"""Hold the simulated phantom's parameters, and read them from tables with their sources."""

import difflib
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from capsule.errors import CapsuleError
from capsule.phantom.advance import Advance, Folding
from capsule.phantom.contact import Contact, Seat
from capsule.phantom.origami import Origami
from capsule.phantom.quantities import Limits
from capsule.phantom.sensor import Electronics, Sensor
from capsule.phantom.wall import Wall, Wave

Whole = TypeVar("Whole")
SOURCES = ("paper", "data sheet", "calibrated", "assumed", "absent")
# The key of the sentence at the head of a bench's file.
EXPLAINS = "explains"


@dataclass(frozen=True)
class Phantom:
    """All parameters of the simulated bench, by part; ``config/phantom.yaml`` explains each."""

    origami: Origami
    wall: Wall
    wave: Wave
    contact: Contact
    seat: Seat
    advance: Advance
    sensor: Sensor
    electronics: Electronics
    folding: Folding


def parameter_names() -> list[str]:
    """Return every parameter's name as ``part.parameter``."""
    return list(_kinds())


def words_of(name: str) -> tuple[str, ...]:
    """Return the words that a parameter may be; nothing for a number."""
    kind = _kind_of(name)
    return get_args(kind) if get_origin(kind) is Literal else ()


@cache
def _kinds() -> dict[str, Any]:
    """Return the type of every parameter, with its limits, by ``part.parameter``."""
    return {
        f"{part}.{key}": kind
        for part, whole in get_type_hints(Phantom).items()
        for key, kind in get_type_hints(whole, include_extras=True).items()
    }


def _kind_of(name: str) -> Any:  # noqa: ANN401 - a type
    """Return the type of a parameter; raise an error for an unknown name."""
    if name not in _kinds():
        near = nearest(name, _kinds())
        hint = f"did you mean {near}?" if near else "config/phantom.yaml lists all"
        raise CapsuleError(f"the phantom has no parameter {name}; {hint}")
    return _kinds()[name]


def parsed(change: str) -> tuple[str, float | str]:
    """Return name and value of a change ``part.parameter=value``, which `with_values` checks.

    Raises
    ------
    CapsuleError
        If the name is unknown, or the value is no number.
    """
    name, _, text = change.partition("=")
    return name, text if words_of(name) else number_of(change)


def number_of(change: str) -> float:
    """Return the number of a change ``part.parameter=number``."""
    name, _, text = change.partition("=")
    try:
        return float(text)
    except ValueError:
        raise CapsuleError(f"--set {change}: write {name}=NUMBER") from None


def built(kind: type[Whole], values: Mapping[str, Any]) -> Whole:
    """Return a dataclass whose parts are dataclasses, from its values by ``part.parameter``."""
    return kind(
        **{
            part: of(**{item.name: values[f"{part}.{item.name}"] for item in fields(of)})
            for part, of in get_type_hints(kind).items()
        }
    )


def phantom_from_table(table: Mapping[str, Any]) -> Phantom:
    """Return the phantom that a table of parts and parameters describes.

    Parameters
    ----------
    table
        ``{part: {parameter: {"value": number, "unit": str, "source": str, ...}}}``, as in
        ``config/phantom.yaml``.

    Raises
    ------
    CapsuleError
        If a parameter is unknown, missing, not a number, or without value, unit or source.
    """
    if not isinstance(table, Mapping):
        raise CapsuleError("the table of the phantom is empty; it needs parts with parameters")
    values = {name: entry["value"] for name, entry in _entries(table)}
    missing = [name for name in parameter_names() if name not in values]
    if missing:
        raise CapsuleError(f"{missing[0]} is missing; give it a value, a unit and a source")
    return built(Phantom, values)


def bench_values(table: Mapping[str, Any], bench: Any) -> dict[str, float | str]:  # noqa: ANN401
    """Return the values in which a bench differs, by ``part.parameter``.

    Parameters
    ----------
    table
        The phantom's table, as `phantom_from_table` takes it.
    bench
        Content of the bench's file: ``explains``, a sentence on how this bench explains the
        paper's table, and the parts and parameters that differ.

    Raises
    ------
    CapsuleError
        If the sentence is missing, or a parameter is unknown, incomplete or has another unit.
    """
    if not isinstance(bench, Mapping) or not isinstance(bench.get(EXPLAINS), str):
        raise CapsuleError(
            f"the file of a bench begins with '{EXPLAINS}:' and a sentence that explains the "
            "paper's table"
        )
    values = {}
    for name, entry in _entries(bench_parts(bench)):
        part, key = name.split(".")
        usual = table[part][key]["unit"]
        if entry["unit"] != usual:
            raise CapsuleError(f"{name}: the unit is {usual}, not {entry['unit']}")
        values[name] = entry["value"]
    return values


def bench_parts(bench: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parts in a bench's file: all entries except the sentence."""
    return {part: entries for part, entries in bench.items() if part != EXPLAINS}


def with_values(phantom: Phantom, values: Mapping[str, float | str]) -> Phantom:
    """Return the phantom with some parameters changed.

    Raises
    ------
    CapsuleError
        If a name is unknown or a value is not allowed; the message names it.
    """
    for name, value in values.items():
        check_value(name, value)
        part, key = name.split(".")
        changed = replace(getattr(phantom, part), **{key: value})
        phantom = replace(phantom, **{part: changed})
    return phantom


def value_of(phantom: Phantom, name: str) -> float:
    """Return the value of the parameter ``part.parameter``."""
    _kind_of(name)  # an unknown name is an error
    part, key = name.split(".")
    number: float = getattr(getattr(phantom, part), key)
    return number


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known ``part.parameter`` that a name most likely means; None if none is near."""

    def likeness(one: str, other: str) -> float:
        return difflib.SequenceMatcher(None, one, other).ratio()

    # The part alone makes two names no more alike.
    key = name.rpartition(".")[2]
    alike = {each: likeness(key, each.rpartition(".")[2]) for each in known}
    likely = [each for each, ratio in alike.items() if ratio >= 0.7]
    return max(likely, key=lambda each: (alike[each], likeness(name, each)), default=None)


def _entries(table: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield name and entry of each parameter of a table; raise an error for what is none."""
    for part, entries in table.items():
        if not isinstance(entries, Mapping):
            raise CapsuleError(f"{part}: needs parameters, each with a value, a unit and a source")
        for key, entry in entries.items():
            name = f"{part}.{key}"
            if not isinstance(entry, Mapping) or not {"value", "unit", "source"} <= set(entry):
                raise CapsuleError(f"{name}: write it as {{value: ..., unit: ..., source: ...}}")
            check_value(name, entry["value"])
            if entry["source"] not in SOURCES:
                raise CapsuleError(
                    f"{name}: the source {entry['source']!r} is not one of {', '.join(SOURCES)}"
                )
            yield name, entry


def check_value(name: str, value: Any) -> None:  # noqa: ANN401 - whatever a file holds
    """Raise an error if a parameter's value is not allowed; it names what is.

    A number is finite and not negative; some must be greater than 0, and some have a limit.
    """
    kind = _kind_of(name)
    limits = next(iter(getattr(kind, "__metadata__", ())), Limits())
    check_allowed(name, value, words_of(name), limits, whole=get_args(kind)[:1] == (int,))


def check_allowed(
    name: str,
    value: Any,  # noqa: ANN401 - whatever a file holds
    words: Sequence[str],
    limits: Limits,
    *,
    whole: bool = False,
) -> None:
    """Raise an error if a value is none of the allowed words or, without words, of the numbers."""
    if words:
        if value not in words:
            raise CapsuleError(f"{name} is {value}; allowed are {', '.join(words)}")
        return
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise CapsuleError(f"{name}: the value {value!r} is not a number")
    low, high = limits.low, limits.high
    if not low <= value <= high or not math.isfinite(value) or (limits.beyond and value == low):
        allowed = f"{low:g} to {high:g}" if high < math.inf else f"a number from {low:g} on"
        allowed = f"a number greater than {low:g}" if limits.beyond else allowed
        raise CapsuleError(f"{name} is {value:g}; allowed is {allowed}")
    if whole and value != round(value):
        raise CapsuleError(f"{name} is {value:g}; allowed are whole numbers")
