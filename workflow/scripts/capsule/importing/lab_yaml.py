"""Read, check and write lab.yaml, with which a laboratory describes its files."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from capsule.engine.configuration import faults_of, read_config_file
from capsule.engine.project import SCHEMAS
from capsule.errors import CapsuleError
from capsule.kinds import Settings
from capsule.store.files import write_new

_HEAD = "# How capsule import reads your files; docs/import.md explains each key.\n"


@dataclass(frozen=True)
class Keys:
    """How files are read: the keys of lab.yaml, None if not set, and what the configuration says.

    Attributes
    ----------
    given : mapping
        The keys that are set.
    sensor_count : int
        Number of sensors in a file.
    rate_hz, rate_tolerance, full_scale : float
        The configuration's keys of the sections ``recording`` and ``diagonal``.
    """

    given: Settings
    sensor_count: int
    rate_hz: float
    rate_tolerance: float
    full_scale: float
    encoding: str | None = None
    delimiter: str | None = None
    decimal: str | None = None
    thousands: str | None = None
    skip_lines: int | None = None
    missing: Sequence[str | float] | None = None
    sheet: str | None = None
    variable: str | None = None
    time: str | int | None = None
    time_unit: str | None = None
    date_order: str | None = None
    rate: float | None = None
    sensors: Sequence[str | int] | None = None
    per_sensor: bool | None = None
    unit: str | None = None
    adc_bits: int | None = None
    vref_v: float | None = None
    series_ohm: float | None = None
    run_column: str | int | None = None
    run_gap_s: float | None = None
    source: str | None = None
    site: str | None = None
    session: str | None = None
    setup: str | None = None


def lab_schema() -> dict[str, Any]:
    """Read the JSON Schema of lab.yaml."""
    schema: dict[str, Any] = json.loads((SCHEMAS / "lab.schema.json").read_text("utf-8"))
    return schema


def checked_keys(content: Settings, settings: Settings) -> Keys:
    """Return the keys by which files are read: those of lab.yaml, and those of the configuration.

    Options of the command override the values of lab.yaml in `content`. Of the configuration, the
    sections ``recording`` and ``diagonal`` are used.

    Raises
    ------
    CapsuleError
        If a key or value is not allowed; the message names key, value and what is allowed.
    """
    schema, rules = lab_schema(), settings["recording"]
    if faults := sorted(faults_of(content, schema)):
        raise CapsuleError("; ".join(f"{key}: {text}" for key, text in faults))
    keys = Keys(
        **content,
        given=content,
        sensor_count=1 if content.get("per_sensor") else rules["sensors"],
        rate_hz=rules["rate_hz"],
        rate_tolerance=rules["rate_tolerance"],
        full_scale=settings["diagonal"]["full_scale"],
    )
    if keys.sensors and len(keys.sensors) != keys.sensor_count and not keys.per_sensor:
        raise CapsuleError(
            f"sensors: {keys.sensors!r} names {len(keys.sensors)} columns, but recording.sensors "
            f"of the configuration is {keys.sensor_count}; name {keys.sensor_count} columns in the "
            "order of the sensors"
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


def keep_map(path: Path, content: Settings) -> str:
    """Write lab.yaml, or leave an existing file unchanged; return a message for the user.

    The message is empty if the existing file holds the same keys.
    """
    text = yaml.safe_dump(
        dict(content), sort_keys=False, allow_unicode=True, default_flow_style=None
    )
    try:
        write_new(path, (_HEAD + text).encode("utf-8"))
    except FileExistsError:
        try:
            there = read_config_file(path)
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
