"""Read files of Neurodata Without Borders (NWB) with pynwb."""

import io
import warnings
from typing import Any

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.extra import damage_named, needed_package
from capsule.importing.hdf_files import refuse_outside
from capsule.importing.source_table import Column, SourceTable, bare_column


def read_nwb(content: bytes) -> list[SourceTable]:
    """Read the time series of a file, in its acquisition, processing and stimulus.

    Parameters
    ----------
    content : bytes
        The file.

    Raises
    ------
    CapsuleError
        The file is damaged, or holds no time series.
    """
    pynwb = needed_package("pynwb", "NWB")
    damage = needed_package("hdmf.build.errors", "NWB").ConstructError
    remedy = "check it with pynwb-validate"
    h5py = needed_package("h5py", "NWB")
    with (
        damage_named("NWB file", remedy, damage),
        warnings.catch_warnings(),
        h5py.File(io.BytesIO(content), "r") as hdf,
    ):
        # pynwb warns about namespaces of other versions of the format.
        warnings.simplefilter("ignore", UserWarning)
        refuse_outside(hdf)
        with pynwb.NWBHDF5IO(file=hdf, mode="r", load_namespaces=True) as stream:
            file = stream.read()
            started = file.session_start_time.isoformat(timespec="seconds")
            series = [each for each in file.objects.values() if _is_series(each, pynwb)]
            tables = [_table(each, started.replace("+00:00", "Z")) for each in series]
    if not tables:
        raise CapsuleError("the file holds no time series of numbers; export the readings as one")
    return tables


def _is_series(each: object, pynwb: Any) -> bool:
    if not isinstance(each, pynwb.TimeSeries):
        return False
    data = np.asarray(each.data)
    return data.dtype.kind in "iuf" and data.ndim in (1, 2) and data.shape[0] > 1


def _table(series: Any, started: str) -> SourceTable:
    data = np.asarray(series.data, dtype=float) * series.conversion + series.offset
    data = data.reshape(data.shape[0], -1)
    columns: list[Column] = []
    if series.timestamps is not None:
        columns.append(bare_column("timestamps", np.asarray(series.timestamps), "s"))
    several = data.shape[1] > 1
    columns += [
        bare_column(f"{series.name}({number})" if several else series.name, column, series.unit)
        for number, column in enumerate(data.T, start=1)
    ]
    return SourceTable(
        tuple(columns), "variable", series.name, started=started, rate_hz=series.rate
    )
