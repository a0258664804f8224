"""Read results for an export: record their checksums, and name the remedy if one is missing."""

import json
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from capsule import files
from capsule.errors import CapsuleError
from capsule.results import Results, read_array

REMEDY = "make it in the project's folder: snakemake -c2 results/report.html"
_LARGEST_BYTES = 1_000_000_000


class CheckedFiles:
    """The folder of results, and a list of the files that were read from it.

    Parameters
    ----------
    folder : Path
        The folder.
    recordings_per_job : int or str
        As in the configuration.

    Attributes
    ----------
    recordings : Results
        The files of the recordings.
    read : list of dict
        ``path`` and ``sha256`` of each file that was read.
    """

    def __init__(self, folder: Path, recordings_per_job: int | str) -> None:
        self.folder = folder
        self._existing("recordings.csv")
        self.recordings = Results.on_disk(folder, recordings_per_job)
        self._seen: set[str] = set()
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

    def content(self, name: str) -> dict[str, Any]:
        """Read a JSON file."""
        path = self._noted(name)
        try:
            return files.read_json(path)
        except json.JSONDecodeError as error:
            raise _damaged(path, error) from None

    def array(self, kind: str, recording: str) -> np.ndarray:
        """Read the array of a recording, `capsule.results.SIGNALS` or `MATRICES`."""
        return read_array(self._of_recording(kind, recording), recording)

    def contents(self, kind: str, recordings: Iterable[str]) -> dict[str, dict[str, Any]]:
        """Read the checks or the fits of recordings, `capsule.results.CHECKS` or `FITS`."""
        names = list(recordings)
        for name in names:
            self._of_recording(kind, name)
        return self.recordings.contents(kind, names)

    def arrays(self, name: str) -> dict[str, np.ndarray]:
        """Read the arrays of an .npz file."""
        path = self._noted(name)
        try:
            with np.load(path) as stored:
                return dict(stored)
        except (ValueError, EOFError, zipfile.BadZipFile) as error:
            raise _damaged(path, error) from None

    def _of_recording(self, kind: str, recording: str) -> Path:
        """Return the file that holds a recording, and note it when it is first asked for."""
        name = self.recordings.file(kind, recording).relative_to(self.folder).as_posix()
        if name not in self._seen:
            self._seen.add(name)
            self._noted(name)
        return self.folder / name

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
