"""lab.yaml on disk: read with its schema, written where no other one stands."""

from collections.abc import Mapping
from pathlib import Path

import yaml

from capsule.errors import CapsuleError
from edges.config_files import read_config_file
from edges.files import read_json
from edges.new_file import write_new

LAB_SCHEMA = Path(__file__).resolve().parents[2] / "schemas" / "lab.schema.json"
_HEAD = "# What import_recordings.py takes for what; docs/import.md explains each key.\n"


def lab_schema() -> dict:
    """Read the JSON Schema of lab.yaml."""
    return read_json(LAB_SCHEMA)


def read_map(path: Path) -> dict:
    """Read lab.yaml; its files of sensors are taken from beside it.

    Raises
    ------
    CapsuleError
        It is not there or holds no keys; the text names it.
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


def map_text(content: Mapping) -> str:
    """Write keys of lab.yaml as text."""
    plain = yaml.safe_dump(
        dict(content), sort_keys=False, allow_unicode=True, default_flow_style=None
    )
    return _HEAD + plain


def keep_map(path: Path, content: Mapping) -> str:
    """Write lab.yaml, and never over one that says something else.

    Returns
    -------
    str
        What was done, for the user; empty where the same already stands there.
    """
    try:
        write_new(path, map_text(content).encode("utf-8"))
    except FileExistsError:
        try:
            there: Mapping = read_config_file(path)
        except CapsuleError:
            there = {}
        other = [key for key in {**there, **content} if there.get(key) != content.get(key)]
        if not other:
            return ""
        return (
            f"{path} says otherwise ({', '.join(other)}) and was left as it is; write another by "
            "--write-map FILE, or give it by --map"
        )
    return f"wrote {path}: change it where it is wrong, and give it by --map the next time"
