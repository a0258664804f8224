"""Check the keys of lab.yaml, with which a laboratory describes its files."""

import difflib
from collections.abc import Iterator
from types import SimpleNamespace

from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError

from capsule.errors import CapsuleError
from capsule.kinds import Settings


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
    faults = [
        text
        for error in Draft202012Validator(schema).iter_errors(dict(content))
        for text in _describe(error, schema)
    ]
    if faults:
        raise CapsuleError("; ".join(sorted(faults)))
    chosen = content.get("sensors")
    if chosen is not None and len(chosen) != sensors and not content.get("per_sensor"):
        raise CapsuleError(
            f"sensors: {chosen!r} names {len(chosen)} columns, but recording.sensors of the "
            f"configuration is {sensors}; name {sensors} columns in the order of the sensors"
        )
    splitting = next((key for key in ("run_column", "run_gap_s") if content.get(key)), None)
    if splitting and (content.get("per_sensor") or content.get("sensor_files")):
        raise CapsuleError(
            f"{splitting}: {content[splitting]!r} splits a file into runs, but each file is one "
            "sensor here; leave one of the two keys out"
        )
    if content.get("date_order") and content.get("time_unit") not in (None, "date"):
        raise CapsuleError(
            f"date_order: {content['date_order']!r} needs dates, but time_unit is "
            f"{content['time_unit']}; leave one of the two keys out"
        )
    return SimpleNamespace(**{key: content.get(key) for key in schema["properties"]})


def _describe(error: ValidationError, schema: Settings) -> Iterator[str]:
    if error.validator == "additionalProperties":
        known = sorted(schema["properties"])
        for name in sorted(map(str, set(error.instance) - set(known))):
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"did you mean {near[0]}?" if near else f"allowed are {', '.join(known)}"
            yield f"{name}: there is no such key; {hint}"
        return
    if not error.absolute_path:
        yield f"{error.message}; lab.yaml holds keys and values"
        return
    key = str(error.absolute_path[0])
    value = repr(error.instance)
    shown = value if len(value) <= 60 else value[:57] + "..."
    yield f"{key}: {shown} is not allowed; must be {allowed(schema['properties'][key])}"


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
    if kind == "object":
        return "one line sensor_1: FILE for each sensor"
    if kind in ("number", "integer"):
        word = "a whole number" if kind == "integer" else "a number"
        limits = {"exclusiveMinimum": "above", "minimum": "from", "maximum": "up to"}
        bounds = [f"{sign} {part[name]}" for name, sign in limits.items() if name in part]
        return " ".join([word, *bounds])
    return {"boolean": "true or false", "string": "text"}[kind]
