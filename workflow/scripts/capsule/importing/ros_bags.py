"""Read bags of ROS 1 and ROS 2 with rosbags."""

import dataclasses
import sqlite3
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.extra import damage_named, needed_package
from capsule.importing.source_table import SourceTable, bare_column

# A longer array in a message is taken for an image or a scan, and not read.
_LONGEST_ARRAY = 256


def read_bag(path: Path) -> list[SourceTable]:
    """Read the topics of a bag; each number in a message becomes a column.

    Parameters
    ----------
    path : Path
        A ``.bag`` file, or the folder or ``.mcap`` file of a bag of ROS 2.

    Raises
    ------
    CapsuleError
        The bag is damaged, or holds no message with numbers.
    """
    bags = needed_package("rosbags.highlevel.anyreader", "A bag of ROS")
    typesys = needed_package("rosbags.typesys", "A bag of ROS")
    types = typesys.get_typestore(typesys.Stores.LATEST)
    topics: dict[str, list[dict[str, Any]]] = {}
    remedy = "give a .bag file, or the folder of a bag of ROS 2 with its metadata.yaml"
    # rosbags reads the files of SQLite by apsw, and did so by sqlite3.
    database = sys.modules.get("apsw", sqlite3)
    own = (
        database.Error,
        bags.AnyReaderError,
        *bags.ReaderErrors,
        bags.SerdeError,
        bags.TypesysError,
    )
    with (
        damage_named("bag", remedy, *own),
        bags.AnyReader([path], default_typestore=types) as reader,
    ):
        for connection, stamp_ns, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            if numbers := dict(_numbers(message, "")):
                stamp = _stamp_ns(message) or stamp_ns
                topics.setdefault(connection.topic, []).append({"stamp": stamp} | numbers)
        tables = [_table(topic, rows) for topic, rows in topics.items() if len(rows) > 1]
    if not tables:
        raise CapsuleError(
            "no topic holds messages with numbers; check that the sensors' topic was recorded"
        )
    return tables


def _table(topic: str, rows: list[dict[str, float]]) -> SourceTable:
    first = rows[0]["stamp"]
    # A float cannot hold all digits of the nanoseconds since 1970, so times are relative to the
    # first.
    seconds = np.array([(row["stamp"] - first) / 1e9 for row in rows])
    columns = [bare_column("stamp", seconds, "s")]
    for name in list(rows[0])[1:]:
        columns.append(bare_column(name, np.array([row.get(name, np.nan) for row in rows])))
    started = datetime.fromtimestamp(first // 10**9, UTC).isoformat().replace("+00:00", "Z")
    return SourceTable(tuple(columns), "variable", topic, started=started)


def _stamp_ns(message: object) -> int:
    """Return the time stamp in a message's header; 0 if it has none."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return 0 if stamp is None else int(stamp.sec) * 10**9 + int(stamp.nanosec)


def _numbers(value: object, name: str) -> Iterator[tuple[str, float]]:
    """Yield the numbers in a message, with names such as ``data[0]`` and ``wrench.force.x``."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if field.name not in ("header", "layout") and not field.name.startswith("_"):
                inner = f"{name}.{field.name}" if name else field.name
                yield from _numbers(getattr(value, field.name), inner)
    elif isinstance(value, list | np.ndarray) and 0 < len(value) <= _LONGEST_ARRAY:
        for number, each in enumerate(value):
            yield from _numbers(each, f"{name}[{number}]")
    elif isinstance(value, int | float | np.number) and not isinstance(value, bool):
        yield name, float(value)
