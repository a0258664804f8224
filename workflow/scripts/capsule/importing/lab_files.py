"""Read lab.yaml and its schema; write a new lab.yaml, but never over another one."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from capsule.configuration import read_config_file
from capsule.errors import CapsuleError
from capsule.files import read_json, write_new
from capsule.project import SCHEMAS

LAB_SCHEMA = SCHEMAS / "lab.schema.json"
_HEAD = "# How capsule import reads your files; docs/import.md explains each key.\n"


def lab_schema() -> dict[str, Any]:
    """Read the JSON Schema of lab.yaml."""
    return read_json(LAB_SCHEMA)


def read_map(path: Path) -> dict[str, Any]:
    """Read lab.yaml; the paths under its key sensor_files start at its folder.

    Raises
    ------
    CapsuleError
        The file does not exist, or holds no keys; the message names it.
    """
    content = read_config_file(path)
    files = content.get("sensor_files")
    if isinstance(files, Mapping):
        beside = {
            sensor: str(path.parent / file) if isinstance(file, str) else file
            for sensor, file in files.items()
        }
        content["sensor_files"] = beside
    return content


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
