"""Read results for an export: record their checksums, and name the remedy if one is missing."""

import json
import zipfile
from pathlib import Path

import numpy as np

from capsule.errors import CapsuleError
from edges import files

REMEDY = "make it in the project's folder: snakemake -c2 results/report.html"
_LARGEST_BYTES = 1_000_000_000


class CheckedFiles:
    """The folder of results, and a list of the files that were read from it.

    Parameters
    ----------
    folder : Path
        The folder.

    Attributes
    ----------
    read : list of dict
        ``path`` and ``sha256`` of each file that was read.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.read: list[dict[str, str]] = []

    def has(self, name: str) -> bool:
        """Return whether the file exists."""
        return (self.folder / name).is_file()

    def rows(self, name: str) -> list[dict[str, str]]:
        """Read a table; every cell is a text."""
        return files.read_csv(self._noted(name))

    def columns(self, name: str) -> list[str]:
        """Read the names of a table's columns."""
        with self._existing(name).open(encoding="utf-8") as stream:
            return stream.readline().rstrip("\n").split(",")

    def content(self, name: str) -> dict:
        """Read a JSON file."""
        path = self._noted(name)
        try:
            return files.read_json(path)
        except json.JSONDecodeError as error:
            raise _damaged(path, error) from None

    def array(self, name: str) -> np.ndarray:
        """Read an array."""
        path = self._noted(name)
        try:
            return np.load(path)
        except (ValueError, EOFError) as error:
            raise _damaged(path, error) from None

    def arrays(self, name: str) -> dict[str, np.ndarray]:
        """Read the arrays of an .npz file."""
        path = self._noted(name)
        try:
            with np.load(path) as stored:
                return dict(stored)
        except (ValueError, EOFError, zipfile.BadZipFile) as error:
            raise _damaged(path, error) from None

    def _existing(self, name: str) -> Path:
        path = self.folder / name
        if not path.is_file():
            raise CapsuleError(f"{path} does not exist; {REMEDY}")
        return path

    def _noted(self, name: str) -> Path:
        path = self._existing(name)
        checksum = files.fingerprint(path, _LARGEST_BYTES)
        self.read.append({"path": f"{self.folder.name}/{name}", "sha256": checksum})
        return path


def _damaged(path: Path, error: Exception) -> CapsuleError:
    return CapsuleError(f"{path} is damaged ({error}); delete it, then {REMEDY}")
