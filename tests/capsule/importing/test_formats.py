"""Import of each format: from a file of its own library, and from files that packages ship."""

import re
import sys
import zipfile
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path

import h5py
import nptdms
import numpy as np
import openpyxl
import pandas
import pynwb
import pytest
import scipy.io
import xarray
from rosbags.rosbag2 import StoragePlugin

from support.importing import Case, assert_readings, import_files
from support.lab_files import (
    COUNTS,
    KILO_OHMS,
    STARTED,
    TIME_S,
    excel_rows,
    nwb_file,
    write_bag_1,
    write_bag_2,
    write_hdf,
    write_matlab,
    write_matlab_73,
    write_tdms,
    write_workbook,
)
from support.project import ROOT
from support.xdf_writer import xdf_file, xdf_stream

SENSORS = {f"S{n}": row for n, row in enumerate(COUNTS, start=1)}
GAP_S = TIME_S + 3 * (TIME_S > 20)
# Sensor n starts 2 n s later than the first; what all have in common begins 6 s later.
LATER = {name: row[20 * n :][:465] for n, (name, row) in enumerate(SENSORS.items())}
LATER_READ = (np.arange(405) / 10, COUNTS[:, 60:465])
SAMPLES = np.vstack([TIME_S, COUNTS])
NINE = np.datetime64("2026-03-04T09:00:00")


def saved(save, name, *content, **named):
    """Return what saves a file under a name, or a bag, by a function of a library."""

    def write(folder):
        save(folder / name, *content, **named)
        return folder / name

    return write


def named(name):
    """Return a decorator: what writes to a path becomes what returns a writer of such a file."""
    return lambda write: partial(saved, write, name)


hdf, tdms = named("run.h5")(write_hdf), named("run.tdms")(write_tdms)


@named("run.mat")
def matlab(path, **content):
    write_matlab(path, content)


@named("run.mat")
def matlab_73(path, **content):
    write_matlab_73(path, content)


@named("lab.xlsx")
def sheets(path, **by_title):
    write_workbook(path, by_title)


@named("run.nc")
def netcdf(path, engine, *, time=True):
    """Write the sensors as packed variables, in volts."""
    data = xarray.Dataset({n: ("time", row / 100, {"units": "V"}) for n, row in SENSORS.items()})
    data = data.assign_coords(time=NINE + (TIME_S * 1e6).astype("m8[us]")) if time else data
    packed = {"dtype": "int16", "scale_factor": 0.01, "add_offset": 4.0, "_FillValue": -1}
    data.to_netcdf(path, engine=engine, encoding=dict.fromkeys(SENSORS, packed))


@named("run.nwb")
def nwb(path, *series, **electrical):
    """Write time series, or the readings as an electrical series."""
    file = pynwb.NWBFile("capsule", "run-1", STARTED)
    if electrical:
        about = {"description": "a", "location": "b", "device": file.create_device(name="d")}
        group = file.create_electrode_group(name="g", **about)
        for _ in COUNTS:
            file.add_electrode(location="a", group=group)
        where = file.create_electrode_table_region(region=[0, 1, 2, 3], description="all")
        about = {"name": "run", "data": COUNTS.T, "electrodes": where, **electrical}
        file.add_acquisition(pynwb.ecephys.ElectricalSeries(**about))
    for each in series:
        file.add_acquisition(pynwb.TimeSeries(unit="counts", **each))
    with pynwb.NWBHDF5IO(str(path), "w") as stream:
        stream.write(file)


def series(**said):
    return {"name": "run", "data": COUNTS.T, "rate": 10.0, **said}


@named("run.xdf")
def xdf(path, *streams, unit="counts", **said):
    """Write streams, each with its time stamps and the names of its sensors."""
    content = [
        xdf_stream(at, f"s{at}", stamps, np.array([SENSORS[n] for n in names]), names, unit)
        for at, (stamps, names) in enumerate(streams, start=1)
    ]
    path.write_bytes(xdf_file(*content, **said))


@named("run.xlsx")
def workbook(path, times, change=None, number_format="General", form="General", more=()):
    """Write a sheet; `change` makes the cells of a sample.

    The first format is that of the times, and `form` that of the readings. `more` holds the texts
    of cells, and remarks on cells, by their places.
    """
    book = openpyxl.Workbook()
    book.active.append(["time", *SENSORS])
    for t, sample in zip(times, COUNTS.T.astype(int).tolist(), strict=True):
        book.active.append([t, *(map(change, sample) if change else sample)])
        for column, each in enumerate([number_format, *[form] * 4], start=1):
            book.active.cell(book.active.max_row, column).number_format = each
    for place, text in more:
        if book.active[place].value is None:
            book.active[place] = text
        else:
            book.active[place].comment = openpyxl.comments.Comment(text, "lab")
    book.save(path)


@named("run.xlsx")
def named_over_all(path, *heads):
    """Write a sheet; the second of two cells stands over all sensors."""
    book = openpyxl.Workbook()
    for at, row in enumerate([*heads, *SAMPLES.T.tolist()], start=1):
        book.active.append(row)
        if len(row) == 2:
            book.active.merge_cells(start_row=at, end_row=at, start_column=2, end_column=5)
    book.save(path)


def beside(*rows):
    """Return what writes a sheet of samples, and one of remarks."""
    samples = [["time", *SENSORS], *SAMPLES.T.tolist()]
    return sheets(Run=samples, About=[list(row) for row in rows])


def cells_73(folder):
    """Write a cell of texts beside the arrays, as MATLAB does."""
    path = matlab_73(t=TIME_S[:, None], V=COUNTS.T)(folder)
    with h5py.File(path, "r+") as file:
        units = file.create_dataset("units", (1, 4), dtype=h5py.ref_dtype)
        units.attrs["MATLAB_class"] = np.bytes_("cell")
        for n in range(4):
            text = file.create_dataset(f"#refs#/{n}", data=np.array([[*b"kPa"]], np.uint16).T)
            text.attrs["MATLAB_class"] = np.bytes_("char")
            units[0, n] = text.ref
    return path


def clocked_xdf(folder):
    """Write a stream whose clock the recorder has measured, beside one of another kind."""
    stream = xdf_stream(1, "c", TIME_S + 5000, COUNTS, list(SENSORS), "counts", offset_s=-4000)
    other = xdf_stream(2, "pump", TIME_S, COUNTS[:1], ["pressure"], "kPa")
    (folder / "run.xdf").write_bytes(xdf_file(stream, other))
    return folder / "run.xdf"


def gzipped(folder):
    frame = pandas.DataFrame({"time": TIME_S, **SENSORS})
    frame.to_csv(folder / "run.csv.gz", index=False)
    return folder / "run.csv.gz"


# A time and a matrix.
BOTH = {"t": TIME_S, "V": COUNTS.T}


def timed(**said):
    """Return what writes a matrix and its time for MATLAB, with what is said beside them."""
    return matlab(**BOTH, **said)


def attributed(path, name, value, **arrays):
    """Return what writes a matrix and its time as HDF5, with an attribute."""
    return hdf(BOTH | arrays, {(path, name): value})


FIELD_TYPES = [(name, "f8") for name in ("t", *SENSORS)]
FIELDS = np.array([*map(tuple, np.vstack([TIME_S, COUNTS]).T)], FIELD_TYPES)
NOON, NOON64 = datetime(2026, 3, 4, 12), np.datetime64("2026-03-04T12:00:00")
AT_NOON = {"started": "2026-03-04T12:00:00Z"}
APART = {"wf_increment": 0.1, "unit_string": "counts"}
SECONDS = [2.0 * n for n in range(4)]
RATES_OF_ALL = {(name, "sampling_rate"): 10.0 for name in LATER}
STARTS = {(name, "start"): f"{NINE + 2 * at}Z" for at, name in enumerate(LATER)}
# The last sensor ends a sample earlier.
OWN = {f"t{n + 1}": TIME_S[:465] + 2.0 * n for n in range(4)} | LATER
OWN |= {"t4": OWN["t4"][:-1], "S4": OWN["S4"][:-1]}
SHORT = {**SENSORS, "S4": COUNTS[3][:-1]}
LOST = np.where(TIME_S == 5, np.nan, COUNTS)
LOST_READ = (TIME_S, LOST)
FAR = np.where(TIME_S == 0, np.arange(5, 9)[:, None], COUNTS)
OHMS, MILLI, CENTI = (TIME_S, KILO_OHMS), (TIME_S, COUNTS / 1000), (TIME_S, COUNTS / 100)
KOHM = {"unit": "kohm"}
IN_MV, IN_KPA = BOTH | {"V_unit": "mV"}, BOTH | {"V_unit": "kPa"}
CHANNEL_SCALES = np.array([[1], [2], [1], [0.5]])
CHANNEL_OFFSETS = np.array([[0], [0], [9.0], [0]])
PACKED = {("V", "scale_factor"): CHANNEL_SCALES.ravel(), ("V", "add_offset"): [0, 0, 9.0, 0]}
RANGE = {("V", "scale_factor"): 0.01, ("V", "valid_range"): [0.0, 10.23], ("V", "units"): "V"}
OHM_ATTRIBUTES = {("run", "sampling_rate"): 10.0, ("run/S", "unit"): "kOhm"}
OHM_ATTRIBUTES |= {("/", "started"): "2026-03-04T12:00:00Z"}
TWO_RATES = {("tactile", "sampling_rate"): 10.0, ("video", "sampling_rate"): 60.0}
UNSIGNED = (COUNTS.T + 33_000).astype("u2").view("i2")
EACH_SERIES = [
    {"name": name, "data": row, "rate": 10.0, "starting_time": start}
    for (name, row), start in zip(LATER.items(), SECONDS, strict=True)
]


def filled(value):
    """Return a matrix whose lost sample is a number."""
    return {"t": TIME_S, "V": np.nan_to_num(LOST, nan=value).T}


def read(file, samples=(TIME_S, COUNTS), **told):
    return Case(file, time_s=samples[0], values=samples[1], **told)


SAID = {
    "vectors in .mat": read(matlab(t=TIME_S, **SENSORS)),
    "vectors in MATLAB 7.3": read(matlab_73(t=TIME_S[:, None], **SENSORS)),
    "a matrix, the time and fs": read(matlab(t=GAP_S, V=COUNTS.T, fs=10.0), (GAP_S, COUNTS)),
    "vectors in HDF5": read(hdf({"time": TIME_S, **SENSORS})),
    "rows of a matrix": read(hdf({"t": GAP_S[None], "V": COUNTS, "fs": 10.0}), (GAP_S, COUNTS)),
    "an archive of numpy": read(saved(np.savez_compressed, "a.npz", t=TIME_S, **SENSORS)),
    "a tall array of numpy": read(saved(np.save, "run.npy", SAMPLES.T)),
    "a wide array of numpy": read(saved(np.save, "run.npy", SAMPLES)),
    "fields of numpy": read(saved(np.save, "run.npy", FIELDS)),
    "fields of HDF5": read(hdf({"table": FIELDS})),
    "a unit named after its array, beside another run": read(
        matlab(a=IN_MV, b=IN_KPA), MILLI, options="--variable a"
    ),
    "a remark on another run": read(
        matlab(a=BOTH, b=BOTH | {"note": "in kPa"}), options="--variable a"
    ),
    "a structure of MATLAB": read(
        matlab(lab={"name": "bench", "run": {"time": TIME_S * 1000, "R": KILO_OHMS.T}}, other=3.0),
        OHMS,
        header=KOHM | {"import_variable": "lab.run"},
    ),
    "the columns of one matrix": read(timed(room=20 + TIME_S % 1, pump=COUNTS[0] + 3)),
    "attributes of groups": read(
        hdf({"run/S": KILO_OHMS}, OHM_ATTRIBUTES), OHMS, header=KOHM | AT_NOON
    ),
    "a sheet with a row of units": read(
        sheets(notes=[["four passes"], ["no fault"]], Run=excel_rows(TIME_S.tolist())),
        OHMS,
        header=KOHM | {"import_sheet": "Run"},
    ),
    "a sheet with dates": read(
        sheets(Run=excel_rows([NOON + timedelta(seconds=t) for t in TIME_S])),
        OHMS,
        header={"started": "2026-03-04T12:00:00"},
    ),
    "NWB with time stamps": read(
        saved(nwb_file, "run.nwb", unit="kohm", timestamps=TIME_S + 100),
        OHMS,
        header=KOHM | {"started": "2026-03-04T12:01:40Z"},
    ),
    "NWB with a rate": read(
        saved(nwb_file, "run.nwb", unit="kohm", rate=10.0), OHMS, header=AT_NOON
    ),
    "channels of TDMS beside another group": read(
        tdms(SENSORS, wf_start_time=NOON64, wf_start_offset=0.0, **APART), header=AT_NOON
    ),
    "a stream on the recorder's clock": read(clocked_xdf, header=AT_NOON),
    **{
        name: read(saved(write, path), header={**AT_NOON, "import_variable": "/capsule"})
        for name, write, path in (
            ("a bag of ROS 1", write_bag_1, "run.bag"),
            ("SQLite of ROS 2", partial(write_bag_2, plugin=StoragePlugin.SQLITE3), "run"),
            ("MCAP of ROS 2", partial(write_bag_2, plugin=StoragePlugin.MCAP), "run"),
        )
    },
    "a first sample far from all others": read(
        matlab(t=TIME_S, V=FAR.T), (TIME_S, FAR), words="the first sample, 5, 6, 7, 8, is far from"
    ),
    "a compressed text": read(gzipped, header={"import_file": "run.csv.gz"}),
    "two rates in HDF5": read(hdf({"tactile": COUNTS.T, "video": np.zeros((3150, 1))}, TWO_RATES)),
    "one start for each data set": read(hdf(LATER, RATES_OF_ALL | STARTS), LATER_READ),
    "one start by its clock for each data set": read(
        hdf(LATER, RATES_OF_ALL | {(n, "start_ms"): 2000 * at for at, n in enumerate(LATER)}),
        LATER_READ,
    ),
    **{
        f"a start that is no date, {began}": read(
            attributed("/", "started", began),
            words=f"the file says that it began {began!r}, which is no date",
            header={"started": None},
        )
        for began in ("March 4, 2026", "9999-12-31T23:59:59-23:00", "soon")
    },
    "a start with a zone": read(
        xdf((TIME_S, [*SENSORS]), started="2026-03-04T12:00:00+0100"),
        header={"started": "2026-03-04T11:00:00Z"},
    ),
    "a start without a zone": read(
        attributed("/", "started", "2026-03-04 12:00:00"), header={"started": "2026-03-04T12:00:00"}
    ),
    "an interval and a rate in words": read(matlab(V=COUNTS.T, dt="100 ms", fs="0.01 kHz")),
    "a unit over several columns": read(named_over_all(["time", *SENSORS], ["s", "mV"]), MILLI),
    "a packing for each column": read(
        hdf(BOTH, PACKED),
        (TIME_S, COUNTS * CHANNEL_SCALES + CHANNEL_OFFSETS),
        options="--unit counts",
    ),
    "fs and freq alike": read(matlab(V=COUNTS.T, freq=10.0, fs=10.0)),
    "packed": read(netcdf("h5netcdf"), CENTI),
    "packed before NetCDF 4": read(netcdf("scipy"), CENTI),
    "packed without a time": read(netcdf("h5netcdf", time=False), CENTI, options="--rate 10"),
    "a fill value": read(hdf(filled(-9), {("V", "_FillValue"): -9.0}), LOST_READ),
    **{
        f"{beyond} beyond the {key}": read(hdf(filled(beyond), {("V", key): limit}), LOST_READ)
        for key, limit, beyond in (
            ("valid_range", [0, 1023], 9999),
            ("valid_range", [0, 1023], -1),
            ("valid_min", 0, -1),
            ("valid_max", 1023, 9999),
        )
    },
    "a range of what packed numbers stand for": read(
        hdf({"t": TIME_S, "V": filled(9999)["V"].astype("i2")}, RANGE), (TIME_S, LOST / 100)
    ),
    "numbers without a sign": read(
        hdf({"t": TIME_S, "V": UNSIGNED}, {("V", "_Unsigned"): "true"}),
        (TIME_S, COUNTS + 33_000),
        options="--unit counts --adc-bits 16",
    ),
    "a scale for each channel": read(
        nwb(rate=10.0, conversion=0.001, channel_conversion=CHANNEL_SCALES.ravel().tolist()),
        (TIME_S, COUNTS / 1000 * CHANNEL_SCALES),
    ),
    "a series for each sensor": read(nwb(*EACH_SERIES), LATER_READ),
    **{
        f"a time for each sensor in {name}": read(write, LATER_READ)
        for name, write in (
            (".mat", matlab(**OWN)),
            (".npz", saved(np.savez, "a.npz", **OWN)),
            ("HDF5", hdf({f"run/{name}": array for name, array in OWN.items()})),
        )
    },
    "a column of times for each sensor": read(
        matlab(t=(TIME_S + 2.0 * np.arange(4)[:, None]).T, V=COUNTS.T),
        (TIME_S[:465], [row[20 * (3 - n) :][:465] for n, row in enumerate(COUNTS)]),
    ),
    "starts of TDMS": read(
        tdms(
            LATER, wf_start_time=[*(NINE + np.arange(4))], wf_start_offset=[0.0, 1, 2, 3], **APART
        ),
        LATER_READ,
    ),
    "offsets of TDMS": read(tdms(LATER, wf_start_offset=SECONDS, **APART), LATER_READ),
    "a group of TDMS for each sensor": read(
        tdms(LATER, group=None, wf_start_offset=SECONDS, **APART), LATER_READ
    ),
    "a sensor at half the rate": read(
        tdms({**SENSORS, "S4": 500 + TIME_S[::2]}, **APART | {"wf_increment": [0.1] * 3 + [0.2]}),
        (TIME_S, [*COUNTS[:3], 500 + TIME_S]),
    ),
    "a sample short": read(tdms(SHORT, **APART), (TIME_S[:-1], COUNTS[:, :-1])),
    "a sample short of its time": read(
        tdms({"Time": TIME_S, **SHORT}, unit_string=["s", *["counts"] * 4]),
        (TIME_S[:-1], COUNTS[:, :-1]),
    ),
    "a gap in XDF": read(xdf((5000 + GAP_S, [*SENSORS])), (GAP_S, COUNTS)),
    "jitter in XDF": read(xdf((5000 + TIME_S + np.tile([0, 0.11, 0], 175), [*SENSORS]))),
    "two streams": read(
        xdf((TIME_S, ["S1", "S2"]), (TIME_S + 4, ["S3", "S4"])),
        (TIME_S[:485], [*COUNTS[:2, 40:], *COUNTS[2:, :485]]),
    ),
    "elapsed times of more than a day": read(
        workbook([timedelta(seconds=86390 + t) for t in TIME_S], number_format="[h]:mm:ss.0")
    ),
    "minutes and seconds": read(
        workbook([(86390 + t) / 86400 for t in TIME_S], number_format="mm:ss.0")
    ),
}


@pytest.mark.parametrize("kind", SAID)
def test_what_a_file_says_counts(tmp_path, kind):
    SAID[kind].check_read(tmp_path, atol=0.03 if "jitter" in kind else 1e-6)


COUNTED, BY_RATE = "--unit counts", "--time none --rate 10"
ABOVE_SHEET = [["Unit", "kPa"], ["time", *SENSORS], *SAMPLES.T.tolist()]
T_NAMES = {f"{name}_T": row for name, row in SENSORS.items()}
# Where a file tells a unit, and how it is quoted.
UNITS = {
    "XDF": (xdf((TIME_S, [*SENSORS]), unit="uV"), "names uV of"),
    "TDMS": (tdms(SENSORS, wf_increment=0.1, unit_string="mmHg"), "names mmHg of"),
    "NI": (tdms(SENSORS, wf_increment=0.1, NI_UnitDescription="kPa"), "names kPa of"),
    "a group of TDMS": (tdms(SENSORS, about={"Unit": "kPa"}, wf_increment=0.1), "names kPa of"),
    "HDF5": (attributed("V", "units", "kPa"), "names kPa of"),
    "a group": (attributed("/", "unit", "kPa"), "names kPa of"),
    "a compound": (hdf({"run": FIELDS}, {("run", "units"): "kPa"}), "names kPa of"),
    "a group's name": (hdf({"p (kPa)/t": TIME_S, "p (kPa)/V": COUNTS.T}), "says 'p (kPa)'"),
    "a structure": (matlab(run=BOTH | {"units": "mmHg"}), "names mmHg of"),
    "each column": (timed(units=np.array(["kPa"] * 4, dtype=object)), "names kPa of"),
    "cells in MATLAB 7.3": (cells_73, "names kPa of"),
    "info": (matlab(run=BOTH | {"info": {"units": "kPa"}}), "says 'units: k"),
    "meta": (timed(meta={"daq": {"unit": "kPa"}}), "says 'unit: kPa'"),
    "a name": (timed(V_unit="kPa"), "names kPa of"),
    "another name": (timed(sensorUnit="kPa"), "says 'sensorUnit: kPa'"),
    "numpy": (saved(np.savez, "a.npz", **BOTH, unit="kPa"), "names kPa of"),
    "a line above a sheet": (sheets(Run=ABOVE_SHEET), "names kPa of"),
    "columns of a sheet": (
        named_over_all(["t", "Pressure (kPa)"], ["s", *SENSORS]),
        "says 'Pressure (kPa)'",
    ),
    "another sheet": (beside(["Unit", "kPa"]), "says 'Unit: kPa'"),
    "a sheet of channels": (beside(["AI0", "kPa", 2]), "says 'AI0: kPa: 2'"),
    "a description": (attributed("V", "description", "N"), "names N of"),
    "a description of NWB": (nwb(series(description="in kPa")), "names counts and kPa of"),
    "a letter behind names": (hdf({"t": TIME_S, **T_NAMES}), "names T of 'S1_T'"),
    "a form": (workbook(TIME_S.tolist(), form='0.00" kPa"'), "names kPa of"),
    **{
        f"the cell {place}, {text}": (workbook(TIME_S.tolist(), more=[(place, text)]), told)
        for place, text, told in (
            ("C1", "pressure in kPa", "says 'pressure in kPa'"),
            ("G1", "all in kPa", "names kPa of"),
            ("H5", "kPa", "names kPa of"),
            ("G1", "N", "names N of"),
            ("H5", "N", "names N of"),
        )
    },
}
SCALES = {
    "beside the arrays": (timed(scale_factor=0.01), "'scale_factor: 0.01'"),
    "of each sensor": (timed(scale=np.array([0.01, 0.01, 0.01, 0.02])), "'scale: 0.01, 0.02'"),
    "of a data set": (attributed("V", "scale", 0.01), "'scale: 0.01'"),
    "of a compound": (hdf({"run": FIELDS}, {("run", "scale"): 0.01}), "'scale: 0.01'"),
    "of TDMS": (tdms(SENSORS, wf_increment=0.1, scale=0.01), "'scale: 0.01'"),
    "of a structure beside": (timed(info={"scale_factor": 0.01}), "'scale_factor: 0.01'"),
    "of a root": (attributed("/", "slope", 0.5), "'slope: 0.5'"),
    "of a sheet of channels": (beside(["Channel", "Gain"], ["AI0", 10]), "'Gain: 10'"),
    "in words": (nwb(series(description="gain of 10")), "'description: gain of 10'"),
    "a name and a number": (nwb(series(description="ScaleFactor 0.5")), ": ScaleFactor 0.5'"),
    "a symbol": (timed(k=0.5), "'k: 0.5'"),
    "of a converter": (attributed("V", "bit_volts", 0.01), "'bit_volts: 0.01'"),
}
# What is stated of the rate, beside times of 10 Hz and without times.
TIMED_RATES = {
    "a number": (timed(fs=50.0), "the file states, fs = 50"),
    "words": (timed(Fs="0.05 kHz"), "the file states, Fs = 50"),
    "a structure": (timed(info={"fs": 50.0}), "the file states, fs = 50"),
    "another sheet": (beside(["Sampling rate", "50 Hz"]), "the file states, Sampling rate = 50"),
    "each column": (attributed("V", "rate", [10.0, 10, 10, 5]), "rate = 5 and another rate = 10"),
}
RATES = {
    "two": (matlab(V=COUNTS.T, fs=10.0, freq=50.0), "fs = 10 and freq = 50"),
    "one of a filter": (matlab(V=COUNTS.T, freq=50.0), "freq = 50"),
    "two in structures": (
        matlab(V=COUNTS.T, fs=10.0, info={"fs": 50.0}),
        "fs = 10 and another fs = 50",
    ),
    "an interval, too": (matlab(V=COUNTS.T, fs=10.0, dt=0.02), "fs = 10 and 1 / dt = 50"),
    "one of a group of TDMS": (
        tdms(SENSORS, about={"sampling_rate": 50.0}, **APART),
        "1 / wf_increment = 10 and sampling_rate = 50",
    ),
}
DELAYS = {(name, "delay"): 2.0 * at for at, name in enumerate(SENSORS)}
DELAYED = hdf(SENSORS, RATES_OF_ALL | DELAYS)
CS = TIME_S * 100
IN_CS = BOTH | {"t": CS}
CLOCKED = attributed("t", "clock", "250 kHz", t=TIME_S * 250_000)
STARTS_MS = {(name, "start_ms"): 1000 * at for at, name in enumerate(LATER)}
CHUNKS = 5 + np.floor(TIME_S / 0.3 + 1e-6) * 0.3 + np.arange(525) % 3 * 1e-4
OVERLOAD = [*TIME_S[:8].tolist(), "overload", *TIME_S[9:].tolist()]
# What a file says that is not understood, or contradicts itself.
ASKED = {
    **{f"unit of {k}": Case(w, f"the file {told}", COUNTED) for k, (w, told) in UNITS.items()},
    **{
        f"scale {k}": Case(w, f"{told}, and not whether it is applied already", COUNTED)
        for k, (w, told) in SCALES.items()
    },
    **{f"rate beside times, {k}": Case(*row, "--time-unit s") for k, row in TIMED_RATES.items()},
    **{
        f"rate, {k}": Case(w, f"states {told}; give the sampling rate in Hz with", "--rate 10")
        for k, (w, told) in RATES.items()
    },
    "a unit of time": Case(attributed("t", "units", "cs", t=CS), "the unit 'cs'", BY_RATE),
    "a clock of another rate": Case(CLOCKED, "the unit 'clock: 250 kHz'", BY_RATE),
    "a time without a unit": Case(matlab(**IN_CS), f"of 0.01 s, 10 Hz ({BY_RATE})", BY_RATE),
    "a time's unit beside": Case(matlab(**IN_CS, time_unit="cs"), "the unit 'cs'", BY_RATE),
    "another name of a start": Case(DELAYED, "sensor 1 names its start, 'delay: 0.0', which is no"),
    "a start by its date that is not that by its clock": Case(
        hdf(LATER, RATES_OF_ALL | STARTS | STARTS_MS),
        "sensor 3 starts 4 s after sensor 1 by its date, '2026-03-04T09:00:04Z', and 2 s by",
    ),
    "stamps of chunks": Case(
        xdf((CHUNKS, [*SENSORS])), "is 1e+04 Hz, but the file states nominal_srate", "--time none"
    ),
    "a stamp that jumps": Case(
        xdf((TIME_S + 2e5 * (TIME_S == 30), [*SENSORS])), "sample 302: time runs backwards", BY_RATE
    ),
    "a formula": Case(
        workbook(TIME_S.tolist(), lambda count: f"={count}+0"),
        f"B2: the formula '={COUNTS[0, 0]:.0f}+0'",
    ),
    "a start of some": Case(
        tdms(LATER, wf_start_time=[NINE, None, NINE, NINE], **APART),
        "'2026-03-04T09:00:00.000000Z', but sensor 2 names none",
    ),
    "lengths without a rate": Case(
        tdms({**SENSORS, "S4": COUNTS[3][::2]}, unit_string="counts", wf_start_offset=0.0),
        "'S4' has 263 samples, but 'S3' has 525",
        options="--rate 10",
    ),
    "LabChart for MATLAB": Case(
        matlab(data=COUNTS.ravel(), datastart=525 * np.arange(4) + 1, dataend=525),
        "LabChart's export for MATLAB",
        options=COUNTED,
    ),
    "a cell of a sheet that is no number": Case(
        workbook(OVERLOAD), "row 10, column 'time': 'overload'"
    ),
    "an array of objects": Case(
        saved(np.save, "run.npy", np.array([{}], dtype=object)), "file cannot be read"
    ),
    "an image": Case(saved(np.save, "run.npy", np.zeros((300, 400))), "file holds no table"),
}


@pytest.mark.parametrize("kind", ASKED)
def test_what_is_not_understood_is_quoted_with_a_remedy_that_works(tmp_path, kind):
    ASKED[kind].check_asked(tmp_path)


def test_what_is_no_table_is_named_with_a_remedy_that_works(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    frame = pandas.DataFrame({"time": TIME_S, **SENSORS})
    frame.to_pickle("run.pkl")
    frame.to_parquet("run2.parquet")
    frame.to_json("run3.json", orient="records")
    frame.to_json("run4.json", orient="records", lines=True)
    for name in ("run.pkl", "run2.parquet", "run3.json", "run4.json"):
        refused = import_files(tmp_path / name, Path(name)).refused
        (remedy,) = re.findall(r"text: pandas\.(.*)", refused)
        remedy, _, each_line = remedy.partition(", with lines=True if each")
        assert bool(each_line) == name.endswith("json")
        remedy = remedy.replace("')", "', lines=True)", 1) if name == "run4.json" else remedy
        eval(f"pandas.{remedy}")
        imported = import_files(tmp_path / f"{name} read", Path(name).with_suffix(".csv"))
        assert_readings(imported.the_recording(), TIME_S, COUNTS)
    with zipfile.ZipFile("run.zip", "w") as archive:
        archive.write("run.csv")
    assert "holds 'run.csv'; unpack it" in import_files(tmp_path, Path("run.zip")).refused


def test_of_several_variables_one_is_asked_for(tmp_path):
    runs = {f"run{n}": {"t": TIME_S, "V": COUNTS + n} for n in (1, 2)}
    write_matlab(tmp_path / "runs.mat", runs)
    imported = import_files(tmp_path, tmp_path / "runs.mat")
    assert (
        "runs.mat: 2 of its parts can be the recording: 'run1', 'run2'; name one with --variable, "
        "or use --variable all if each one is a run"
    ) in imported.refused
    imported = import_files(tmp_path, tmp_path / "runs.mat", "--variable", "run2")
    assert_readings(imported.the_recording(), TIME_S, COUNTS + 2)
    imported = import_files(tmp_path, tmp_path / "runs.mat", "--variable", "run3")
    assert "variable: there is no 'run3'; did you mean 'run2'?" in imported.refused
    both = import_files(tmp_path / "both", tmp_path / "runs.mat", "--variable", "all")
    assert list(both.recordings()) == ["3mm/runs-run1", "3mm/runs-run2"]


def test_nwb_series_that_share_their_time_stamps(tmp_path):
    first = pynwb.TimeSeries(name="sensors", data=KILO_OHMS.T, unit="kohm", timestamps=TIME_S + 9)
    other = pynwb.TimeSeries(name="more", data=KILO_OHMS.T + 1, unit="kohm", timestamps=first)
    file = pynwb.NWBFile("capsule", "run-1", STARTED)
    file.add_acquisition(first)
    file.add_stimulus(other)
    with pynwb.NWBHDF5IO(str(tmp_path / "run.nwb"), "w") as stream:
        stream.write(file)
    imported = import_files(tmp_path, tmp_path / "run.nwb", "--variable", "more")
    assert_readings(imported.the_recording(), TIME_S, KILO_OHMS + 1)


def test_floats_come_in_to_the_bit_as_pandas_reads_them(tmp_path):
    values = 12 + np.random.default_rng(3).normal(size=(200, 4))
    frame = pandas.DataFrame(values, columns=["S1", "S2", "S3", "S4"])
    frame.insert(0, "time (s)", np.arange(200) / 10)
    frame.to_csv(tmp_path / "run.csv", index=False)
    frame.to_excel(tmp_path / "book.xlsx", index=False)
    for path, read in (("run.csv", pandas.read_csv), ("book.xlsx", pandas.read_excel)):
        imported = import_files(tmp_path / path[:4], tmp_path / path, "--unit", "kohm")
        oracle = read(tmp_path / path).to_numpy()[:, 1:].T
        np.testing.assert_array_equal(imported.the_recording().values, oracle)


def test_numbers_that_a_workbook_stores_as_text_are_read_from_csv(tmp_path):
    rows = [[f"{value:.3f}".replace(".", ",") for value in row] for row in [TIME_S, *COUNTS / 200]]
    table = pandas.DataFrame(
        dict(zip(("t (s)", *(f"S{n} (V)" for n in "1234")), rows, strict=True))
    )
    table.to_excel(tmp_path / "run.xlsx", index=False)
    assert "as text, save it as CSV" in import_files(tmp_path, tmp_path / "run.xlsx").refused
    table.to_csv(tmp_path / "run.csv", index=False, sep=";")
    read = import_files(tmp_path, tmp_path / "run.csv").the_recording()
    assert np.allclose(read.values, COUNTS / 200, atol=5e-4)


SHIPPED = {
    ".mat": Path(scipy.io.__file__).parent / "matlab/tests/data",
    ".tdms": Path(nptdms.__file__).parent / "test/data",
    ".h5": Path(h5py.__file__).parent / "tests/data_files",
}


@pytest.mark.parametrize("ending", SHIPPED)
def test_real_files_come_in_or_are_refused_in_a_line(tmp_path, ending):
    files = sorted(SHIPPED[ending].glob(f"*{ending}"))
    assert len(files) > 2
    files = files[:: max(1, len(files) // 10)]  # scipy ships more than a hundred
    imported = import_files(tmp_path, *files)
    lines = imported.refused.splitlines()
    assert all(line.startswith("refused: ") and ": " in line[9:] for line in lines)
    assert len(lines) + imported.shown.count("  wrote ") >= len(files)


def test_what_is_read_of_a_stream_that_is_cut_off_bears_a_note(tmp_path):
    path = xdf((TIME_S, [*SENSORS]))(tmp_path)
    assert "may be incomplete" not in import_files(tmp_path, path, "--dry-run").shown
    path.write_bytes(path.read_bytes()[:-30])
    told = "note: the stream has no end: the file may be incomplete"
    assert told in import_files(tmp_path, path, "--dry-run").shown


def test_without_the_package_the_extra_is_named(tmp_path, monkeypatch):
    path = tdms(SENSORS, **APART)(tmp_path)
    monkeypatch.setitem(sys.modules, "nptdms", None)
    told = "the TDMS file is read by the package nptdms, which is not installed; run in "
    told += f'{ROOT}: pip install -e ".[formats]"'
    assert told in import_files(tmp_path, path).refused
