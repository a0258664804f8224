"""Read, check and write lab.yaml, with which a laboratory describes its files."""

import difflib
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import yaml
from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError

from capsule.configuration import read_config_file
from capsule.errors import CapsuleError
from capsule.files import read_json, write_new
from capsule.kinds import Settings
from capsule.project import SCHEMAS

_HEAD = "# How capsule import reads your files; docs/import.md explains each key.\n"


def lab_schema() -> dict[str, Any]:
    """Read the JSON Schema of lab.yaml."""
    return read_json(SCHEMAS / "lab.schema.json")


def checked_map(content: Settings, schema: Settings, sensors: int) -> SimpleNamespace:
    """Return the keys of lab.yaml and of the options, after checking them.

    Parameters
    ----------
    content : mapping
        Values by key of lab.yaml.
    schema : mapping
        The JSON Schema of lab.yaml.
    sensors : int
        Configured number of sensors S.

    Returns
    -------
    SimpleNamespace
        One attribute per key; None if a key is not set.

    Raises
    ------
    CapsuleError
        If a key or value is not allowed; the message names key, value and what is allowed.
    """
    errors = Draft202012Validator(schema).iter_errors(dict(content))
    if faults := sorted(text for error in errors for text in _describe(error, schema)):
        raise CapsuleError("; ".join(faults))
    keys = SimpleNamespace(**{key: content.get(key) for key in schema["properties"]})
    if keys.sensors is not None and len(keys.sensors) != sensors and not keys.per_sensor:
        raise CapsuleError(
            f"sensors: {keys.sensors!r} names {len(keys.sensors)} columns, but recording.sensors "
            f"of the configuration is {sensors}; name {sensors} columns in the order of the sensors"
        )
    splitting = next((key for key in ("run_column", "run_gap_s") if content.get(key)), None)
    if splitting and keys.per_sensor:
        raise CapsuleError(
            f"{splitting}: {content[splitting]!r} splits a file into runs, but each file is one "
            "sensor here; leave one of the two keys out"
        )
    if keys.date_order and keys.time_unit not in (None, "date"):
        raise CapsuleError(
            f"date_order: {keys.date_order!r} needs dates, but time_unit is "
            f"{keys.time_unit}; leave one of the two keys out"
        )
    return keys


def _describe(error: ValidationError, schema: Settings) -> Iterator[str]:
    if error.validator == "additionalProperties":
        known = sorted(schema["properties"])
        for name in sorted(map(str, set(error.instance) - set(known))):
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"did you mean {near[0]}?" if near else f"allowed are {', '.join(known)}"
            yield f"{name}: there is no such key; {hint}"
    elif error.absolute_path:
        key, value = str(error.absolute_path[0]), repr(error.instance)
        shown = value if len(value) <= 60 else value[:57] + "..."
        yield f"{key}: {shown} is not allowed; must be {allowed(schema['properties'][key])}"
    else:
        yield f"{error.message}; lab.yaml holds keys and values"


def allowed(part: Settings) -> str:
    """Return in words what a key may hold.

    Parameters
    ----------
    part : mapping
        The key's part of the schema.
    """
    if "enum" in part:
        return f"one of {', '.join(part['enum'])}"
    kind = part["type"]
    if kind == "array":
        return f"a list, each {allowed(part['items'])}"
    if kind == ["string", "number"]:
        return "text or a number"
    if kind == ["string", "integer"]:
        return "a column's name or its number, from 1 on"
    if kind in ("number", "integer"):
        word = "a whole number" if kind == "integer" else "a number"
        limits = {"exclusiveMinimum": "above", "minimum": "from", "maximum": "up to"}
        bounds = [f"{sign} {part[name]}" for name, sign in limits.items() if name in part]
        return " ".join([word, *bounds])
    return {"boolean": "true or false", "string": "text"}[kind]


def map_text(content: Mapping[str, Any]) -> str:
    """Return keys of lab.yaml as the text of a file."""
    plain = yaml.safe_dump(
        dict(content), sort_keys=False, allow_unicode=True, default_flow_style=None
    )
    return _HEAD + plain


def keep_map(path: Path, content: Mapping[str, Any]) -> str:
    """Write lab.yaml; leave an existing file unchanged.

    Returns
    -------
    str
        A message for the user; empty if the existing file holds the same keys.
    """
    try:
        write_new(path, map_text(content).encode("utf-8"))
    except FileExistsError:
        try:
            there: Mapping[str, Any] = read_config_file(path)
        except CapsuleError:
            there = {}
        other = [key for key in {**there, **content} if there.get(key) != content.get(key)]
        if not other:
            return ""
        return (
            f"{path} exists and differs ({', '.join(other)}), so it was not changed; write another "
            "file with --write-map FILE, or use this one with --map"
        )
    return f"wrote {path}: correct it if it is wrong, and use it the next time with --map"
