"""Import recordings from other programs' files into raw/; refuse what cannot be read, and go on."""

import argparse
import hashlib
import os
import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from capsule.commands.options import LONGEST_NAME, recording_name, size_folder
from capsule.engine.configuration import read_config_file, read_settings
from capsule.engine.project import config_file
from capsule.errors import CapsuleError, RecordingError
from capsule.importing.formats import read_source
from capsule.importing.lab_yaml import Keys, checked_keys, keep_map, lab_schema
from capsule.importing.runs import Reading, as_map, joined, read_columns, runs_of
from capsule.importing.stated import mentioned_unit
from capsule.importing.table import QuestionError, Table, choose_tables, naming
from capsule.importing.units import unit_of
from capsule.kinds import Settings
from capsule.recordings.acceptance import readings_of
from capsule.recordings.names import PART, UNLABELLED, Entry, classify, displayed, reason_of_copy
from capsule.recordings.recording import Recording, column_names, format_recording
from capsule.store.files import list_archive, read_limited, write_new
from capsule.words import BARS, PLAIN_BARS, plural, trace

# Bars and samples that are shown.
_WIDTH = 64
_FIRST_SAMPLES = 3

EXAMPLES = """
examples:
  %(prog)s monday/*.csv --size 3          guess the format, and write lab.yaml
  %(prog)s tuesday/*.csv --size 0 --map lab.yaml
  %(prog)s log.txt --size 3 --dry-run     only show what would be done
  %(prog)s patient.xlsx --unlabelled --sheet "Run 2" --unit V

exit status:
  0 every file was imported, or was in the archive   1 a file was refused   2 wrong option
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options; each key of lab.yaml is one."""
    parser.epilog = EXAMPLES
    add = parser.add_argument
    formats = "text, CSV, .csv.gz, .npy, .mat, .xlsx, HDF5, NWB, TDMS, XDF or .bag file, or the "
    formats += "folder of a bag of ROS 2"
    add("files", nargs="*", type=Path, metavar="FILE", help=formats)
    condition = parser.add_mutually_exclusive_group(required=True)
    size = "nodule size of these runs; 0: no nodule"
    condition.add_argument("--size", type=size_folder, metavar="MM", help=size)
    condition.add_argument("--unlabelled", action="store_true", help="runs whose nodule is unknown")
    add("--map", type=Path, metavar="FILE", help="lab.yaml, which describes these files")
    written, lab = "file for the guessed description (default: %(default)s)", Path("lab.yaml")
    add("--write-map", type=Path, default=lab, metavar="FILE", help=written)
    add("--name", type=recording_name, help="name of the recording (default: the file's)")
    preview = "show the first samples and a line of bars of each file, also of many"
    add("--preview", action="store_true", help=preview)
    add("--dry-run", action="store_true", help="show what would be done, and write nothing")
    add("--raw", type=Path, default=Path("raw"), help="archive (default: raw/)")
    here = "the workflow's configuration (default: config/config.yaml here, or the shipped one)"
    add("--config", type=Path, default=config_file(), help=here)
    keys = parser.add_argument_group("keys of lab.yaml; an option overrides the file")
    for key, part in lab_schema()["properties"].items():
        kind, word = part.get("type", ""), part.get("metavar", part.get("unit", "x"))
        told: dict[str, Any] = {"action": "store_true", "default": None}
        if "enum" in part:
            told = {"choices": part["enum"]}
        elif kind != "boolean":
            told = {"type": {"number": float, "integer": int}.get(kind, str)}
            told |= {"nargs": "+" if kind == "array" else None, "metavar": word.upper()}
        description = part["description"].replace("%", "%%")
        keys.add_argument(f"--{key.replace('_', '-')}", help=description, **told)


def main(arguments: argparse.Namespace) -> int:
    """Import the given files and print their number; return 1 if a file was refused."""
    importer = Importer(arguments, read_settings(arguments.config))
    importer.run()
    _tell(importer.summary())
    return int(importer.refused > 0)


class Importer:
    """An import of files into an archive.

    Parameters
    ----------
    options : argparse.Namespace
        Options of `capsule.importing.command.add_arguments`.
    settings : mapping
        The configuration.

    Attributes
    ----------
    written, known, refused : int
        Numbers of recordings written, of recordings that the archive already held, and of files
        refused.

    Raises
    ------
    CapsuleError
        The options or lab.yaml cannot be used.
    """

    def __init__(self, options: argparse.Namespace, settings: Settings) -> None:
        self._settings = settings
        self._options, self._raw = options, options.raw
        given = read_config_file(options.map) if options.map else {}
        with naming(str(options.map or "")):
            self._keys = checked_keys(given | _given_keys(options), self._settings)
        # The recordings of the archive by the checksum of their samples; larger files are none.
        self._names: dict[str, str] = {}
        most_bytes = int(self._settings["recording"]["max_megabytes"] * 1e6)
        for name in sorted(list_archive(self._raw).recordings) if self._raw.is_dir() else ():
            content = read_limited(self._path(name), most_bytes)
            if content is not None:
                self._names[_checksum(content)] = name
        self.written = self.known = self.refused = 0
        # Of many files, a way to read them is shown once, and so is a note, with all its files.
        self._full, self._width, self._shown = True, 0, set[str]()
        self._notes: dict[str, list[str]] = {}

    def run(self) -> None:
        """Import all files; print the name of each file that cannot be imported."""
        asked: dict[str, list[str]] = {}
        self._notes.clear()
        groups = self._groups()
        named = [", ".join(displayed(str(file)) for file in files) for files in groups]
        self._full, self._width = len(groups) == 1 or self._options.preview, max(map(len, named))
        for files, names in zip(groups, named, strict=True):
            try:
                self._import(files, names)
            except (CapsuleError, OSError) as fault:
                self.refused += 1
                if isinstance(fault, QuestionError):
                    alike = asked.setdefault(fault.subject, [])
                    alike.append(names)
                    # A question that several files have in common is asked once.
                    if len(alike) > 1:
                        continue
                reason = str(fault)
                if isinstance(fault, OSError):
                    remedy = "free some space or choose another --raw, and run again"
                    reason = f"{fault.strerror or fault}; {remedy}"
                _tell(f"refused: {names}: {reason}", sys.stderr)
        for first, *more in asked.values():
            if more:
                _tell(f"refused: {', '.join(more)}: the same question as for {first}", sys.stderr)
        if not self._full:
            for text, places in self._notes.items():
                _tell(f"note: {', '.join(places)}: {text}")

    def _groups(self) -> list[list[Path]]:
        """Return the files in groups; the files of one group are one run."""
        files = [file for given in self._options.files for file in _expanded(given)]
        if not files:
            raise CapsuleError("no FILE is given; name the files to import")
        if self._keys.per_sensor:
            if len(files) != (count := self._settings["recording"]["sensors"]):
                raise CapsuleError(
                    f"per_sensor: {len(files)} files are given, but recording.sensors is {count}; "
                    "give the files of one run, in the order of the sensors"
                )
            return [files]
        if self._options.name and len(files) > 1:
            raise CapsuleError(
                f"--name {self._options.name} is given for {len(files)} files; give it for one"
            )
        return [[file] for file in files]

    def _import(self, files: list[Path], names: str) -> None:
        readings, sums = self._read(files, self._keys)
        told = "\n".join(line for each in readings for line in _reading_lines(each, self._keys))
        if self._full:
            _tell(f"{names}\n{told}")
        elif told not in self._shown:
            head = "".join(f"{word:>10}" for word in ("samples", "seconds", "lowest", "highest"))
            _tell(f"{told}\n  {'file':<{self._width}}{head}")
        self._shown.add(told)
        parts = [joined(readings, self._keys)] if len(files) > 1 else readings
        named = ", ".join(file.name for file in files)
        origin = {"source": f"imported from {named}", "import_file": named, "import_sha256": sums}
        stem = self._options.name or (files[0].name if files[0].is_dir() else files[0].stem)
        folder = UNLABELLED if self._options.unlabelled else self._options.size
        planned: dict[str, tuple[bytes, str, Recording, list[str]]] = {}
        for part in parts:
            with naming(part.table.place):
                runs = list(runs_of(part, origin, self._keys))
            for label, recording, remarks in runs:
                # Of several tables, the names of their runs begin with the table's.
                label = f"{part.table.label if len(parts) > 1 else ''} {label}".strip()
                name = f"{folder}/{_run_name(stem, label)}"
                content = format_recording(recording)
                checksum = _checksum(content)
                if name in planned:
                    raise CapsuleError(
                        f"two of its runs would be written to {self._path(name)}; give them "
                        "different names"
                    )
                self._check(name, checksum)
                planned[name] = content, checksum, recording, remarks
        # A file is imported completely or not at all. Half of its runs in the archive would hide
        # the error in the other half.
        for name, each in planned.items():
            self._archive(names, name, *each)
        if not (self._options.map or self._options.dry_run):
            alone = not self._keys.per_sensor
            described = as_map(readings[0], self._keys) if alone else self._keys.given
            if told := keep_map(self._options.write_map, described):
                if told.startswith("wrote"):
                    _tell(f"  {told}")
                else:
                    self._note(names, told, "")

    def _read(self, files: list[Path], keys: Keys) -> tuple[list[Reading], str]:
        """Read files, and find out what their columns are; return their checksums, too."""
        alone, readings, sums = len(files) == 1, [], []
        try:
            for file in files:
                with naming("" if alone else displayed(file.name)):
                    tables, sha256 = read_source(file, keys)
                    tables = choose_tables(tables, keys)
                    sums.append(sha256)
                    for table in tables if alone else tables[:1]:
                        with naming(table.place):
                            readings.append(read_columns(_with_name(table, file), keys))
        except QuestionError as question:
            raise self._whole_question(question, files, keys) from None
        return readings, ", ".join(sums)

    def _whole_question(
        self, question: QuestionError, files: list[Path], keys: Keys
    ) -> QuestionError:
        """Return a question with what is asked behind its answers, so that all is asked at once."""
        behind: dict[str, list[str]] = {}
        for answer in question.answers:
            try:
                self._read(files, checked_keys({**keys.given, **answer}, self._settings))
            except QuestionError as other:
                options = [f"--{key} {value}" for key, value in answer.items()]
                behind.setdefault(str(other), []).extend(options)
            except CapsuleError:
                continue  # This answer is wrong.
        parts = [str(question)]
        for text, options in behind.items():
            is_common = len(options) == len(question.answers)
            parts.append(f"and {text}" if is_common else f"with {' or '.join(options)}, {text}")
        return QuestionError("; ".join(parts))

    def _path(self, name: str) -> Path:
        return Path(self._raw, f"{name}.csv")

    def _check(self, name: str, checksum: str) -> None:
        """Raise an error if samples with this checksum cannot be written under this name."""
        path = self._path(name)
        if known := self._names.get(checksum):
            reason = reason_of_copy(known, name)
            if "mislabelled" in reason:
                raise CapsuleError(f"{reason}; move {self._path(known)}, or give the right size")
            return
        for taken in (path, path.with_name(path.name + PART)):
            if taken.exists():
                raise CapsuleError(
                    f"{taken} exists and holds other samples, so it is not overwritten; give "
                    "another --name"
                )

    def _note(self, names: str, text: str, word: str = "note: ") -> None:
        """Show a text on a file once; of many files, notes are shown at the end."""
        places = self._notes.setdefault(text, [])
        if names not in places:
            places.append(names)
            if self._full:
                _tell(f"  {word}{text}")

    def _archive(
        self,
        names: str,
        name: str,
        content: bytes,
        checksum: str,
        recording: Recording,
        remarks: list[str],
    ) -> None:
        """Write a recording, unless the archive holds it; show what was done."""
        size, end = recording.time_s.size, recording.time_s[-1]
        if self._full:
            _tell("\n".join(_sample_lines(recording)))
        else:
            span = np.nanmin(recording.values), np.nanmax(recording.values)
            cells = "".join(f"{cell:>10}" for cell in (size, *(f"{x:.6g}" for x in (end, *span))))
            _tell(f"  {names:<{self._width}}{cells}")
        # It may be one that this file holds twice.
        if known := self._names.get(checksum):
            self.known += 1
            told = f"already in the archive: {known} holds the same samples; nothing is written"
            self._note(names, told, "")
            return
        path, verb = self._path(name), "would write"
        if not self._options.dry_run:
            try:
                write_new(path, content)
            except FileExistsError:
                # Another import was quicker.
                self._check(name, checksum)
                raise
            self._names[checksum], verb = name, "wrote"
        self.written += 1
        if self._full:
            here = Path.cwd()
            near = path.relative_to(here) if path.is_relative_to(here) else path
            _tell(f"  {verb} {near}: {size} samples, {end:g} s")
        if resampled := recording.header.get("import_resampled"):
            self._note(names, f"resampled {resampled}", "")
        for remark in remarks:
            self._note(names, remark)
        try:
            _, no_verdict = readings_of(recording, self._settings)
            if no_verdict:
                self._note(names, f"the report will give no verdict: {no_verdict}")
        except RecordingError as reason:
            self._note(names, f"the report will reject it: {reason}")

    def summary(self) -> str:
        """Return a line with the numbers of recordings imported and known, and files refused."""
        verb = "would be imported" if self._options.dry_run else "imported"
        there = f", {self.known} already there" if self.known else ""
        came, kept_out = plural(self.written, "recording"), plural(self.refused, "file")
        return f"{came} {verb}{there}, {kept_out} refused"


def _given_keys(options: argparse.Namespace) -> dict[str, object]:
    """Return the keys of lab.yaml that are given as options."""
    said = {key: getattr(options, key) for key in lab_schema()["properties"]}
    names = said["sensors"] or ()
    # Commas, blanks or both separate the columns.
    if names and all(name.endswith(",") for name in names[:-1]):
        said["sensors"] = [part.strip() for part in ",".join(names).split(",") if part.strip()]
    return {key: value for key, value in said.items() if value is not None}


def _tell(text: str, stream: TextIO | None = None) -> None:
    """Print a text at once; if its reader has ended, as ``| head`` does, the import goes on."""
    stream = stream or sys.stdout
    try:
        print(text, file=stream, flush=True)
    except BrokenPipeError:
        # The stream's buffer keeps the text, and Python writes it again when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _with_name(table: Table, file: Path) -> Table:
    """Return a table with its file's name as a remark, if that holds the sign of a unit."""
    words = file.stem.replace("_", " ")
    unit = mentioned_unit(words)
    is_foreign = not unit.islower() and unit_of(unit) is None
    if not is_foreign or "format_version" in table.notes:
        return table
    return replace(table, remarks=[*table.remarks, f"its name: {words}"])


def _expanded(given: Path) -> list[Path]:
    """Return the files of a pattern such as *.csv, which a shell of Windows does not expand."""
    return [given] if given.exists() else sorted(given.parent.glob(given.name)) or [given]


def _run_name(stem: str, label: str) -> str:
    """Return a recording's name, made from the names of its file and its run.

    A shell, the report and any file system accept the characters of this name.
    """
    text = f"{stem}-{label}" if label else stem
    name = re.sub(r"[^A-Za-z0-9_.+-]+", "-", text).strip("-._+")[:LONGEST_NAME]
    name = name.removesuffix(".csv").strip("-._+")
    if not classify([Entry(f"unlabelled/{name}.csv")]).recordings:
        raise CapsuleError(f"{displayed(text)!r} gives no valid name; give one with --name")
    return name


def _checksum(content: bytes) -> str:
    """Return the checksum of a recording's samples, without its header lines."""
    lines = [line for line in content.splitlines() if not line.lstrip().startswith(b"#")]
    return hashlib.sha256(b"\n".join(lines)).hexdigest()


def _reading_lines(reading: Reading, keys: Keys) -> Iterator[str]:
    """Yield lines on how a table was read: the keys of lab.yaml, and the reasons."""
    table = reading.table
    used = {reading.time, reading.run, *reading.sensors}
    idle = [index for index in range(len(table.names)) if index not in used]
    place = {table.kind: table.label}
    shown = place | as_map(reading, keys) | place
    shown |= {"not used": table.listed(idle), "passed over": table.losses}
    timing = "time" if reading.time is None else "time_unit"
    reasons = {timing: f"  ({reading.clock.reason})", "unit": f"  ({reading.unit_reason})"}
    left = max(len(key) for key, value in shown.items() if value != "")
    for key, value in shown.items():
        text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
        if text:
            yield f"  {key:<{left}}  {displayed(text)}{reasons.get(key, '')}"


def _sample_lines(recording: Recording) -> Iterator[str]:
    """Yield lines with the first samples of a recording, and a line of bars for each sensor."""
    plain = not (sys.stdout.encoding or "").lower().startswith("utf")
    names = column_names(recording.values.shape[0])
    samples = np.vstack([recording.time_s, recording.values]).T[:_FIRST_SAMPLES]
    rows = [["-" if np.isnan(cell) else f"{cell:.6g}" for cell in row] for row in samples]
    yield from ("  " + "".join(f"{cell:>12}" for cell in row) for row in [names, *rows])
    for name, values in zip(names[1:], recording.values, strict=True):
        parts = [part[~np.isnan(part)] for part in np.array_split(values, min(values.size, _WIDTH))]
        means = [float(part.mean()) if part.size else None for part in parts]
        known = np.concatenate(parts)
        span = f"{known.min():.6g} to {known.max():.6g}" if known.size else "no reading"
        yield f"  {name}  {trace(means, PLAIN_BARS if plain else BARS)}  {span}"
