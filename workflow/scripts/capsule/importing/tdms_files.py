"""Read TDMS files of LabVIEW with npTDMS."""

import io
from typing import Any

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.extra import damage_named, needed_package
from capsule.importing.source_table import Column, SourceTable, bare_column


def read_tdms(content: bytes) -> list[SourceTable]:
    """Read the groups of a TDMS file, with the units and the sampling rate of their channels.

    Parameters
    ----------
    content : bytes
        The file.

    Raises
    ------
    CapsuleError
        The file is damaged, or holds no channel of numbers.
    """
    nptdms = needed_package("nptdms", "TDMS")
    with damage_named("TDMS file", "copy or export it again"):
        file = nptdms.TdmsFile.read(io.BytesIO(content))
        tables = [table for group in file.groups() for table in _tables(group)]
    if not tables:
        raise CapsuleError("no group holds channels of numbers; export the readings as channels")
    return tables


def _tables(group: Any) -> list[SourceTable]:
    """Return one table for the channels of each length."""
    lengths: dict[int, list[Any]] = {}
    for channel in group.channels():
        if len(channel) > 1 and channel.dtype.kind in "iufM":
            lengths.setdefault(len(channel), []).append(channel)
    tables = []
    for length, channels in lengths.items():
        step = channels[0].properties.get("wf_increment")
        start = channels[0].properties.get("wf_start_time")
        label = group.name if len(lengths) == 1 else f"{group.name}, {length} samples"
        tables.append(
            SourceTable(
                tuple(map(_column, channels)),
                "variable",
                label,
                started=f"{np.datetime64(start, 's')}Z" if start else "",
                rate_hz=1.0 / step if step else None,
            )
        )
    return tables


def _column(channel: Any) -> Column:
    unit = str(channel.properties.get("unit_string", ""))
    data = np.asarray(channel[:])
    if data.dtype.kind != "M":
        return bare_column(channel.name, data, unit)
    # Time stamps are converted to seconds since 1970, with a resolution of 1 microsecond.
    return bare_column(channel.name, data.astype("datetime64[us]").astype(float) / 1e6, "s")
