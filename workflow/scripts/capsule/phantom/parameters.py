"""Hold the simulated phantom's parameters, and read them from tables with their sources."""

import difflib
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar, get_type_hints

from capsule.errors import CapsuleError
from capsule.geometry.origami import Origami
from capsule.phantom.advance import Advance, Folding
from capsule.phantom.contact import Contact, Seat
from capsule.phantom.sensor import Electronics, Sensor
from capsule.phantom.wall import Wall, Wave

Whole = TypeVar("Whole")
SOURCES = ("paper", "data sheet", "calibrated", "assumed", "absent")
# The key of the sentence at the head of a bench's file.
EXPLAINS = "explains"


@dataclass(frozen=True)
class Phantom:
    """All parameters of the simulated bench, by part."""

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
    parts = get_type_hints(Phantom)
    return [f"{part}.{item.name}" for part, kind in parts.items() for item in fields(kind)]


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


def bench_table(table: Mapping[str, Any], bench: Any) -> dict[str, dict[str, Any]]:  # noqa: ANN401
    """Return the full table of a bench whose file lists only the differences.

    Parameters
    ----------
    table
        The phantom's table, as `phantom_from_table` takes it.
    bench
        Content of the bench's file: ``explains``, a sentence on how this bench explains the
        paper's table, and the parts and parameters that differ.

    Returns
    -------
    dict
        ``{part: {parameter: entry}}``, with the bench's entries in place of the table's.

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
    changed = {part: dict(entries) for part, entries in table.items()}
    for name, entry in _entries(bench_parts(bench)):
        part, key = name.split(".")
        usual = table[part][key]["unit"]
        if entry["unit"] != usual:
            raise CapsuleError(f"{name}: the unit is {usual}, not {entry['unit']}")
        changed[part][key] = entry
    return changed


def bench_parts(bench: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parts in a bench's file: all entries except the sentence."""
    return {part: entries for part, entries in bench.items() if part != EXPLAINS}


def with_values(phantom: Phantom, values: Mapping[str, float]) -> Phantom:
    """Return the phantom with some parameters changed.

    Parameters
    ----------
    values
        New values by ``part.parameter``.

    Raises
    ------
    CapsuleError
        If a name is unknown; the message gives the nearest known name.
    """
    for name, value in values.items():
        _check_known(name)
        part, key = name.split(".")
        changed = replace(getattr(phantom, part), **{key: value})
        phantom = replace(phantom, **{part: changed})
    return phantom


def value_of(phantom: Phantom, name: str) -> float:
    """Return the value of the parameter ``part.parameter``."""
    _check_known(name)
    part, key = name.split(".")
    number: float = getattr(getattr(phantom, part), key)
    return number


def rewritten(text: str, values: Mapping[str, float]) -> str:
    """Return a table's text with new values; comments and order stay.

    Parameters
    ----------
    text
        The YAML text, with parts at the margin and one line per parameter:
        ``key: {value: 1.0, ...}``.
    values
        New values by ``part.parameter``.

    Raises
    ------
    CapsuleError
        If a parameter has no such line.
    """
    pending, lines, part = dict(values), [], ""
    for line in text.splitlines(keepends=True):
        if heading := re.match(r"(\w+):", line):
            part = heading[1]
        entry = re.match(r"(  (\w+): \{value: )[^,]+(,.*)", line, re.DOTALL)
        if entry and f"{part}.{entry[2]}" in pending:
            line = f"{entry[1]}{pending.pop(f'{part}.{entry[2]}'):.4g}{entry[3]}"
        lines.append(line)
    if pending:
        raise CapsuleError(f"the table has no line '{next(iter(pending))}: {{value: ...'")
    return "".join(lines)


def _check_known(name: str) -> None:
    known = parameter_names()
    if name not in known:
        nearest = difflib.get_close_matches(name, known, n=1, cutoff=0.4)
        hint = f"did you mean {nearest[0]}?" if nearest else f"allowed are {', '.join(known)}"
        raise CapsuleError(f"the phantom has no parameter {name}; {hint}")


def _entries(table: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield name and entry of each parameter of a table; raise an error for what is none."""
    for part, entries in table.items():
        if not isinstance(entries, Mapping):
            raise CapsuleError(f"{part}: needs parameters, each with a value, a unit and a source")
        for key, entry in entries.items():
            name = f"{part}.{key}"
            _check_known(name)
            _check_entry(name, entry)
            yield name, entry


def _check_entry(name: str, entry: Any) -> None:  # noqa: ANN401 - whatever the file holds
    if not isinstance(entry, Mapping) or not {"value", "unit", "source"} <= set(entry):
        raise CapsuleError(f"{name}: write it as {{value: ..., unit: ..., source: ...}}")
    value = entry["value"]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise CapsuleError(f"{name}: the value {value!r} is not a number")
    if entry["source"] not in SOURCES:
        raise CapsuleError(
            f"{name}: the source {entry['source']!r} is not one of {', '.join(SOURCES)}"
        )
