"""Read the formats that hold arrays with names: numpy, MATLAB, HDF5, NetCDF and NWB.

What a file says of an array counts for it: its unit, start, sampling rate and scaling.
"""

import io
import struct
import zlib
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.joining import with_own_times
from capsule.importing.lab_yaml import Keys
from capsule.importing.stated import (
    MARK,
    as_remarks,
    as_text,
    decoded,
    facts,
    starts,
    stated_unit,
    states_rate,
    unsure_start,
)
from capsule.importing.table import Channel, Table, with_stamps
from capsule.importing.times import later
from capsule.importing.units import is_time_name
from capsule.recordings.scaling import is_scaling

# The word for a table of these formats.
VARIABLE = "variable"
# A small file that unpacks to more is no recording.
MOST_UNPACKED = 100_000_000
TOO_LARGE = "it is larger than {:g} MB, too large for one session; split it into smaller files"
# A matrix with more columns is probably an image.
_MOST_COLUMNS = 256
_MATLAB_COMPRESSED = 15
# A longer text is no unit and no date.
_LONGEST_TEXT = 100
# Attributes that are applied when an array is read.
_APPLIED = ("scale_factor", "add_offset")
# So are limits, beyond which a sample is missing, with as many numbers.
_LIMITS = {"valid_range": 2, "valid_min": 1, "valid_max": 1}
# NetCDF writes an array under this name for an axis without values.
_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable"


def refuse_unpacked(size: int, most_bytes: int = MOST_UNPACKED) -> None:
    """Raise an error if a small file unpacks to more bytes than one session needs."""
    if size > most_bytes:
        raise CapsuleError(f"unpacked, {TOO_LARGE.format(MOST_UNPACKED / 1e6)}")


def array_tables(
    arrays: Mapping[str, np.ndarray],
    separator: str,
    keys: Keys,
    told: Mapping[str, Mapping[str, Any]],
) -> Iterator[Table]:
    """Yield tables that join arrays, given by path, with the same length and the same parent.

    If none of a parent's tables has enough columns beside the time, all of its arrays are one: a
    sensor can have a sampling rate of its own, or end a sample earlier. They are named by their
    parent, or by their first array if a parent has several tables. `told` holds the attributes of
    each path. A single number is an attribute of its parent. An attribute holds for all below,
    unless a nearer one says something else.
    """
    about: defaultdict[str, dict[str, Any]] = defaultdict(dict)
    about |= {path: dict(said) for path, said in told.items()}
    places = {path: path.rpartition(separator) for path in arrays}
    for path, (parent, _, name) in places.items():
        is_about_all = is_scaling(name) or states_rate(name)
        most = keys.sensor_count if is_about_all else 1
        if 1 <= arrays[path].size <= most and arrays[path].dtype.kind in "iuf":
            about[parent][name] = arrays[path]
    # What a group without a series of its own, as ``info``, says holds for all beside it.
    bearing = {""}
    for path in [path for path, array in arrays.items() if array.size > keys.sensor_count]:
        while path not in bearing:
            bearing.add(path)
            path = path.rpartition(separator)[0]
    for path in [path for path in about if path not in bearing and path not in arrays]:
        said, parent = about[path], path
        while parent not in bearing:
            parent = parent.rpartition(separator)[0]
        for name, value in said.items():
            if states_rate(name):
                about[parent][name] = [as_text(about[parent].get(name, value)), as_text(value)]
    for path, (parent, _, name) in places.items():
        for key in (f"{name}_unit", f"{name}_units"):
            if key in about[parent]:
                about[path].setdefault("unit", about[parent][key])
    groups: defaultdict[str, defaultdict[int, list[tuple[str, Channel]]]]
    groups = defaultdict(lambda: defaultdict(list))
    for path, (parent, _, name) in places.items():
        scopes = _scopes(path, separator, about)
        for channel in array_channels(name, arrays[path], **facts(scopes)):
            groups[parent][channel.values.size].append((path, channel))
    for parent, by_size in groups.items():
        parts = list(by_size.values())
        whole = [each for part in parts for each in part]
        are_timed = len(with_own_times([each for _, each in whole], keys)) < len(whole)
        counts = [sum(not is_time_name(each.name) for _, each in part) for part in parts]
        if are_timed or max(counts) < keys.sensor_count:
            parts = [whole]
        around = _scopes(parent, separator, about)
        others = [f"{each}{separator}" for each in groups if each]
        others = [each for each in others if not f"{parent}{separator}".startswith(each)]
        # What stands in a group of other series says nothing of these.
        remarks = as_remarks(
            said
            for path, said in about.items()
            if not any(f"{path}{separator}".startswith(other) for other in others)
        )
        for part in parts:
            label = parent if len(parts) == 1 and parent else part[0][0].replace("\n", ", ")
            unsure = [unsure_start(_not_starts(about[path])) for path, _ in part]
            if len({*unsure}) > 1:
                part = [
                    (path, replace(each, started=text or each.started))
                    for (path, each), text in zip(part, unsure, strict=True)
                ]
            channels = with_own_times([each for _, each in part], keys)
            compounds = [about[path] for path, _ in part if arrays[path].dtype.names]
            unit = stated_unit(compounds + around, around)
            notes = {"unit": unit} if unit else {}
            yield Table(channels, VARIABLE, label, notes=notes, remarks=remarks)


def _not_starts(said: Mapping[str, Any]) -> list[str]:
    """Return the statements on a series that tell no start which is understood, as words."""
    return as_remarks(
        {key: value} for key, value in said.items() if not starts({key: as_text(value)})
    )


def _scopes(
    path: str, separator: str, about: Mapping[str, dict[str, Any]]
) -> list[Mapping[str, Any]]:
    """Return the attributes of a path, and of all above it."""
    scopes: list[Mapping[str, Any]] = [about.get(path, {})]
    while path:
        path = path.rpartition(separator)[0]
        scopes.append(about.get(path, {}))
    return scopes


def array_channels(name: str, array: np.ndarray, **how: Any) -> list[Channel]:
    """Return an array's columns; none if it is not a series of samples.

    The longer side of a matrix counts samples. `how` holds what the file says of all columns.
    """
    columns: dict[str, np.ndarray] = {}
    squeezed = np.squeeze(array)
    if array.size > 1 and array.dtype.names and array.ndim == 1:
        how["unit"] = ""
        fields = [field for field in array.dtype.names if array.dtype[field].kind in "iuf"]
        columns = {field: array[field] for field in fields}
    elif array.size > 1 and array.dtype.kind in "iufb" and squeezed.ndim == 1:
        columns = {name: squeezed}
    elif array.size > 1 and array.dtype.kind in "iufb" and squeezed.ndim == 2:
        wide = squeezed if squeezed.shape[0] < squeezed.shape[1] else squeezed.T
        if len(wide) <= _MOST_COLUMNS:
            columns = {f"{name}({n})": column for n, column in enumerate(wide, start=1)}
    return [Channel(key, column.astype(float), **how) for key, column in columns.items()]


def read_numpy(content: bytes, _: Keys) -> Iterator[Table]:
    """Read the array of numpy's file format; fields of a structured array are columns."""
    array = np.load(io.BytesIO(content), allow_pickle=False)
    if channels := array_channels("column", array):
        yield Table(channels)


def read_matlab(content: bytes, keys: Keys) -> list[Table]:
    """Read a MATLAB file up to version 7.2; fields of a structure are named ``run.time``."""
    from scipy.io import loadmat

    refuse_unpacked(_matlab_size(content))
    variables = loadmat(io.BytesIO(content), struct_as_record=False, squeeze_me=True)
    named = {name: value for name, value in variables.items() if not name.startswith("__")}
    if {"data", "datastart", "dataend"} <= named.keys():
        raise CapsuleError("it is LabChart's export for MATLAB; export it as text from LabChart")
    parts = [part for name, value in named.items() for part in _matlab_parts(name, value)]
    arrays = {path: value for path, value in parts if not isinstance(value, str)}
    told: defaultdict[str, dict[str, str]] = defaultdict(dict)
    for path, value in parts:
        if isinstance(value, str):
            parent, _, name = path.rpartition(".")
            told[parent][name] = value
    tables = list(array_tables(arrays, ".", keys, told))
    if not tables:
        raise CapsuleError(
            f"no variable holds a series of numbers; it holds {', '.join(named) or 'nothing'}. "
            "Only MATLAB can read a table or timetable: save its columns as arrays, "
            "x = table2array(T)"
        )
    return tables


def _matlab_size(content: bytes) -> int:
    """Return the number of bytes in the compressed elements of a MATLAB file, at least roughly."""
    order = {b"IM": "<", b"MI": ">"}.get(content[126:128])
    at, size = 128, 0
    while order and at + 8 <= len(content) and size <= MOST_UNPACKED:
        kind, length = struct.unpack_from(f"{order}II", content, at)
        if kind == _MATLAB_COMPRESSED:
            packed = content[at + 8 : at + 8 + length]
            size += len(zlib.decompressobj().decompress(packed, MOST_UNPACKED + 1))
        at += 8 + length
    return size


def _matlab_parts(name: str, value: Any) -> Iterator[tuple[str, np.ndarray | str]]:
    """Yield the numbers and texts in a variable, with names such as ``lab.run(2).time``."""
    for field in getattr(value, "_fieldnames", ()):
        yield from _matlab_parts(f"{name}.{field}", getattr(value, field))
    array = np.asarray(value)
    if array.size and all(isinstance(each, str) for each in array.flat):
        yield name, as_text(array)
    elif array.dtype.kind in "iufb":
        yield name, array
    elif array.ndim and all(hasattr(each, "_fieldnames") for each in array.flat):
        for number, each in enumerate(array.flat, start=1):
            yield from _matlab_parts(f"{name}({number})", each)


def _hdf_nodes(content: bytes) -> Iterator[tuple[str, Any]]:
    """Yield the paths of an HDF5 file, and the group or dataset at each.

    Raise an error if the file takes samples from other files, or holds too many.
    """
    import h5py

    links: dict[str, Any] = {}
    paths, size = ["/"], 0
    with h5py.File(io.BytesIO(content), "r") as file:
        file.visititems_links(links.__setitem__)
        file.visit(paths.append)
        external = {
            path: each for path, each in links.items() if isinstance(each, h5py.ExternalLink)
        }
        outside = [(path, link.filename) for path, link in external.items()]
        for path in paths:
            if isinstance(node := file[path], h5py.Dataset):
                size += node.nbytes
                outside += [(path, str(part[0])) for part in node.external or ()]
                outside += [(path, "a virtual dataset")] * node.is_virtual
        # Compressed, or never written, a small file can hold very much.
        refuse_unpacked(size, max(MOST_UNPACKED, 2 * len(content)))
        for path, place in outside:
            raise CapsuleError(
                f"the file names samples outside of it, in {place!r} ({path}), and only the file "
                "itself is read; export it again with all samples in it"
            )
        for path in paths:
            yield path, file[path]


def read_hdf(content: bytes, keys: Keys) -> Iterator[Table]:
    """Read HDF5, with the attributes ``unit``, ``rate`` and ``started``; and MATLAB from 7.3 on."""
    import h5py

    arrays: dict[str, np.ndarray] = {}
    told: defaultdict[str, dict[str, Any]] = defaultdict(dict)
    for path, node in _hdf_nodes(content):
        # MATLAB stores the contents of cells and objects in these groups.
        if path.split("/")[0] in ("#refs#", "#subsystem#"):
            continue
        said, (parent, _, name) = dict(node.attrs), path.rpartition("/")
        told[path.strip("/")] |= said
        kind = decoded(said.get("MATLAB_class", ""))
        is_axis = decoded(said.get("NAME", "")).startswith(_NO_VARIABLE)
        if not isinstance(node, h5py.Dataset) or node.shape is None:
            continue
        if kind in ("char", "cell") and node.size <= _LONGEST_TEXT:
            # A cell refers to its parts.
            cells = [node] if kind == "char" else [node.file[each] for each in np.ravel(node[()])]
            texts = [
                each[()] for each in cells if decoded(each.attrs.get("MATLAB_class", "")) == "char"
            ]
            told[parent][name] = ["".join(map(chr, np.ravel(text))) for text in texts]
        elif kind == "string":
            told[parent][name] = "a string that only MATLAB can read"
        elif node.shape == () and h5py.check_string_dtype(node.dtype):
            told[parent][name] = node[()]
        elif node.dtype.kind in "iufbV" and not (kind in ("char", "cell") or is_axis):
            arrays[path] = _scaled(path, node[()], told[path.strip("/")])
    return array_tables(arrays, "/", keys, told)


def read_netcdf(content: bytes, keys: Keys) -> Iterator[Table]:
    """Read NetCDF before version 4, which is not HDF5."""
    from scipy.io import netcdf_file

    with netcdf_file(io.BytesIO(content), mmap=False) as file:
        told = {path: dict(each._attributes) for path, each in file.variables.items()}
        arrays = {
            path: _scaled(path, each.data, told[path])
            for path, each in file.variables.items()
            if each.data.dtype.kind in "iuf"
        }
        return array_tables(arrays, "/", keys, {"": file._attributes, **told})


def _scaled(path: str, array: np.ndarray, said: dict[str, Any]) -> np.ndarray:
    """Return the numbers that stored ones stand for, by the conventions of NetCDF; NaN for none.

    The scalings that are applied are taken out of the attributes.
    """
    marks = [np.ravel(value) for key, value in said.items() if MARK.fullmatch(key)]
    scaling = [key for key in _APPLIED if key in said]
    limits = {key: np.ravel(said[key]) for key in _LIMITS if key in said}
    is_unsigned = decoded(said.get("_Unsigned", "")) == "true" and array.dtype.kind == "i"
    if array.dtype.kind not in "iuf" or not (marks or scaling or limits or is_unsigned):
        return array
    values = array.astype(float)
    if is_unsigned:
        values = array.view(f"{array.dtype.byteorder}u{array.itemsize}").astype(float)
    stored = values
    for key in scaling:
        factor = np.ravel(said.pop(key))
        # One for each channel lies along the axis of the channels.
        axes = [axis for axis, size in enumerate(values.shape) if size == factor.size]
        if factor.size != 1 and (len(axes) != 1 or values.ndim == 1):
            raise CapsuleError(
                f"{key} of {path} holds {factor.size} numbers, which are not one for each channel; "
                "export the readings without packing"
            )
        if factor.size != 1:
            factor = factor.reshape([-1 if axis in axes else 1 for axis in range(values.ndim)])
        values = values * factor if key == "scale_factor" else values + factor
    for key, limit in limits.items():
        if limit.size != _LIMITS[key] or limit.dtype.kind not in "iuf":
            raise CapsuleError(
                f"{key} of {path} is {as_text(limit)[:60]!r}, and {_LIMITS[key]} numbers are "
                "understood; export the readings without it"
            )
        # Limits of packed numbers are whole; decimals are limits of what they stand for.
        of = values if array.dtype.kind != "f" and limit.dtype.kind == "f" else stored
        is_least, is_most = key != "valid_max", key != "valid_min"
        values[(is_least & (of < limit[0])) | (is_most & (of > limit[-1]))] = np.nan
    for mark in marks:
        values[np.isin(array, mark)] = np.nan
    return values


def read_nwb(content: bytes, _: Keys) -> Iterator[Table]:
    """Read the time series of Neurodata Without Borders: acquisition, processing and stimulus."""
    import h5py

    for _path, group in _hdf_nodes(content):
        data = group.get("data") if isinstance(group, h5py.Group) else None
        if not isinstance(data, h5py.Dataset) or data.dtype.kind not in "iuf":
            continue
        # A time series is its data, and the time of each sample or the sampling rate.
        times, start = group.get("timestamps"), group.get("starting_time")
        name, told = group.name.rpartition("/")[2], data.attrs
        values = data[()] * told.get("conversion", 1.0)
        if each := group.get("channel_conversion"):
            shape = np.ones(values.ndim, dtype=int)
            shape[each.attrs.get("axis", 1)] = -1
            values = values * each[()].reshape(shape)
        values = values + told.get("offset", 0.0)
        how: dict[str, Any] = {"unit": stated_unit([told], [told, group.attrs])}
        if times:
            how |= {"stamps": Channel("timestamps", times[()], "s"), "start_s": float(times[0])}
        elif start:
            rates_hz = {"rate": float(start.attrs["rate"])}
            how |= {"start_s": float(start[()]), "rates_hz": rates_hz}
        # All times count from the start of the session.
        session = decoded(group.file["session_start_time"][()])
        how["started"] = later(session, how.get("start_s", 0.0)) or session
        channels = array_channels(name, values, **how)
        if channels and (times or start):
            words = as_remarks([dict(group.attrs)])
            yield Table(with_stamps(channels), VARIABLE, name, remarks=words)
