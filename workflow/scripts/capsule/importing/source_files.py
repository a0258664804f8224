"""Read a file of any format; the first bytes of the file decide which reader is used."""

import gzip
import hashlib
import io
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

from capsule.errors import CapsuleError
from capsule.files import read_limited
from capsule.importing.extra import LARGEST_UNPACKED, damage_named, too_large_text
from capsule.importing.source_table import SourceTable

_MATLAB_73 = b"MATLAB 7.3 MAT-file"
_READ_BY_PATH = b"#ROSBAG", b"\x89MCAP"
_NO_TABLE = {
    b"\xd0\xcf\x11\xe0": "it is a workbook of an old Excel; save it as .xlsx",
    b"SQLite format 3": "it is one file of a bag of ROS 2; give the folder with its metadata.yaml",
    b"%PDF": "it is a PDF; export the readings as text",
    b"7z\xbc\xaf": "it is compressed; unpack it first",
}


@dataclass(frozen=True)
class Source:
    """A file that was read.

    Attributes
    ----------
    tables : list of SourceTable
        Tables in the file.
    sha256 : str
        Checksum of the file's content.
    """

    tables: list[SourceTable]
    sha256: str


def read_source(path: Path, keys: SimpleNamespace, needed: int) -> Source:
    """Read a file of any format.

    Parameters
    ----------
    path : Path
        A file, or the folder of a bag of ROS 2.
    keys : SimpleNamespace
        The keys of lab.yaml.
    needed : int
        Number of columns of numbers that a run must have.

    Raises
    ------
    CapsuleError
        The file cannot be read, or its format is unknown.
    """
    if path.is_dir():
        return Source(_tables_in_folder(path), _folder_checksum(path))
    try:
        content = read_limited(path, LARGEST_UNPACKED)
    except OSError as error:
        raise CapsuleError(f"{error.strerror}; give the name of a file that can be read") from None
    if content is None:
        raise CapsuleError(too_large_text(LARGEST_UNPACKED))
    tables = _tables(path, content, keys, needed)
    return Source(tables, hashlib.sha256(content).hexdigest())


def _tables(path: Path, content: bytes, keys: SimpleNamespace, needed: int) -> list[SourceTable]:
    # Each reader is imported only for a file of its format, since it needs its own package.
    for mark, reason in _NO_TABLE.items():
        if content.startswith(mark):
            raise CapsuleError(reason)
    if content.startswith(b"\x1f\x8b"):
        return _tables(path.with_suffix(""), _unpacked(content), keys, needed)
    if content.startswith(b"\x93NUMPY"):
        from capsule.importing.array_tables import read_numpy

        return read_numpy(content, path.stem)
    if content.startswith((b"\x89HDF", _MATLAB_73)):
        if path.suffix.lower() == ".nwb":
            from capsule.importing.nwb_files import read_nwb

            return read_nwb(content)
        from capsule.importing.hdf_files import read_hdf

        return read_hdf(content)
    if content.startswith(b"PK\x03\x04"):
        from capsule.importing.excel_sheets import read_excel

        return read_excel(content, keys, needed)
    if content.startswith(b"TDSm"):
        from capsule.importing.tdms_files import read_tdms

        return read_tdms(content)
    if content.startswith(b"XDF:"):
        from capsule.importing.xdf_files import read_xdf

        return read_xdf(content)
    if content.startswith(_READ_BY_PATH):
        from capsule.importing.ros_bags import read_bag

        return read_bag(path)
    if path.suffix.lower() == ".mat":
        from capsule.importing.matlab_files import read_matlab

        return read_matlab(content)
    from capsule.importing.text_files import read_text

    return read_text(content, keys, needed)


def _unpacked(content: bytes) -> bytes:
    """Return the content of a gzip file."""
    with (
        damage_named("compressed file", "copy it again"),
        gzip.GzipFile(fileobj=io.BytesIO(content)) as stream,
    ):
        unpacked = stream.read(LARGEST_UNPACKED + 1)
    if len(unpacked) > LARGEST_UNPACKED:
        raise CapsuleError(too_large_text(LARGEST_UNPACKED))
    if unpacked.startswith((b"\x1f\x8b", *_READ_BY_PATH)):
        raise CapsuleError("it holds a file that is read only where it lies; unpack it first")
    return unpacked


def _tables_in_folder(path: Path) -> list[SourceTable]:
    if not (path / "metadata.yaml").is_file():
        raise CapsuleError("it is a folder, but not a bag of ROS 2; give the files in it")
    for file in path.iterdir():
        if not file.resolve().is_relative_to(path.resolve()):
            raise CapsuleError(
                f"{file.name!r} is a link to a file outside of this folder; copy it into it"
            )
    if sum(file.stat().st_size for file in path.iterdir()) > LARGEST_UNPACKED:
        raise CapsuleError(too_large_text(LARGEST_UNPACKED))
    from capsule.importing.ros_bags import read_bag

    return read_bag(path)


def _folder_checksum(path: Path) -> str:
    digest = hashlib.sha256()
    for file in sorted(each for each in path.iterdir() if each.is_file()):
        digest.update(file.name.encode("utf-8", "surrogateescape"))
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
