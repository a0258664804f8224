"""Check of the configuration. Each fault names the file, the key, the value and what is allowed."""

import copy
import difflib
import math
from collections.abc import Iterator, Mapping
from typing import Any

from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError
from jsonschema.validators import extend

from capsule.errors import CapsuleError
from capsule.kinds import Row, Settings

_LIMITS = {
    "minimum": "at least",
    "exclusiveMinimum": "more than",
    "maximum": "at most",
    "exclusiveMaximum": "less than",
}

# The keys of the section ``diagonal`` that describe the bench; they apply to every detector.
BENCH = ("wave_speed_mm_s", "wavelength_mm", "full_scale", "pressing_lowers_reading", "pitch_mm")
# In place of a detector's name, this word selects the one that does best on the archive.
_BEST = "best"
# Enough for two harmonics of a wave, even if its period is half the configured one.
_LEAST_SAMPLES_A_WAVE = 10


def _is_integer(_: object, value: object) -> bool:
    # JSON Schema accepts 84.0 as an integer; numpy does not.
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number(checker: object, value: object) -> bool:
    # .nan passes every limit, since no comparison with it is true.
    return _is_integer(checker, value) or (isinstance(value, float) and math.isfinite(value))


_Validator = extend(
    Draft202012Validator,
    type_checker=Draft202012Validator.TYPE_CHECKER.redefine_many(
        {"integer": _is_integer, "number": _is_number}
    ),
)


def check_configuration(
    config: Settings, schema: Settings, sources: Mapping[str, Settings]
) -> dict[str, Any]:
    """Return the configuration as it is used; raise an error if it cannot be.

    A key that is left out has the schema's ``default``, if it has one. Keys and values that the
    schema lists under ``without_effect`` are left out.

    Parameters
    ----------
    config : mapping
        The configuration that results from all sources.
    schema : mapping
        The JSON Schema.
    sources : mapping of str to mapping
        The values that each file, or the command line, sets. A later source overrides an earlier
        one. The message names the source of a faulty value.

    Returns
    -------
    dict

    Raises
    ------
    CapsuleError
        The configuration breaks the schema or contradicts itself. Lists every fault on a line of
        its own: file, key, value, what is allowed.
    """
    config = _as_used(config, schema)
    errors = _Validator(schema).iter_errors(config)
    faults = {fault for error in errors for fault in _describe(error, schema, config)}
    if not faults:
        faults = set(_contradictions(config))
    if faults:
        lines = "".join(f"\n  {_source(key, sources)}: {text}" for key, text in sorted(faults))
        raise CapsuleError(f"the configuration cannot be used:{lines}")
    return config


def without_effect(config: Settings, schema: Settings) -> list[str]:
    """Return a line for each key or value that is accepted but no longer has an effect.

    Parameters
    ----------
    config : mapping
        The configuration as it was written.
    schema : mapping
        The JSON Schema. Its entry ``without_effect`` gives the values of each such key; an empty
        list means the key itself.
    """
    lines = []
    for path, values in schema["without_effect"].items():
        section, key = path.split(".")
        part = config.get(section)
        if isinstance(part, Mapping) and key in part:
            found = part[key] if isinstance(part[key], list) else []
            lines += [
                f"{path}: {value} has no effect any more; remove it"
                for value in values
                if value in found
            ]
            lines += [] if values else [f"{path} has no effect any more; remove it"]
    return lines


def _as_used(config: Settings, schema: Settings) -> dict[str, Any]:
    """Return a copy of a configuration with its defaults, and without what has no effect."""
    used = copy.deepcopy(dict(config))
    for name, section in schema["properties"].items():
        part = used.get(name)
        if not isinstance(part, dict):
            continue
        for key, described in section.get("properties", {}).items():
            if "default" in described:
                part.setdefault(key, copy.deepcopy(described["default"]))
            values = schema["without_effect"].get(f"{name}.{key}", [])
            if isinstance(part.get(key), list):
                part[key] = [value for value in part[key] if value not in values]
    for path, values in schema["without_effect"].items():
        section, key = path.split(".")
        if not values and isinstance(used.get(section), dict):
            used[section].pop(key, None)
    return used


def changed_values(first: Settings, last: Settings) -> dict[str, Any]:
    """Return the keys of a configuration whose values differ from those of an earlier one."""
    changed: dict[str, Any] = {}
    for key, value in last.items():
        before = first.get(key)
        if isinstance(value, Mapping) and isinstance(before, Mapping):
            value = changed_values(before, value)
            if not value:
                continue
        elif key in first and value == before:
            continue
        changed[key] = value
    return changed


def _source(path: str, sources: Mapping[str, Row]) -> str:
    """Return the name of the last source that sets a key, or of the first if none does."""
    giving = next(iter(sources))
    for name, content in sources.items():
        part: object = content
        for key in path.split("."):
            part = part.get(key, sources) if isinstance(part, Mapping) else sources
        if part is not sources:
            giving = name
    return giving


def _describe(
    error: ValidationError, schema: Settings, config: Settings
) -> Iterator[tuple[str, str]]:
    """Yield the key and the message of each fault in an error of the validator."""
    # A fault inside a list is reported as a fault of the whole list.
    keys = [part for part in error.absolute_path if isinstance(part, str)]
    key = ".".join(keys)
    prefix = f"{key}." if key else ""
    if error.validator == "additionalProperties":
        known = sorted(error.schema["properties"])
        for name in sorted(map(str, set(error.instance) - set(known))):
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"did you mean {near[0]}?" if near else f"allowed here: {', '.join(known)}"
            yield prefix + name, f"{prefix}{name}: there is no such key; {hint}"
    elif error.validator == "required":
        for name in error.validator_value:
            if name not in error.instance and repr(name) in error.message:
                yield prefix + name, f"{prefix}{name}: is missing"
    else:
        value: Any = config
        part = schema
        for name in keys:
            value, part = value[name], part["properties"][name]
        allowed = allowed_values(part, schema)
        yield key, f"{key}: {_shorten(value)} is not allowed; must be {allowed}{_hint(value, part)}"


def _hint(value: object, part: Settings) -> str:
    if part.get("items", {}).get("type") == "string" and isinstance(value, list):
        # YAML reads 2024-06-03 as a date.
        return "" if all(isinstance(each, str) for each in value) else " (put it in quotes)"
    if isinstance(value, str):
        try:
            return f" (this is text; write {float(value):.12g})"
        except ValueError:
            return ""
    return ""


def allowed_values(part: Settings, schema: Settings) -> str:
    """Return in words which values a key may hold.

    Parameters
    ----------
    part : mapping
        The key's part of the schema.
    schema : mapping
        The whole schema, with the definitions that its parts refer to.

    Returns
    -------
    str
    """
    if "$ref" in part:
        part = {**schema["$defs"][part["$ref"].rsplit("/", 1)[1]], **part}
    if "oneOf" in part:
        return " or ".join(allowed_values(each, schema) for each in part["oneOf"])
    if "const" in part:
        return str(part["const"])
    limits = "".join(f", {word} {part[name]}" for name, word in _LIMITS.items() if name in part)
    match part.get("type"):
        case "object":
            return f"a section with the keys {', '.join(part['properties'])}"
        case "array":
            least, most = part.get("minItems", 0), part.get("maxItems")
            count = f" of {most}" if most == least else f" of at least {least}" if least else ""
            unique = ", no value twice" if part.get("uniqueItems") else ""
            return f"a list{count}, each {allowed_values(part['items'], schema)}{unique}"
        case "integer" | "number" as kind:
            return f"{'a whole number' if kind == 'integer' else 'a number'}{limits}"
        case "boolean":
            return "true or false"
        case "string":
            return "text"
    return f"one of {', '.join(map(str, part['enum']))}"


def _contradictions(config: Settings) -> Iterator[tuple[str, str]]:
    """Yield the key and the message of values that are allowed one by one but not together."""
    named, detectors = config["report"]["lead"], config["detectors"]
    if named not in (_BEST, *detectors):
        key, known = "report.lead", ", ".join((_BEST, *detectors))
        yield key, f"{key}: {_shorten(named)} is not allowed; must be one of {known}"
    recording, preprocessing = config["recording"], config["preprocessing"]
    fit = config["fit"]
    window, length = preprocessing["window"], preprocessing["length"]
    if window > length:
        key = "preprocessing.window"
        yield key, f"{key}: {window} samples are more than preprocessing.length, which is {length}"
    for part in ("diagonal", "fit"):
        for name in sorted(key for key in config[part] if key.endswith("_range")):
            low, high = config[part][name]
            if low > high:
                key = f"{part}.{name}"
                yield key, f"{key}: {low:g} is above {high:g}; give the lower bound first"
    last = fit["first_peak"] + (recording["sensors"] - 1) * fit["peak_spacing_range"][1]
    if last > length:
        key = "fit.peak_spacing_range" if fit["first_peak"] <= length else "fit.first_peak"
        yield (
            key,
            f"{key}: with first_peak {fit['first_peak']}, the last of {recording['sensors']} "
            f"peaks could be at column {last}; preprocessing.length is only {length}",
        )
    bench = config["diagonal"]
    samples = bench["wavelength_mm"] / bench["wave_speed_mm_s"] * recording["rate_hz"]
    if samples < _LEAST_SAMPLES_A_WAVE:
        key = "diagonal.wave_speed_mm_s"
        yield (
            key,
            f"{key}: at {bench['wave_speed_mm_s']:g} mm/s a wave of {bench['wavelength_mm']:g} mm "
            f"lasts {samples:.2g} samples at {recording['rate_hz']:g} Hz; at least "
            f"{_LEAST_SAMPLES_A_WAVE} are needed",
        )
    if recording["max_gap_s"] * recording["rate_hz"] > window // 2:
        key = "recording.max_gap_s"
        yield (
            key,
            f"{key}: {recording['max_gap_s']:g} s are more than half the window "
            f"of {window} samples at {recording['rate_hz']:g} Hz; at most "
            f"{window // 2 / recording['rate_hz']:g} s are allowed",
        )


def _shorten(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
