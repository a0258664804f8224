"""Run `capsule import` inside the tests' process, with an archive of its own."""

import contextlib
import io
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from capsule.commands.cli import build_parser
from capsule.engine.configuration import read_settings
from capsule.importing.command import Importer
from capsule.recordings.recording import Recording, read_recording
from support.lab_files import COUNTS, TIME_S
from support.project import ROOT

PARSER, SETTINGS = build_parser(["import"]), read_settings()
ODD = ROOT / "tests" / "data" / "odd"
# What a refusal tells to do.
REMEDY = re.compile(
    r"--[a-z]+|delete|export|complete|choose one|allowed|copy|correct|save|leave|"
    r"name (each|the|\d)|is not a column"
)


@dataclass
class Imported:
    """Printed lines, lines about refused files, counts, exit status and archive of an import."""

    shown: str
    refused: str
    counted: str
    status: int
    raw: Path

    def recordings(self, sensors: int = 4) -> dict[str, Recording]:
        """Return the recordings in the archive."""
        read = {}
        for path in sorted(self.raw.glob("*/*.csv")):
            with path.open("rb") as stream:
                name = str(path.relative_to(self.raw).with_suffix("").as_posix())
                read[name] = read_recording(stream, sensors)
        return read

    def the_recording(self) -> Recording:
        """Return the only recording in the archive."""
        assert not self.refused, self.refused
        (recording,) = self.recordings().values()
        return recording


def import_files(folder: Path, *arguments: str | Path, size: str = "3") -> Imported:
    """Import files into `folder`/raw, with lab.yaml beside it."""
    condition = [] if "--unlabelled" in arguments else ["--size", size]
    fixed = ["--raw", folder / "raw", "--write-map", folder / "lab.yaml"]
    own = "--config" in arguments
    words = ["import", *map(str, (*arguments, *condition, *fixed))]
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        options = PARSER.parse_args(words)
        importer = Importer(options, read_settings(options.config) if own else SETTINGS)
        importer.run()
    status, told = int(bool(importer.refused)), importer.summary()
    return Imported(out.getvalue(), err.getvalue(), told, status, folder / "raw")


def assert_readings(recording: Recording, time_s: np.ndarray, values: np.ndarray) -> None:
    """Check that a recording has the given times and readings."""
    np.testing.assert_allclose(recording.time_s, time_s, atol=1e-6)
    np.testing.assert_allclose(recording.values, values, rtol=1e-9)


def lines(*columns, head="time_s,S1,S2,S3,S4", sign=","):
    """Return a table of columns of numbers or texts as text."""
    cells = ([x if isinstance(x, str) else f"{x:.12g}" for x in column] for column in columns)
    rows = map(sign.join, zip(*cells, strict=True))
    return "\n".join([*([head] if head else []), *rows, ""])


def write_table(path, *columns, head="time,S1,S2,S3,S4"):
    """Write a table as text, and return its path."""
    path.write_text(lines(*columns, head=head), encoding="utf-8")
    return path


class Case(NamedTuple):
    """A file of one kind, and what the import makes of it."""

    # A text, a file, or what writes a file into a folder and returns its path.
    file: str | Path | Callable[[Path], Path]
    # Of a note that is shown; of a file that is asked about, of the refusal.
    words: str = ""
    # The options that read what was refused; empty if none can.
    remedy: str = ""
    # The options before.
    options: str = ""
    # What is imported; None for two runs of 300 and 225 samples of `COUNTS`.
    values: np.ndarray | None = COUNTS
    time_s: np.ndarray = TIME_S
    # Lines of the header; None for a key that must not be there.
    header: dict[str, str | None] | tuple[()] = ()

    def written(self, folder: Path) -> Path:
        """Return the file; a text and what is written are made in a folder."""
        if isinstance(self.file, str):
            (folder / "a.txt").write_text(self.file, encoding="utf-8")
            return folder / "a.txt"
        return self.file if isinstance(self.file, Path) else self.file(folder)

    def check_read(self, folder: Path, atol: float = 1e-6) -> Imported:
        """Import the file with its options, check the samples and the note, and return the rest."""
        imported = import_files(folder, self.written(folder), *self.options.split())
        self.check(imported, atol)
        assert self.words in imported.shown
        return imported

    def check_asked(self, folder: Path) -> None:
        """Check that one line refuses the file, and that its remedy works."""
        path = self.written(folder)
        imported = import_files(folder, path, *self.options.split())
        assert self.words in imported.refused and f"{path.name}: " in imported.refused
        assert (imported.refused.count("\n"), imported.recordings(), imported.status) == (1, {}, 1)
        assert REMEDY.search(imported.refused)
        if self.remedy:
            assert self.remedy.split()[-2] in imported.refused, "the refusal names the option"
            self.check(import_files(folder, path, *self.remedy.split()))

    def check(self, imported: Imported, atol: float = 1e-6) -> None:
        """Check the samples that were imported."""
        if self.values is None:
            runs = list(imported.recordings().values())
            assert [run.values.shape[1] for run in runs] == [300, 225], imported.refused
            joined = np.hstack([run.values for run in runs])
            ratio = joined[0, 0] / COUNTS[0, 0]
            np.testing.assert_allclose(joined, ratio * COUNTS, rtol=1e-5)
            return
        recording = imported.the_recording()
        # What the judgement of a unit lacks is told until it is given.
        for key in {"vref_v", "adc_bits"} & recording.header.keys():
            assert f"use --{key.replace('_', '-')}" not in imported.shown
        samples = recording.time_s.size
        np.testing.assert_allclose(recording.time_s, self.time_s[:samples], atol=atol)
        np.testing.assert_allclose(recording.values, self.values, rtol=1e-9, atol=1e-6)
        assert dict(self.header) == {key: recording.header.get(key) for key in self.header}
