"""Write files of a laboratory, each with the library of its format."""

import struct
from datetime import UTC, datetime

import h5py
import nptdms
import numpy as np
import openpyxl
import pynwb
import scipy.io
from pynwb.testing.mock.ecephys import mock_ElectricalSeries
from rosbags.rosbag1 import Writer as Bag1
from rosbags.rosbag2 import Writer as Bag2
from rosbags.typesys import Stores, get_typestore

from support.project import ROOT

# A recording of the shipped archive: a limit may meet it that shorter ones do not reach.
TIME_S, *COUNTS = np.loadtxt(ROOT / "raw/3mm/r07.csv", delimiter=",", comments=["#", "t"]).T
COUNTS = np.array(COUNTS)
# Resistances that fit no other unit. A float of MATLAB is restored exactly.
KILO_OHMS = 12 + np.sin(2 * np.pi * TIME_S / 3.2 + np.arange(4)[:, None])
STARTED = datetime(2026, 3, 4, 12, tzinfo=UTC)


def write_matlab(path, **content):
    scipy.io.savemat(path, content)


def write_matlab_73(path, **content):
    """Write HDF5 as MATLAB does: after a block of MATLAB, with transposed arrays and classes.

    A text is an array of characters, and a list of texts a cell.
    """
    with h5py.File(path, "w", userblock_size=512) as file:

        def put(name, kind, array):
            file[name] = array
            file[name].attrs["MATLAB_class"] = np.bytes_(kind)
            return file[name].ref

        def put_text(name, text):
            return put(name, "char", np.frombuffer(text.encode("utf-16-le"), np.uint16)[:, None])

        for name, each in {"note": "bench 2", **content}.items():
            if isinstance(each, str):
                put_text(name, each)
            elif isinstance(each, list):
                parts = [put_text(f"#refs#/{n}", text) for n, text in enumerate(each)]
                put(name, "cell", np.array([parts], h5py.ref_dtype))
            else:
                put(name, "double", np.asarray(each).T)
    content = path.read_bytes()
    mark = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path.write_bytes(mark.ljust(512, b"\x00") + content[512:])


def write_hdf(path, arrays, told=()):
    """Write arrays by their paths, and attributes by (path, name)."""
    with h5py.File(path, "w") as file:
        for name, array in arrays.items():
            file[name] = array
        for (name, key), value in dict(told).items():
            file[name].attrs[key] = value


def write_tdms(path, rows, *, group="g", about=None, **properties):
    """Write a channel for each row; a property can be a list, one for each.

    Without a name for all, each channel has a group of its own.
    """
    channels = []
    for number, (name, row) in enumerate(rows.items()):
        own = {key: v[number] if isinstance(v, list) else v for key, v in properties.items()}
        own = {key: value for key, value in own.items() if value is not None}
        channels.append(nptdms.ChannelObject(group or name, name, row.astype(float), own))
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment([*([nptdms.GroupObject(group, about)] if about else []), *channels])


def write_workbook(path, **sheets):
    book = openpyxl.Workbook()
    book.remove(book.active)
    for title, rows in sheets.items():
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append(row)
    book.save(path)


def excel_rows(first):
    head = [["Bench 2"], [], ["time", "S1", "S2", "S3", "S4"], ["s", *["kohm"] * 4]]
    return head + [[t, *sample] for t, sample in zip(first, KILO_OHMS.T.tolist(), strict=True)]


def write_nwb(path, *series, **electrical):
    """Write time series, or counts as an electrical series."""
    file = pynwb.NWBFile("capsule", "run-1", STARTED)
    if electrical:
        mock_ElectricalSeries(nwbfile=file, name="run", data=COUNTS.T, **electrical)
    for each in series:
        file.add_acquisition(each)
    with pynwb.NWBHDF5IO(str(path), "w") as stream:
        stream.write(file)


def write_bag(path, plugin=None):
    """Write a topic of arrays and another one as a bag of ROS 1, or of ROS 2 in a storage."""
    types = get_typestore(Stores.ROS2_HUMBLE if plugin else Stores.ROS1_NOETIC)
    encode = types.serialize_cdr if plugin else types.serialize_ros1
    array = types.types["std_msgs/msg/Float64MultiArray"]
    layout = types.types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    text = types.types["std_msgs/msg/String"](data="on")
    with Bag2(path, version=9, storage_plugin=plugin) if plugin else Bag1(path) as bag:
        topic = bag.add_connection("/capsule", array.__msgtype__, typestore=types)
        log = bag.add_connection("/log", text.__msgtype__, typestore=types)
        for t, sample in zip(TIME_S, COUNTS.T, strict=True):
            stamp = int(STARTED.timestamp()) * 10**9 + round(t * 1e9)
            message = array(layout=layout, data=sample.copy())
            bag.write(topic, stamp, encode(message, topic.msgtype))
            bag.write(log, stamp, encode(text, log.msgtype))


def xdf_stream(number, name, stamps, values, labels, unit, offset_s=0.0):
    """Return a stream of (C, K) numbers at K stamps of the sender's clock.

    The recorder's clock is ahead of the sender's by `offset_s`.
    """
    channels = "".join(
        f"<channel><label>{label}</label><unit>{unit}</unit></channel>" for label in labels
    )
    header = (
        f"<?xml version='1.0'?><info><name>{name}</name><type>tactile</type>"
        f"<channel_count>{len(labels)}</channel_count><nominal_srate>10</nominal_srate>"
        f"<channel_format>double64</channel_format><created_at>1</created_at>"
        f"<desc><channels>{channels}</channels></desc></info>"
    )
    # A mark for a time stamp of eight bytes stands before each.
    samples = b"".join(
        b"\x08" + struct.pack(f"<d{len(labels)}d", stamp, *sample)
        for stamp, sample in zip(stamps, values.T, strict=True)
    )
    footer = (
        f"<?xml version='1.0'?><info><first_timestamp>{stamps[0]}</first_timestamp>"
        f"<last_timestamp>{stamps[-1]}</last_timestamp>"
        f"<sample_count>{len(stamps)}</sample_count></info>"
    )
    offsets = [(4, struct.pack("<dd", stamps[at], offset_s)) for at in (0, len(stamps) // 2, -1)]
    count = b"\x04" + struct.pack("<I", len(stamps))
    parts = [(2, header.encode()), (3, count + samples), *offsets, (6, footer.encode())]
    return b"".join(xdf_chunk(tag, struct.pack("<I", number) + part) for tag, part in parts)


def xdf_chunk(tag, content):
    """Return a chunk of specification 1.0 (github.com/sccn/xdf), behind four bytes of its length.

    Tags are 1 for the file's header, 2 for a stream's, 3 for samples, 4 for an offset of the clock,
    and 6 for a stream's end.
    """
    return b"\x04" + struct.pack("<IH", len(content) + 2, tag) + content


def write_xdf(path, *streams, started="2026-03-04T12:00:00+0000"):
    """Write streams, each given by what `xdf_stream` takes behind its number."""
    head = f"<?xml version='1.0'?><info><version>1.0</version><datetime>{started}</datetime></info>"
    parts = [xdf_stream(number, *each) for number, each in enumerate(streams, start=1)]
    path.write_bytes(b"XDF:" + xdf_chunk(1, head.encode()) + b"".join(parts))


def wave(hertz, seconds):
    """Return times, and counts of four sensors under a wave with a period of 3.2 s."""
    time_s = np.arange(round(seconds * hertz)) / hertz
    delays = np.arange(4)[:, None] * 6.3 / 25
    return time_s, np.rint(512 + 60 * np.sin(2 * np.pi * (time_s - delays) / 3.2))


def write_examples(folder):
    """Write the example files of docs/import.md."""
    time_s, counts = wave(40, 30)
    rows = ["Zeit (ms);S1;S2;S3;S4;Akku"]
    rows += [
        f"{1000 * t:.0f};" + ";".join(f"{value:.0f}" for value in sample) + ";3,71"
        for t, sample in zip(time_s, counts.T, strict=True)
    ]
    (folder / "monday.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    tens, slow = wave(10, 30)
    rows = ["ms;S1;S2;S3;S4"]
    for t, sample in zip(tens, 4 * slow.T, strict=True):
        rows.append(f"{1000 * t:.0f};" + ";".join(f"{value:,.0f}" for value in sample))
    (folder / "tuesday.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    rows = ["12:34:55.120 -> Logger ready", "12:34:55.310 -> 12,503"]
    for t, sample in zip(tens, slow.T, strict=True):
        stamp = datetime.fromtimestamp(45_295.5 + t, UTC).time().isoformat("milliseconds")
        rows.append(f"{stamp} -> " + ", ".join(f"S{n}:{x:.0f}" for n, x in enumerate(sample, 1)))
    (folder / "log.txt").write_text("\n".join(rows) + "\n", encoding="utf-8")
    for name, row in zip(("left", "right", "up", "down"), slow, strict=True):
        lines = [f"{t:.1f},{value:.0f}" for t, value in zip(tens, row, strict=True)]
        (folder / f"{name}.csv").write_text("\n".join(["t,counts", *lines]) + "\n")
    write_matlab(folder / "run.mat", bench={"t": TIME_S, "R": KILO_OHMS.T})
    write_workbook(folder / "lab.xlsx", **{f"Run {n}": excel_rows(TIME_S.tolist()) for n in (1, 2)})
    told = {("run/readings", "unit"): "kohm", ("run", "sampling_rate"): 10.0}
    write_hdf(folder / "run.h5", {"run/readings": KILO_OHMS}, told)
    series = pynwb.TimeSeries(name="sensors", data=KILO_OHMS.T, unit="kohm", rate=10.0)
    write_nwb(folder / "run.nwb", series)
    rows = {f"AI{n}": row / 10 for n, row in enumerate(KILO_OHMS)}
    write_tdms(folder / "run.tdms", rows, group="capsule", wf_increment=0.1, unit_string="V")
    names = ["S1", "S2", "S3", "S4"]
    write_xdf(folder / "run.xdf", ("capsule", TIME_S + 5000, COUNTS, names, "counts"))
    write_bag(folder / "run.bag")
