"""The check of the configuration: every fault with its key, its value and what is allowed."""

import difflib
from collections.abc import Iterable, Mapping, Sequence

from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError

from capsule.errors import CapsuleError

_LIMITS = {
    "minimum": "at least",
    "maximum": "at most",
    "exclusiveMinimum": "more than",
    "exclusiveMaximum": "less than",
}


def check_configuration(config: Mapping, schema: Mapping, source: str) -> None:
    """Refuse a configuration that breaks the schema or contradicts itself.

    Parameters
    ----------
    config : mapping
        The configuration as loaded.
    schema : mapping
        The JSON Schema.
    source : str
        The file that the message names.

    Raises
    ------
    CapsuleError
        Lists every fault, a line each: key, value, what is allowed.
    """
    validator = Draft202012Validator(schema)
    errors = sorted(validator.iter_errors(config), key=lambda error: list(map(str, error.path)))
    faults = [fault for error in errors for fault in _describe(error)]
    if not faults:
        faults = list(_contradictions(config))
    if faults:
        lines = "".join(f"\n  {fault}" for fault in faults)
        raise CapsuleError(f"{source} cannot be used:{lines}")


def _describe(error: ValidationError) -> Iterable[str]:
    key = ".".join(str(part) for part in error.absolute_path)
    if error.validator == "additionalProperties":
        known = sorted(error.schema["properties"])
        for name in sorted(map(str, set(error.instance) - set(known))):
            full = f"{key}.{name}" if key else name
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"did you mean {near[0]}?" if near else f"known here: {', '.join(known)}"
            yield f"{full}: there is no such key; {hint}"
    elif error.validator == "required":
        for name in error.validator_value:
            if name not in error.instance:
                yield f"{f'{key}.{name}' if key else name}: is missing"
    else:
        yield f"{key}: {_shorten(error.instance)} is not allowed; must be {_allowed(error)}"


def _allowed(error: ValidationError) -> str:
    limit = error.validator_value
    match error.validator:
        case "type":
            return f"of type {limit}"
        case "enum":
            return f"one of {', '.join(map(str, limit))}"
        case "minItems" | "maxItems":
            return f"a list of {'at least' if error.validator == 'minItems' else 'at most'} {limit}"
        case "uniqueItems":
            return "a list without repeats"
        case name if name in _LIMITS:
            return f"{_LIMITS[name]} {limit}"
        case name:
            return f"{name} {limit}"


def _contradictions(config: Mapping) -> Iterable[str]:
    """Find values that are allowed one by one but not together."""
    recording, preprocessing = config["recording"], config["preprocessing"]
    fit = config["fit"]
    window, length = preprocessing["window"], preprocessing["length"]
    if window > length:
        yield (
            f"preprocessing.window: {window} samples are more than preprocessing.length, {length}"
        )
    for part in ("diagonal", "fit"):
        for name in sorted(key for key in config[part] if key.endswith("_range")):
            low, high = _pair(config[part][name])
            if low > high:
                yield f"{part}.{name}: {low:g} is above {high:g}; give the lower bound first"
    last = fit["first_peak"] + (recording["sensors"] - 1) * fit["peak_spacing_range"][1]
    if last > length:
        yield (
            f"fit.peak_spacing_range: with first_peak {fit['first_peak']} the last of "
            f"{recording['sensors']} peaks could lie at column {last}, beyond "
            f"preprocessing.length, {length}"
        )
    if recording["max_gap_s"] * recording["rate_hz"] > window // 2:
        yield (
            f"recording.max_gap_s: {recording['max_gap_s']:g} s are more than half the window "
            f"of {window} samples at {recording['rate_hz']:g} Hz; allowed is at most "
            f"{window // 2 / recording['rate_hz']:g} s"
        )


def _pair(values: Sequence[float]) -> tuple[float, float]:
    return values[0], values[1]


def _shorten(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
