"""Read XDF files of LabRecorder with pyxdf."""

import io
from typing import Any

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.extra import damage_named, needed_package
from capsule.importing.source_table import SourceTable, bare_column


def read_xdf(content: bytes) -> list[SourceTable]:
    """Read the streams of an XDF file; pyxdf brings the time stamps to one clock, without jitter.

    Parameters
    ----------
    content : bytes
        The file.

    Raises
    ------
    CapsuleError
        The file is damaged, or holds no stream of numbers.
    """
    pyxdf = needed_package("pyxdf", "XDF")
    with damage_named("XDF file", "copy or record it again"):
        streams, head = pyxdf.load_xdf(io.BytesIO(content))
        started = str(_first(head["info"].get("datetime")))
        tables = [_table(stream, started) for stream in streams if _is_numbers(stream)]
    if not tables:
        raise CapsuleError("no stream holds numbers; check that the sensors' stream was recorded")
    return tables


def _is_numbers(stream: dict[str, Any]) -> bool:
    data = stream["time_series"]
    return isinstance(data, np.ndarray) and data.dtype.kind in "iuf" and data.shape[0] > 1


def _table(stream: dict[str, Any], started: str) -> SourceTable:
    info, data = stream["info"], stream["time_series"]
    told = _first((_first(info.get("desc")) or {}).get("channels"))
    channels = (told or {}).get("channel", []) if isinstance(told, dict) else []
    columns = [bare_column("time_stamps", stream["time_stamps"], "s")]
    for number, values in enumerate(data.T, start=1):
        channel = channels[number - 1] if number <= len(channels) else {}
        name = _first(channel.get("label")) or f"channel {number}"
        columns.append(bare_column(str(name), values, str(_first(channel.get("unit")) or "")))
    return SourceTable(
        tuple(columns),
        "variable",
        str(_first(info["name"])),
        started=started,
        remark="" if stream.get("footer") else "the stream has no end: the file may be incomplete",
    )


def _first(values: Any) -> Any:
    """Return the first value of an XML element, which pyxdf reads as a list."""
    return (values[0] if values else "") if isinstance(values, list) else values or ""
