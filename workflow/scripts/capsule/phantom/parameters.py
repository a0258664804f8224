"""Hold the simulated phantom's parameters, and read them from tables with their sources."""

import difflib
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar, get_args, get_type_hints

from capsule.errors import CapsuleError
from capsule.phantom.advance import Advance, Folding
from capsule.phantom.contact import Contact, Seat
from capsule.phantom.origami import Origami
from capsule.phantom.sensor import Electronics, Sensor
from capsule.phantom.wall import Wall, Wave

Whole = TypeVar("Whole")
SOURCES = ("paper", "data sheet", "calibrated", "assumed", "absent")
# Limits of numbers, for which 0 and more is allowed otherwise.
_RANGES = {
    "wall.poisson_ratio": (0.0, 0.5),
    "wave.skew": (-0.95, 0.95),
    "advance.snag": (-math.inf, math.inf),
    "advance.longest_samples": (2.0, math.inf),
    "contact.stray_mm": (-math.inf, math.inf),
    "sensor.gauge_per_mm": (-math.inf, math.inf),
    "electronics.adc_bits": (1.0, 32.0),
    "folding.speed_mm_s": (-math.inf, math.inf),
}
# Shares of a whole, at most 1, besides probabilities and fractions.
_SHARES = {"sensor.hysteresis", "sensor.crosstalk", "folding.signal_left", "folding.height_redrawn"}
_WHOLE = {"electronics.adc_bits", "advance.longest_samples"}
# A model divides by these.
_POSITIVE = {
    *(f"wall.{key}" for key in ("wavelength_mm", "speed_mm_s", "modulus_kpa")),
    *("wall.lumen_mm", "wall.unevenness_length_mm"),
    *(f"contact.{key}" for key in ("fold_limit_mm", "bearing_height_mm", "wander_time_s")),
    *("seat.strength_time_s", "advance.speed_mm_s", "advance.grip_fraction"),
    *(f"sensor.{key}" for key in ("resistance_ohm", "saturation_mm", "settling_s", "jump_s")),
    *(f"electronics.{key}" for key in ("series_ohm", "vref_v", "rate_hz")),
    *("folding.fold_s", "folding.drift_return_s"),
}
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
    parts = get_type_hints(Phantom)
    return [f"{part}.{item.name}" for part, kind in parts.items() for item in fields(kind)]


def words_of(name: str) -> tuple[str, ...]:
    """Return the words that a parameter may be; nothing for a number."""
    part, key = name.split(".")
    words: tuple[str, ...] = get_args(get_type_hints(get_type_hints(Phantom)[part])[key])
    return words


def parsed(change: str) -> tuple[str, float | str]:
    """Return name and value of a change ``part.parameter=value``, which `with_values` checks.

    Raises
    ------
    CapsuleError
        If the name is unknown, or the value is no number.
    """
    name, _, text = change.partition("=")
    check_known(name)
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


def with_values(phantom: Phantom, values: Mapping[str, float | str]) -> Phantom:
    """Return the phantom with some parameters changed.

    Raises
    ------
    CapsuleError
        If a name is unknown or a value is not allowed; the message names it.
    """
    for name, value in values.items():
        check_known(name)
        part, key = name.split(".")
        check_value(name, value)
        changed = replace(getattr(phantom, part), **{key: value})
        phantom = replace(phantom, **{part: changed})
    return phantom


def value_of(phantom: Phantom, name: str) -> float:
    """Return the value of the parameter ``part.parameter``."""
    check_known(name)
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


def check_known(name: str) -> None:
    """Raise an error for an unknown name."""
    known = parameter_names()
    if name not in known:
        near = nearest(name, known)
        hint = f"did you mean {near}?" if near else "config/phantom.yaml lists all"
        raise CapsuleError(f"the phantom has no parameter {name}; {hint}")


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
            check_known(name)
            _check_entry(name, entry)
            yield name, entry


def _check_entry(name: str, entry: Any) -> None:  # noqa: ANN401 - whatever the file holds
    if not isinstance(entry, Mapping) or not {"value", "unit", "source"} <= set(entry):
        raise CapsuleError(f"{name}: write it as {{value: ..., unit: ..., source: ...}}")
    check_value(name, entry["value"])
    if entry["source"] not in SOURCES:
        raise CapsuleError(
            f"{name}: the source {entry['source']!r} is not one of {', '.join(SOURCES)}"
        )


def check_value(name: str, value: Any) -> None:  # noqa: ANN401 - whatever a file holds
    """Raise an error if a parameter's value is not allowed; it names what is.

    A number is finite and not negative; some must be greater than 0, and some have a limit.
    """
    share = name.endswith(("_probability", "_fraction")) or name in _SHARES
    limits = _RANGES.get(name, (0.0, 1.0 if share else math.inf))
    whole, positive = name in _WHOLE, name in _POSITIVE
    check_allowed(name, value, words_of(name), limits, whole=whole, positive=positive)


def check_allowed(
    name: str,
    value: Any,  # noqa: ANN401 - whatever a file holds
    words: Sequence[str],
    limits: Sequence[float] = (),
    *,
    whole: bool = False,
    positive: bool = False,
) -> None:
    """Raise an error if a value is none of the allowed words or, without words, of the numbers."""
    if words:
        if value not in words:
            raise CapsuleError(f"{name} is {value}; allowed are {', '.join(words)}")
        return
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise CapsuleError(f"{name}: the value {value!r} is not a number")
    low, high = limits
    if not low <= value <= high or not math.isfinite(value) or (positive and value == 0):
        allowed = f"{low:g} to {high:g}" if high < math.inf else f"a number from {low:g} on"
        allowed = "a number greater than 0" if positive else allowed
        raise CapsuleError(f"{name} is {value:g}; allowed is {allowed}")
    if whole and value != round(value):
        raise CapsuleError(f"{name} is {value:g}; allowed are whole numbers")
