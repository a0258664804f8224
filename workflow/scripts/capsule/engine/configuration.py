"""Read and check the configuration.

Each fault names the file, the key, the value and what is allowed.

Snakemake's own reader names no file. If a key appears twice, it uses the last one without a
warning.
"""

import copy
import difflib
import json
import math
from collections.abc import Hashable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from capsule.detectors.registry import with_detectors
from capsule.engine.project import CONFIG, SCHEMAS, require_project
from capsule.errors import CapsuleError
from capsule.kinds import Row, Settings

if TYPE_CHECKING:
    from jsonschema.exceptions import ValidationError

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


def read_settings(config: str | Path | None = None, **changes: object) -> dict[str, Any]:
    """Read a configuration file, or the one that ships, and change keys as `capsule.load` does."""
    require_project()
    path = CONFIG / "config.yaml" if config is None else Path(config)
    content = read_config_file(path)
    settings = dict(content)
    for key, value in changes.items():
        section = settings.get(key)
        if isinstance(section, dict) and isinstance(value, dict):
            value = section | value
        settings[key] = value
    sources = {str(path): content, "changes": changes}
    return check_configuration(settings, read_schema(SCHEMAS / "config.schema.json"), sources)


class _Loader(yaml.SafeLoader):
    """A YAML loader that refuses repeated keys, and aliases: a few aliases can fill the memory."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Compose a node; raise an error if it is an alias."""
        if self.check_event(yaml.AliasEvent):
            # The type stubs of PyYAML give no types for this function.
            event = self.get_event()  # type: ignore[no-untyped-call]
            raise yaml.composer.ComposerError(
                None,
                None,
                f"the alias *{event.anchor} is not allowed; write its value out",
                event.start_mark,
            )
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Return the mapping as a dict; raise an error if a key appears twice."""
        seen = set()
        for key_node, _ in node.value:
            key = key_node.value if isinstance(key_node, yaml.ScalarNode) else None
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key!r} appears twice", key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep)


def read_config_file(path: Path) -> dict[str, Any]:
    """Read a configuration file in YAML or JSON; an error names the file."""
    try:
        content = yaml.load(path.read_text(encoding="utf-8-sig"), Loader=_Loader)
    except OSError as error:
        raise CapsuleError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise CapsuleError(f"{path}: this is not UTF-8 text; save it as UTF-8") from None
    except yaml.MarkedYAMLError as error:
        line = f", line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise CapsuleError(f"{path}{line}: {error.problem}") from None
    except yaml.YAMLError as error:
        raise CapsuleError(f"{path}: this is not valid YAML: {error}") from None
    except ValueError as error:
        # Python refuses to read an integer with thousands of digits.
        raise CapsuleError(f"{path}: a value cannot be read: {error}") from None
    except RecursionError:
        raise CapsuleError(f"{path}: the keys are nested too deeply") from None
    if not isinstance(content, dict):
        what = (
            "is empty" if content is None else f"holds a {type(content).__name__} instead of keys"
        )
        raise CapsuleError(f"{path}: this file {what}; config/README.md shows every key")
    return content


def read_schema(path: Path) -> dict[str, Any]:
    """Read config.schema.json, and add the detectors of the registry to it."""
    return with_detectors(json.loads(path.read_text(encoding="utf-8")))


def _is_integer(_: object, value: object) -> bool:
    # JSON Schema accepts 84.0 as an integer; numpy does not.
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number(checker: object, value: object) -> bool:
    # .nan passes every limit, since no comparison with it is true.
    return _is_integer(checker, value) or (isinstance(value, float) and math.isfinite(value))


def faults_of(config: Settings, schema: Settings) -> set[tuple[str, str]]:
    """Return key and message of each key and value that a JSON Schema does not allow."""
    # It takes longer to import than all else, and most programs only read files here.
    from jsonschema import Draft202012Validator
    from jsonschema.validators import extend

    checked = {"integer": _is_integer, "number": _is_number}
    types = Draft202012Validator.TYPE_CHECKER.redefine_many(checked)
    errors = extend(Draft202012Validator, type_checker=types)(schema).iter_errors(config)
    return {fault for error in errors for fault in _describe(error, schema, config)}


def check_configuration(
    config: Settings, schema: Settings, sources: Mapping[str, Settings]
) -> dict[str, Any]:
    """Return the configuration as it is used; raise an error with all faults if it cannot be.

    A key that is left out has the schema's ``default``, if it has one. Keys and values that the
    schema lists under ``without_effect`` are left out. `sources` gives the values that each file,
    or the command line, sets; a later one overrides an earlier one, and a fault names its source.
    """
    config = _as_used(config, schema)
    faults = faults_of(config, schema) or set(_contradictions(config))
    if faults:
        named = [f"\n  {_source(key, sources)}: {key}: {text}" for key, text in sorted(faults)]
        raise CapsuleError(f"the configuration cannot be used:{''.join(named)}")
    return config


def without_effect(config: Settings, schema: Settings) -> list[str]:
    """Return a line for each key or value that is accepted but no longer has an effect.

    The schema's entry ``without_effect`` gives the values of each such key; an empty list means the
    key itself.
    """
    return [
        f"{path}{f': {value}' if value else ''} has no effect any more; remove it"
        for path, _, _, value in _of_no_effect(config, schema)
    ]


def _of_no_effect(
    config: Settings, schema: Settings
) -> Iterator[tuple[str, dict[str, Any], str, str]]:
    """Yield path, section, key and value of what has no effect; no value stands for the key."""
    for path, values in schema["without_effect"].items():
        section, _, key = path.rpartition(".")
        part = config.get(section) if section else config
        if isinstance(part, dict) and key in part:
            found = part[key] if isinstance(part[key], list) else []
            for value in [value for value in values if value in found] if values else [""]:
                yield path, part, key, value


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
    for _, part, key, value in _of_no_effect(used, schema):
        if value:
            part[key] = [each for each in part[key] if each != value]
        else:
            del part[key]
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
    error: "ValidationError", schema: Settings, config: Settings
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
            yield prefix + name, f"there is no such key; {hint}"
    elif error.validator == "required":
        for name in error.validator_value:
            if name not in error.instance and repr(name) in error.message:
                yield prefix + name, "is missing"
    else:
        value: Any = config
        part = schema
        for name in keys:
            value, part = value[name], part["properties"][name]
        allowed = allowed_values(part, schema)
        yield key, f"{_shorten(value)} is not allowed; must be {allowed}{_hint(value, part)}"


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
    """Return in words which values a key may hold, from its part of the schema."""
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
    recording, shape, fit = config["recording"], config["preprocessing"], config["fit"]
    bench, window, length = config["diagonal"], shape["window"], shape["length"]
    lead, known = config["report"]["lead"], (_BEST, *config["detectors"])
    if lead not in known:
        must = f"must be one of {', '.join(known)}"
        yield "report.lead", f"{_shorten(lead)} is not allowed; {must}"
    if window > length:
        more = f"{window} samples are more than preprocessing.length, which is {length}"
        yield "preprocessing.window", more
    for part in ("diagonal", "fit"):
        for name in sorted(key for key in config[part] if key.endswith("_range")):
            low, high = config[part][name]
            if low > high:
                yield f"{part}.{name}", f"{low:g} is above {high:g}; give the lower bound first"
    spacing = fit["peak_spacing_range"][1]
    last = fit["first_peak"] + (recording["sensors"] - 1) * spacing
    if last > length:
        yield (
            "fit.peak_spacing_range" if fit["first_peak"] <= length else "fit.first_peak",
            f"with first_peak {fit['first_peak']}, the last of {recording['sensors']} peaks could "
            f"be at column {last}; preprocessing.length is only {length}; set "
            f"preprocessing.length: {max(last, recording['sensors'] * spacing)}",
        )
    samples = bench["wavelength_mm"] / bench["wave_speed_mm_s"] * recording["rate_hz"]
    if samples < _LEAST_SAMPLES_A_WAVE:
        yield (
            "diagonal.wave_speed_mm_s",
            f"at {bench['wave_speed_mm_s']:g} mm/s a wave of {bench['wavelength_mm']:g} mm lasts "
            f"{samples:.2g} samples at {recording['rate_hz']:g} Hz; at least "
            f"{_LEAST_SAMPLES_A_WAVE} are needed",
        )
    if recording["max_gap_s"] * recording["rate_hz"] > window // 2:
        yield (
            "recording.max_gap_s",
            f"{recording['max_gap_s']:g} s are more than half the window of {window} samples at "
            f"{recording['rate_hz']:g} Hz; at most {window // 2 / recording['rate_hz']:g} s are "
            "allowed",
        )


def _shorten(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
