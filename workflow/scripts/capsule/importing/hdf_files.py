"""Read HDF5 files, and MATLAB files from version 7.3 on, with h5py."""

import io
from typing import Any

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.array_tables import array_tables
from capsule.importing.extra import LARGEST_UNPACKED, damage_named, needed_package, too_large_text
from capsule.importing.source_table import SourceTable

SEPARATOR = "/"
_UNITS = ("unit", "units")
# MATLAB stores the contents of cells and objects in these groups.
_HIDDEN = ("#refs#", "#subsystem#")


def read_hdf(content: bytes) -> list[SourceTable]:
    """Read the datasets of an HDF5 file, with their attributes ``unit``, ``rate`` and ``started``.

    Parameters
    ----------
    content : bytes
        The file.

    Raises
    ------
    CapsuleError
        The file is damaged, or holds no series of numbers.
    """
    h5py = needed_package("h5py", "HDF5")
    arrays: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    started: list[str] = []

    def visit(name: str, node: Any) -> None:
        if name.split(SEPARATOR)[0] in _HIDDEN:
            return
        is_dataset = isinstance(node, h5py.Dataset)
        for key, value in node.attrs.items():
            if is_dataset and key.lower() in _UNITS:
                units[name] = _text(value)
            elif key.lower() == "started":
                started.append(_text(value))
            elif np.size(value) == 1 and np.asarray(value).dtype.kind in "iuf":
                parent = name.rpartition(SEPARATOR)[0] if is_dataset else name
                arrays[f"{parent}{SEPARATOR}{key}".lstrip(SEPARATOR)] = np.asarray(value)
        text = _text(node.attrs.get("MATLAB_class", "")) in ("char", "cell") if is_dataset else True
        if is_dataset and not text and node.dtype.kind in "iufbV" and node.shape is not None:
            arrays[name] = node[()]

    with (
        damage_named("HDF5 file", "copy or export it again"),
        h5py.File(io.BytesIO(content), "r") as file,
    ):
        refuse_outside(file)
        visit("", file)
        file.visititems(visit)
    tables = array_tables(arrays, units, SEPARATOR, started[0] if started else "")
    if not tables:
        raise CapsuleError("no dataset holds a series of numbers; export the readings as arrays")
    return tables


def refuse_outside(file: Any) -> None:
    """Raise an error if an HDF5 file takes samples from other files, which are not read.

    Parameters
    ----------
    file : h5py.File
        The file.

    Raises
    ------
    CapsuleError
        A link or a dataset leads outside of the file, or a dataset is too large.
    """
    h5py = needed_package("h5py", "HDF5")
    outside: list[tuple[str, str]] = []

    def check_link(name: str, link: Any) -> None:
        if isinstance(link, h5py.ExternalLink):
            outside.append((name, link.filename))

    def check(name: str, node: Any) -> None:
        if not isinstance(node, h5py.Dataset):
            return
        outside.extend((name, str(part[0])) for part in node.external or ())
        if node.is_virtual:
            outside.append((name, "a virtual dataset"))
        if node.nbytes > LARGEST_UNPACKED:
            raise CapsuleError(f"{name}: {too_large_text(LARGEST_UNPACKED)}")

    file.visititems_links(check_link)
    file.visititems(check)
    for name, place in outside:
        raise CapsuleError(
            f"the file names samples outside of it, in {place!r} ({name}), and only the file "
            "itself is read; export it again with all samples in it"
        )


def _text(value: object) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
