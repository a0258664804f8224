"""Import of each format: from a file of its own library, and from files that packages ship."""

import os
import re
import shutil
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

from support import lab_files as lab
from support.importing import Case, assert_readings, import_files
from support.lab_files import COUNTS, KILO_OHMS, TIME_S, excel_rows
from support.project import ROOT

SENSORS = {f"S{n}": row for n, row in enumerate(COUNTS, start=1)}
GAP_S = TIME_S + 3 * (TIME_S > 20)
# Sensor n starts 2 n s later than the first; what all have in common begins 6 s later.
LATER = {name: row[20 * n :][:465] for n, (name, row) in enumerate(SENSORS.items())}
NINE = np.datetime64("2026-03-04T09:00:00")
ALL, HEAD = [*SENSORS], ["time", *SENSORS]


def rows(times=TIME_S, change=int):
    """Return the rows of a sheet; `change` makes the cells of a sample."""
    return [HEAD, *([t, *map(change, each)] for t, each in zip(times, COUNTS.T, strict=True))]


def saved(save, name, *content, **named):
    """Return what saves a file under a name, or a bag, by a function of a library."""

    def write(folder):
        save(folder / name, *content, **named)
        return folder / name

    return write


def named(name):
    """Return a decorator: what writes to a path becomes what returns a writer of such a file."""
    return lambda write: partial(saved, write, name)


hdf, tdms = named("run.h5")(lab.write_hdf), named("run.tdms")(lab.write_tdms)
nwb, xdf = named("run.nwb")(lab.write_nwb), named("run.xdf")(lab.write_xdf)
matlab, matlab_73 = named("run.mat")(lab.write_matlab), named("run.mat")(lab.write_matlab_73)
sheets = named("lab.xlsx")(lab.write_workbook)


@named("run.nc")
def netcdf(path, engine, *, time=True):
    """Write the sensors as packed variables, in volts."""
    data = xarray.Dataset({n: ("time", row / 100, {"units": "V"}) for n, row in SENSORS.items()})
    data = data.assign_coords(time=NINE + (TIME_S * 1e6).astype("m8[us]")) if time else data
    packed = {"dtype": "int16", "scale_factor": 0.01, "add_offset": 4.0, "_FillValue": -1}
    data.to_netcdf(path, engine=engine, encoding=dict.fromkeys(SENSORS, packed))


series = partial(pynwb.TimeSeries, name="run", data=COUNTS.T, unit="counts", rate=10.0)


def stream(stamps, names=ALL, unit="counts", offset_s=0.0):
    """Return a stream of sensors for a file of XDF."""
    return "run", stamps, np.array([SENSORS[name] for name in names]), names, unit, offset_s


@named("run.xlsx")
def workbook(path, *rows, states="", **more):
    """Write rows of a sheet; the second of two cells stands over all sensors.

    The sheet can state a size. `more` holds the format of a column's numbers, the text of a cell,
    and a remark on a filled one.
    """
    book = openpyxl.Workbook()
    sheet = book.active
    for at, row in enumerate(rows, start=1):
        sheet.append(row)
        if len(row) == 2:
            sheet.merge_cells(f"B{at}:E{at}")
    for place, text in more.items():
        if place.isalpha():
            for cell in sheet[place]:
                cell.number_format = text
        elif sheet[place].value is None:
            sheet[place] = text
        else:
            sheet[place].comment = openpyxl.comments.Comment(text, "lab")
    if states:
        sheet.calculate_dimension = lambda: states
    book.save(path)


# A time and a matrix; for MATLAB, with what is said beside them.
BOTH = {"t": TIME_S, "V": COUNTS.T}
timed = partial(matlab, **BOTH)


def attributed(path, name, value, **arrays):
    """Return what writes a matrix and its time as HDF5, with an attribute."""
    return hdf(BOTH | arrays, {(path, name): value})


def read(file, samples=(TIME_S, COUNTS), options="", words="", **header):
    return Case(file, words, "", options, samples[1], samples[0], header)


TABLE = pandas.DataFrame({"time": TIME_S, **SENSORS})
FIELDS = TABLE.to_records(index=False)
NOON = datetime(2026, 3, 4, 12)
NOON_SHARP = {"wf_start_time": np.datetime64(NOON), "wf_start_offset": 0.0}
AT_NOON = "2026-03-04T12:00:00Z"
APART = {"wf_increment": 0.1, "unit_string": "counts"}
RATES_OF_ALL = {(name, "sampling_rate"): 10.0 for name in LATER}
STARTS = RATES_OF_ALL | {(name, "start"): f"{NINE + 2 * at}Z" for at, name in enumerate(LATER)}
CLOCKS = RATES_OF_ALL | {(name, "start_ms"): 2000 * at for at, name in enumerate(LATER)}
# The last sensor ends a sample earlier.
OWN = {f"t{n + 1}": TIME_S[:465] + 2.0 * n for n in range(4)} | LATER
OWN |= {"t4": OWN["t4"][:-1], "S4": OWN["S4"][:-1]}
SHORT, SHORT_READ = {**SENSORS, "S4": COUNTS[3][:-1]}, (TIME_S[:-1], COUNTS[:, :-1])
TIMED_SHORT, OF_EACH = {"Time": TIME_S, **SHORT}, ["s", *["counts"] * 4]
HALF, HALF_RATE = {**SENSORS, "S4": 500 + TIME_S[::2]}, APART | {"wf_increment": [0.1] * 3 + [0.2]}
FAR = np.where(TIME_S == 0, np.arange(5, 9)[:, None], COUNTS)
# What is read.
IN_KOHM, IN_MV, IN_CV = (TIME_S, KILO_OHMS), (TIME_S, COUNTS / 1000), (TIME_S, COUNTS / 100)
FROM_6_S, GAP = (np.arange(405) / 10, COUNTS[:, 60:465]), (GAP_S, COUNTS)
LOST = (TIME_S, np.where(TIME_S == 5, np.nan, COUNTS))
COLUMNS = TIME_S + 2.0 * np.arange(4)[:, None]
COLUMNS_READ = (TIME_S[:465], [row[20 * (3 - n) :][:465] for n, row in enumerate(COUNTS)])
MV, KPA = BOTH | {"V_unit": "mV"}, BOTH | {"V_unit": "kPa"}
NOTED = BOTH | {"note": "in kPa"}
LAB = {"name": "bench", "run": {"time": TIME_S * 1000, "R": KILO_OHMS.T}}
CHANNEL_SCALES, OFFSETS = np.array([[[1], [2], [1], [0.5]], [[0], [0], [9.0], [0]]])
PACKED = {("V", "scale_factor"): CHANNEL_SCALES.ravel(), ("V", "add_offset"): OFFSETS.ravel()}
UNPACKED = (TIME_S, COUNTS * CHANNEL_SCALES + OFFSETS)
RANGE = {("V", "scale_factor"): 0.01, ("V", "valid_range"): [0.0, 10.23], ("V", "units"): "V"}
# Numbers in place of a lost sample, and what tells so.
FILLED = {number: np.nan_to_num(LOST[1], nan=number).T for number in (9999, -1, -9)}
SMALL = {"t": TIME_S, "V": FILLED[9999].astype("i2")}
OF_GROUPS = {("run", "sampling_rate"): 10.0, ("run/S", "unit"): "kOhm", ("/", "started"): AT_NOON}
OF_GROUPS = hdf({"run/S": KILO_OHMS}, OF_GROUPS)
TWO_RATES = {("tactile", "sampling_rate"): 10.0, ("video", "sampling_rate"): 60.0}
UNSIGNED = attributed("V", "_Unsigned", "true", V=(COUNTS.T + 33_000).astype("u2").view("i2"))
GAINS = {"conversion": 0.001, "channel_conversion": CHANNEL_SCALES.ravel().tolist(), "rate": 10.0}
EACH = [series(name=n, data=row, starting_time=2.0 * t) for t, (n, row) in enumerate(LATER.items())]
FIRST, STAMPED = [series(rate=None, timestamps=TIME_S + 9) for _ in range(2)]
ALIKE = series(name="more", data=COUNTS.T + 1, rate=None, timestamps=FIRST)
DATES = [NOON + timedelta(seconds=t) for t in TIME_S]
DAYS = [timedelta(seconds=86_390 + t) for t in TIME_S]
PARTS = ((86_390 + TIME_S) / 86_400).tolist()
NOTES, S_AND_KOHM = [["four passes"], ["no fault"]], excel_rows(TIME_S.tolist())
STREAMS = xdf(stream(TIME_S, ["S1", "S2"]), stream(TIME_S + 4, ["S3", "S4"]))
# The recorder has measured the clock of a stream; another stream is of another kind.
MEASURED = xdf(stream(TIME_S + 5000, offset_s=-4000.0), stream(TIME_S, ["S1"], "kPa"))
FROM_BAG = {"started": AT_NOON, "import_variable": "/capsule"}
LIMITS = [("valid_range", [0, 1023], 9999), ("valid_range", [0, 1023], -1)]
LIMITS += [("valid_min", 0, -1), ("valid_max", 1023, 9999), ("_FillValue", -9.0, -9)]
NO_DATE = attributed("/", "started", "March 4, 2026")
TOO_LATE = attributed("/", "started", "9999-12-31T23:59:59-23:00")
STARTS_TDMS = {"wf_start_time": [*(NINE + np.arange(4))], "wf_start_offset": [0.0, 1, 2, 3]}
OFFSET = APART | {"wf_start_offset": [2.0 * n for n in range(4)]}

SAID = {
    "vectors in .mat": read(matlab(t=TIME_S, **SENSORS)),
    "a matrix, the time and fs": read(matlab(t=GAP_S, V=COUNTS.T, fs=10.0), GAP),
    "vectors in HDF5": read(hdf({"time": TIME_S, **SENSORS})),
    "rows of a matrix": read(hdf({"t": GAP_S[None], "V": COUNTS, "fs": 10.0}), GAP),
    "an archive of numpy": read(saved(np.savez_compressed, "a.npz", t=TIME_S, **SENSORS)),
    "a tall array of numpy": read(saved(np.save, "a.npy", np.vstack([TIME_S, COUNTS]).T)),
    "a unit named after its array": read(matlab(a=MV, b=KPA), IN_MV, "--variable a"),
    "a remark on another run": read(matlab(a=BOTH, b=NOTED), options="--variable a"),
    "a structure": read(matlab(lab=LAB, n=3.0), IN_KOHM, unit="kohm", import_variable="lab.run"),
    "the columns of one matrix": read(timed(room=20 + TIME_S % 1, pump=COUNTS[0] + 3)),
    "attributes of groups": read(OF_GROUPS, IN_KOHM, unit="kohm", started=AT_NOON),
    "a row of units": read(sheets(notes=NOTES, Run=S_AND_KOHM), IN_KOHM, import_sheet="Run"),
    "a sheet that states too few rows": read(workbook(*S_AND_KOHM, states="A1:C60"), IN_KOHM),
    "a sheet with dates": read(sheets(Run=excel_rows(DATES)), IN_KOHM, started=AT_NOON[:-1]),
    "NWB with time stamps": read(nwb(STAMPED), started="2026-03-04T12:00:09Z"),
    "NWB with a rate": read(nwb(series()), started=AT_NOON),
    "shared time stamps": read(nwb(FIRST, ALIKE), (TIME_S, COUNTS + 1), "--variable more"),
    "channels of TDMS": read(tdms(SENSORS, **NOON_SHARP, **APART), started=AT_NOON),
    "a stream on the recorder's clock": read(MEASURED, started=AT_NOON),
    "a bag of ROS 1": read(saved(lab.write_bag, "run.bag"), **FROM_BAG),
    "a bag of ROS 2": read(saved(lab.write_bag, "run", StoragePlugin.MCAP), **FROM_BAG),
    "a far first sample": read(timed(V=FAR.T), (TIME_S, FAR), words="first sample, 5, 6, 7, 8, is"),
    "a compressed text": read(saved(TABLE.to_csv, "a.csv.gz", index=False), import_file="a.csv.gz"),
    "two rates in HDF5": read(hdf({"tactile": COUNTS.T, "video": np.zeros((3150, 1))}, TWO_RATES)),
    "a start for each data set": read(hdf(LATER, STARTS), FROM_6_S),
    "a start by its clock for each data set": read(hdf(LATER, CLOCKS), FROM_6_S),
    "a start that is no date": read(NO_DATE, words="began 'March 4, 2026', which", started=None),
    "a start that never was": read(TOO_LATE, words="T23:59:59-23:00', which", started=None),
    "a zone": read(xdf(stream(TIME_S), started="2026-03-04T13:00:00+0100"), started=AT_NOON),
    "a start without a zone": read(attributed("/", "started", f"{NOON}"), started=AT_NOON[:-1]),
    "an interval and a rate in words": read(matlab(V=COUNTS.T, dt="100 ms", fs="0.01 kHz")),
    "a unit over several columns": read(workbook(HEAD, ["s", "mV"], *rows()[1:]), IN_MV),
    "a packing for each column": read(hdf(BOTH, PACKED), UNPACKED, "--unit counts"),
    "fs and freq alike": read(matlab(V=COUNTS.T, freq=10.0, fs=10.0)),
    "packed": read(netcdf("h5netcdf"), IN_CV),
    "packed before NetCDF 4": read(netcdf("scipy"), IN_CV),
    "packed without a time": read(netcdf("h5netcdf", time=False), IN_CV, "--rate 10"),
    **{
        f"{lost} by the {key}": read(attributed("V", key, told, V=FILLED[lost]), LOST)
        for key, told, lost in LIMITS
    },
    "a range of what packed numbers stand for": read(hdf(SMALL, RANGE), (TIME_S, LOST[1] / 100)),
    "no sign": read(UNSIGNED, (TIME_S, COUNTS + 33_000), "--unit counts --adc-bits 16"),
    "a scale for each channel": read(nwb(**GAINS), (TIME_S, COUNTS / 1000 * CHANNEL_SCALES)),
    "a series for each sensor": read(nwb(*EACH), FROM_6_S),
    "a time for each sensor in .mat": read(matlab(**OWN), FROM_6_S),
    "a column of times for each sensor": read(matlab(t=COLUMNS.T, V=COUNTS.T), COLUMNS_READ),
    "starts of TDMS": read(tdms(LATER, **STARTS_TDMS, **APART), FROM_6_S),
    "a group of TDMS for each sensor": read(tdms(LATER, group=None, **OFFSET), FROM_6_S),
    "half the rate": read(tdms(HALF, **HALF_RATE), (TIME_S, [*COUNTS[:3], 500 + TIME_S])),
    "a sample short": read(tdms(SHORT, **APART), SHORT_READ),
    "a sample short of its time": read(tdms(TIMED_SHORT, unit_string=OF_EACH), SHORT_READ),
    "a gap in XDF": read(xdf(stream(5000 + GAP_S)), GAP),
    "jitter in XDF": read(xdf(stream(5000 + TIME_S + np.tile([0, 0.11, 0], 175)))),
    "two streams": read(STREAMS, (TIME_S[:485], [*COUNTS[:2, 40:], *COUNTS[2:, :485]])),
    "more than a day": read(workbook(*rows(DAYS), A="[h]:mm:ss.0")),
    "minutes and seconds": read(workbook(*rows(PARTS), A="mm:ss.0")),
}


@pytest.mark.parametrize("kind", SAID)
def test_what_a_file_says_counts(tmp_path, kind):
    SAID[kind].check_read(tmp_path, atol=0.03 if "jitter" in kind else 1e-6)


def outside(path, kind):
    """Write a data set whose samples lie in another file."""
    other, shape = str(path.with_name("other.h5")), COUNTS.T.shape
    lab.write_hdf(other, {"V": COUNTS.T})
    with h5py.File(path, "w") as file:
        if kind == "external":
            file.create_dataset("V", shape, "f8", external=[(other, 0, h5py.h5f.UNLIMITED)])
        elif kind == "virtual":
            layout = h5py.VirtualLayout(shape, "f8")
            layout[...] = h5py.VirtualSource(other, "V", shape)
            file.create_virtual_dataset("V", layout)
        else:
            file["V"] = h5py.ExternalLink(other, "V")


@named("bag")
def linked_bag(path):
    """Write a folder that links to the files of a bag."""
    lab.write_bag(path.with_name("run"), StoragePlugin.MCAP)
    shutil.copytree(path.with_name("run"), path, copy_function=os.symlink)


COUNTED, BY_RATE, TIMED = "--unit counts", "--time none --rate 10", "--time-unit s"
OVER_ALL = [["t", "Pressure (kPa)"], ["s", *SENSORS], *rows()[1:]]
GAIN_SHEET = sheets(Run=rows(), About=[["Channel", "Gain"], ["AI0", 10]])
# Where a file tells a unit, and where a scale, and how it is quoted.
OF_READINGS = {
    "XDF": (xdf(stream(TIME_S, unit="uV")), "names uV of"),
    "TDMS": (tdms(SENSORS, wf_increment=0.1, unit_string="mmHg"), "names mmHg of"),
    "NI": (tdms(SENSORS, wf_increment=0.1, NI_UnitDescription="kPa"), "names kPa of"),
    "a group of TDMS": (tdms(SENSORS, about={"Unit": "kPa"}, wf_increment=0.1), "names kPa of"),
    "HDF5": (attributed("V", "units", "kPa"), "names kPa of"),
    "a compound": (hdf({"run": FIELDS}, {("run", "units"): "kPa"}), "names kPa of"),
    "a group's name": (hdf({"p (kPa)/t": TIME_S, "p (kPa)/V": COUNTS.T}), "says 'p (kPa)'"),
    "a structure": (matlab(run=BOTH | {"units": "mmHg"}), "names mmHg of"),
    "each column": (timed(units=np.array(["kPa"] * 4, dtype=object)), "names kPa of"),
    "cells in MATLAB 7.3": (matlab_73(**BOTH, units=["kPa"] * 4), "names kPa of"),
    "a name": (timed(V_unit="kPa"), "names kPa of"),
    "another name": (timed(sensorUnit="kPa"), "says 'sensorUnit: kPa'"),
    "numpy": (saved(np.savez, "a.npz", **BOTH, unit="kPa"), "names kPa of"),
    "a line above a sheet": (sheets(Run=[["Unit", "kPa"], *rows()]), "names kPa of"),
    "columns of a sheet": (workbook(*OVER_ALL), "says 'Pressure (kPa)'"),
    "another sheet": (sheets(Run=rows(), About=[["Unit", "kPa"]]), "says 'Unit: kPa'"),
    "a description": (attributed("V", "description", "N"), "names N of"),
    "a description of NWB": (nwb(series(description="in kPa")), "names counts and kPa of"),
    "a form": (workbook(*rows(), B='0.00" kPa"'), "names kPa of"),
    "a remark on a cell": (workbook(*rows(), C1="pressure in kPa"), "says 'pressure in kPa'"),
    "words beside names": (workbook(*rows(), G1="all in kPa"), "names kPa of"),
    "a letter beside samples": (workbook(*rows(), H5="N"), "names N of"),
    "scale beside the arrays": (timed(scale_factor=0.01), "'scale_factor: 0.01'"),
    "each scale": (timed(scale=np.array([0.01, 0.01, 0.01, 0.02])), "'scale: 0.01, 0.02'"),
    "scale of a data set": (attributed("V", "slope", 0.01), "'slope: 0.01'"),
    "scale of a compound": (hdf({"run": FIELDS}, {("run", "scale"): 0.01}), "'scale: 0.01'"),
    "scale of a structure": (timed(info={"scale_factor": 0.01}), "'scale_factor: 0.01'"),
    "scale of a sheet of channels": (GAIN_SHEET, "'Gain: 10'"),
    "scale in words": (nwb(series(description="gain of 10")), "'description: gain of 10'"),
}
RATED = {"V": COUNTS.T, "fs": 10.0}
RATE_TDMS = tdms(SENSORS, about={"sampling_rate": 50.0}, **APART)
# What is stated of the rate, beside times of 10 Hz and without times.
STATED = {
    "fs = 50": timed(fs=50.0),
    "Fs = 50": timed(Fs="0.05 kHz"),
    "Sampling rate = 50": sheets(Run=rows(), About=[["Sampling rate", "50 Hz"]]),
    "rate = 5 and another rate = 10": attributed("V", "rate", [10.0, 10, 10, 5]),
}
RATES = {
    "fs = 10 and freq = 50": matlab(**RATED, freq=50.0),
    "states freq = 50": matlab(V=COUNTS.T, freq=50.0),
    "fs = 10 and another fs = 50": matlab(**RATED, info={"fs": 50.0}),
    "1 / wf_increment = 10 and sampling_rate = 50": RATE_TDMS,
}
DELAYED = hdf(SENSORS, RATES_OF_ALL | {(n, "delay"): 2.0 * at for at, n in enumerate(SENSORS)})
IN_CS = BOTH | {"t": TIME_S * 100}
TWO_CLOCKS = STARTS | {(name, "start_ms"): 1000 * at for at, name in enumerate(LATER)}
CLOCKED = attributed("t", "clock", "250 kHz", t=TIME_S * 250_000)
CHUNKS = 5 + np.floor(TIME_S / 0.3 + 1e-6) * 0.3 + np.arange(525) % 3 * 1e-4
OVERLOAD = workbook(*rows([*TIME_S[:8], "overload", *TIME_S[9:]]))
FORMULAS = workbook(*rows(change=lambda count: f"={count:.0f}+0"))
TEXTS = workbook(*rows(change=lambda count: f"{count / 200:.3f}".replace(".", ",")))
SOME_STARTS = tdms(LATER, wf_start_time=[NINE, None, NINE, NINE], **APART)
LENGTHS = tdms({**SENSORS, "S4": COUNTS[3][::2]}, unit_string="counts", wf_start_offset=0.0)
LABCHART = matlab(data=COUNTS.ravel(), datastart=525 * np.arange(4) + 1, dataend=525)
TWO_RUNS = {f"run{n}": {"t": TIME_S, "V": COUNTS + n} for n in (1, 2)}
OUTSIDE, RATED_COUNTS = "the file names samples outside of it, in ", f"--rate 10 {COUNTED}"
# What a file says that is not understood, or contradicts itself.
ASKED = {
    **{kind: Case(file, told, COUNTED) for kind, (file, told) in OF_READINGS.items()},
    **{told: Case(file, f"{told}; give --time-unit", TIMED) for told, file in STATED.items()},
    **{told: Case(file, f"{told}; give the sampling", "--rate 10") for told, file in RATES.items()},
    "a unit of time": Case(attributed("t", "units", "cs", **IN_CS), "the unit 'cs'", BY_RATE),
    "a clock of another rate": Case(CLOCKED, "the unit 'clock: 250 kHz'", BY_RATE),
    "a time's unit beside": Case(matlab(**IN_CS, time_unit="cs"), "the unit 'cs'", BY_RATE),
    "another name of a start": Case(DELAYED, "sensor 1 names its start, 'delay: 0.0', which is no"),
    "two clocks": Case(hdf(LATER, TWO_CLOCKS), "sensor 3 starts 4 s after sensor 1 by its date"),
    "stamps of chunks": Case(xdf(stream(CHUNKS)), "the file states nominal_srate", "--time none"),
    "a formula": Case(FORMULAS, f"B2: the formula '={COUNTS[0, 0]:.0f}+0'"),
    "numbers as text": Case(TEXTS, "as text, save it as CSV"),
    "a word in a sheet": Case(OVERLOAD, "row 10, column 'time': 'overload'"),
    "a start of some": Case(SOME_STARTS, "09:00:00.000000Z', but sensor 2 names none"),
    "no rate": Case(LENGTHS, "'S4' has 263 samples, but 'S3' has 525", options="--rate 10"),
    "LabChart": Case(LABCHART, "LabChart's export for MATLAB", options=COUNTED),
    # Nothing outside of a file or a folder is read.
    "external": Case(saved(outside, "a.h5", "external"), OUTSIDE, "", RATED_COUNTS),
    "virtual": Case(saved(outside, "a.h5", "virtual"), OUTSIDE, "", RATED_COUNTS),
    "linked": Case(saved(outside, "a.h5", "linked"), OUTSIDE, "", RATED_COUNTS),
    "linked in NWB": Case(saved(outside, "a.nwb", "linked"), OUTSIDE, "", RATED_COUNTS),
    "samples outside of a bag": Case(linked_bag(), "outside of this folder; copy it into it"),
    "runs": Case(matlab(**TWO_RUNS), "'run1', 'run2'; name one", "--variable run2", "", COUNTS + 2),
    "objects": Case(saved(np.save, "a.npy", np.array([{}], object)), "file cannot be read"),
    "an image": Case(saved(np.save, "run.npy", np.zeros((300, 400))), "file holds no table"),
}


@pytest.mark.parametrize("kind", ASKED)
def test_what_is_not_understood_is_quoted_with_a_remedy_that_works(tmp_path, kind):
    ASKED[kind].check_asked(tmp_path)


def test_what_is_no_table_is_named_with_a_remedy_that_works(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    TABLE.to_pickle("run.pkl")
    TABLE.to_parquet("run2.parquet")
    TABLE.to_json("run3.json", orient="records")
    TABLE.to_json("run4.json", orient="records", lines=True)
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


def test_each_variable_is_a_run(tmp_path):
    path = matlab(**TWO_RUNS)(tmp_path)
    assert "did you mean 'run2'?" in import_files(tmp_path, path, "--variable", "run3").refused
    imported = import_files(tmp_path, path, "--variable", "all")
    assert list(imported.recordings()) == ["3mm/run-run1", "3mm/run-run2"]


def test_floats_come_in_to_the_bit(tmp_path):
    values = np.round(12 + np.random.default_rng(3).normal(size=(4, 525)), 12)
    frame = pandas.DataFrame({"time (s)": TIME_S, **dict(zip(SENSORS, values, strict=True))})
    for name, save in (("a.csv", frame.to_csv), ("b.xlsx", frame.to_excel)):
        save(tmp_path / name, index=False)
        imported = import_files(tmp_path / f"{name} read", tmp_path / name, "--unit", "kohm")
        np.testing.assert_array_equal(imported.the_recording().values, values)


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
    path = xdf(stream(TIME_S))(tmp_path)
    assert "may be incomplete" not in import_files(tmp_path, path, "--dry-run").shown
    path.write_bytes(path.read_bytes()[:-30])
    told = "note: the stream has no end: the file may be incomplete"
    assert told in import_files(tmp_path, path, "--dry-run").shown


def test_without_the_package_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "nptdms", None)
    told = "the TDMS file is read by the package nptdms, which is not installed; run in "
    told += f'{ROOT}: pip install -e ".[formats]"'
    assert told in import_files(tmp_path, tdms(SENSORS, **APART)(tmp_path)).refused
