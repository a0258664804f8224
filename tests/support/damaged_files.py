"""Valid files of each format that the import reads, and files with bytes changed at random."""

import gzip
import io
import zipfile
from pathlib import Path

import h5py
import numpy as np
import xarray
from rosbags.rosbag2 import StoragePlugin

from support import lab_files as lab
from support.importing import ODD
from support.lab_files import COUNTS, KILO_OHMS, TIME_S, excel_rows

ENDINGS = ".csv .log .gz .npy .npz .mat 73.mat .h5 .nc .xlsx .nwb .tdms .xdf .bag .mcap .sqlite3"
ENDINGS = ENDINGS.split()


def write_each_format(folder: Path) -> dict[str, Path]:
    """Write a valid file of each format, and return the files by their ending.

    The file of a bag of ROS 2 lies in the bag's folder.
    """
    lab.write_examples(folder)
    files = {ending: folder / f"run{ending}" for ending in ENDINGS[:-2]}
    files[".csv"].write_bytes((ODD / "comma.txt").read_bytes())
    files[".log"].write_bytes((ODD / "serial_monitor.txt").read_bytes())
    files[".gz"].write_bytes(gzip.compress((ODD / "comma.txt").read_bytes()))
    np.save(files[".npy"], np.vstack([TIME_S, COUNTS]).T)
    np.savez_compressed(files[".npz"], t=TIME_S, V=COUNTS.T)
    lab.write_matlab_73(files["73.mat"], t=TIME_S[:, None], V=COUNTS.T)
    with h5py.File(files[".h5"], "w") as file:
        file.create_dataset("run/readings", data=KILO_OHMS, compression="gzip")
        file["run"].attrs["rate"] = 10.0
    packed = {"readings": {"scale_factor": 0.5, "_FillValue": -1, "dtype": "int16"}}
    readings = xarray.Dataset({"readings": (("time", "sensor"), COUNTS.T)}, {"time": TIME_S})
    readings.to_netcdf(files[".nc"], engine="scipy", encoding=packed)
    lab.write_workbook(files[".xlsx"], Run=excel_rows(TIME_S.tolist()))
    for plugin in (StoragePlugin.MCAP, StoragePlugin.SQLITE3):
        bag = folder / plugin.name.lower()
        lab.write_bag(bag, plugin)
        (files[f".{bag.name}"],) = (each for each in bag.iterdir() if each.suffix != ".yaml")
    return files


def given_path(file: Path) -> Path:
    """Return what is given to the import: the file, or the folder of a bag of ROS 2."""
    return file.parent if (file.parent / "metadata.yaml").exists() else file


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a file's content with 1 to 20 bytes changed, most of them near each other.

    In packed files, most changes are made before packing: a checksum refuses all others.
    """
    if content.startswith(b"\x1f\x8b") and rng.random() < 0.8:
        return gzip.compress(damaged(gzip.decompress(content), rng))
    if content.startswith(b"PK") and rng.random() < 0.8:
        return _with_damaged_part(content, rng)
    changed = bytearray(content)
    first = int(rng.integers(len(changed)))
    for _ in range(int(rng.integers(1, 21))):
        near = rng.random() < 0.7
        at = first + int(rng.integers(64)) if near else int(rng.integers(len(changed)))
        # Sizes and counts of these formats are mostly small, so extreme bytes matter most.
        byte = int(rng.choice([0, 1, 127, 128, 255])) if rng.random() < 0.4 else rng.integers(256)
        changed[at % len(changed)] = int(byte)
    return bytes(changed)


def _with_damaged_part(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a zip file with one part damaged, most often the largest."""
    written = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as whole, zipfile.ZipFile(written, "w") as changed:
        parts = sorted(whole.infolist(), key=lambda part: part.file_size)
        chosen = parts[-1] if rng.random() < 0.5 else parts[int(rng.integers(len(parts)))]
        for part in whole.infolist():
            text = whole.read(part)
            changed.writestr(part.filename, damaged(text, rng) if part is chosen else text)
    return written.getvalue()
