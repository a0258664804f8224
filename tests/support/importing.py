"""Calls import_recordings.py within the process of the tests, into an archive of their own."""

import contextlib
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from capsule.recording import Recording, read_recording
from importing.import_options import build_parser
from importing.import_run import Importer
from support.project import ROOT

ODD = ROOT / "tests" / "data" / "odd"


@dataclass
class Imported:
    """What an import did.

    Attributes
    ----------
    shown, refused : str
        What it printed, and the lines of what it refused.
    counted : str
        Its last line.
    status : int
        Its exit status.
    raw : Path
        The archive.
    """

    shown: str
    refused: str
    counted: str
    status: int
    raw: Path

    def recordings(self, sensors: int = 4) -> dict[str, Recording]:
        """Read the recordings in the archive."""
        read = {}
        for path in sorted(self.raw.glob("*/*.csv")):
            with path.open("rb") as stream:
                name = str(path.relative_to(self.raw).with_suffix("").as_posix())
                read[name] = read_recording(stream, sensors)
        return read

    def the_recording(self) -> Recording:
        """Read the only recording in the archive."""
        assert not self.refused, self.refused
        (recording,) = self.recordings().values()
        return recording


def import_files(folder: Path, *arguments: str | Path, size: str = "3") -> Imported:
    """Import files into `folder`/raw, with lab.yaml beside it."""
    condition = [] if "--unlabelled" in arguments else ["--size", size]
    fixed = ["--raw", folder / "raw", "--write-map", folder / "lab.yaml"]
    options = build_parser().parse_args([str(each) for each in (*arguments, *condition, *fixed)])
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        importer = Importer(options)
        importer.run()
    status = 1 if importer.refused else 0
    return Imported(out.getvalue(), err.getvalue(), importer.summary(), status, folder / "raw")


def assert_readings(recording: Recording, time_s: np.ndarray, values: np.ndarray) -> None:
    """Compare a recording's samples with those that it was written from."""
    np.testing.assert_allclose(recording.time_s, time_s, atol=1e-6)
    np.testing.assert_allclose(recording.values, values, rtol=1e-9)
