"""Export to Neurodata Without Borders (NWB): a file for each recording, and one for the tables."""

import json
from collections.abc import Callable
from datetime import datetime
from functools import partial
from typing import TYPE_CHECKING, BinaryIO

from capsule.exporting.exported import Exported
from capsule.exporting.legal_names import legal_names
from capsule.exporting.nwb_tables import add_tables
from capsule.exporting.session_dates import NO_DATE, UNKNOWN, session_start

if TYPE_CHECKING:
    import pynwb


def contents(exported: Exported) -> dict[str, Callable[[BinaryIO], None]]:
    """Return the names of the files, with the functions that write them.

    A rejected recording has no file; it is only in a table.
    """
    of_recordings = [each.values for each in exported.matrices if each.of == "recording"]
    names = {name for values in of_recordings for name, matrix in values.items() if matrix.size}
    legal = legal_names(exported.headers)
    writers: dict[str, Callable[[BinaryIO], None]] = {
        f"{legal[name]}.nwb": partial(_write_recording, exported, name) for name in names
    }
    return dict(sorted(writers.items())) | {"tables.nwb": partial(_write_tables, exported)}


def _write_recording(exported: Exported, name: str, stream: BinaryIO) -> None:
    from pynwb import TimeSeries

    start, remark = session_start(exported.headers[name])
    about = f"recording {name} of a tactile capsule" + (f"; {remark}" if remark else "")
    file = _file(exported, name, start, about)
    file.data_collection = "".join(f"{k}: {v}\n" for k, v in exported.headers[name].items())
    for matrices in exported.matrices:
        if matrices.of == "recording":
            series = TimeSeries(
                name=matrices.name,
                # Time is the first axis in NWB, so a sensor is a column.
                data=matrices.values[name].T.copy(),
                unit=matrices.units[name],
                rate=exported.rate_hz,
                starting_time=0.0,
                description=f"{matrices.long_name}; a column is a sensor",
            )
            if matrices.axis == "time":
                file.add_acquisition(series)
            else:
                file.create_processing_module("preprocessing", "pre-processed").add(series)
    _save(file, stream)


def _write_tables(exported: Exported, stream: BinaryIO) -> None:
    file = _file(exported, exported.what, NO_DATE, f"tables of an archive; {UNKNOWN}")
    add_tables(file, exported)
    _save(file, stream)


def _file(exported: Exported, name: str, start: datetime, about: str) -> "pynwb.NWBFile":
    import pynwb

    return pynwb.NWBFile(
        session_description=about,
        identifier=f"{name} {exported.provenance['results_sha256']}",
        session_id=name,
        session_start_time=start,
        experiment_description=f"origin: {exported.provenance['origin']}",
        related_publications=[exported.provenance["method"]],
        notes=json.dumps(exported.provenance),
    )


def _save(file: "pynwb.NWBFile", stream: BinaryIO) -> None:
    import h5py
    import pynwb

    with h5py.File(stream, "w") as hdf, pynwb.NWBHDF5IO(file=hdf, mode="w") as io:
        io.write(file, cache_spec=True)
