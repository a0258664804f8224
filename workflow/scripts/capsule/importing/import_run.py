"""Import files one after the other; a file that cannot be imported is named and passed over."""

import argparse
import contextlib
import hashlib
import os
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TextIO

from capsule.acceptance import readings_of
from capsule.arguments import LONGEST_NAME
from capsule.configuration import BENCH, read_config_file, read_settings
from capsule.errors import CapsuleError, RecordingError
from capsule.files import list_archive, read_limited, write_new
from capsule.importing.formats import read_source
from capsule.importing.guess_view import guess_lines, sample_lines
from capsule.importing.lab_yaml import checked_map, keep_map, lab_schema, map_text
from capsule.importing.runs import Bench, Guess, Run, as_map, guess_table, joined_run, runs_of
from capsule.importing.table import QuestionError, choose_tables
from capsule.importing.units import advice
from capsule.names import PART, UNLABELLED, Entry, classify, displayed, reason_of_copy
from capsule.recording import Recording, format_recording

_LONGEST_ENTRY = 300


class Importer:
    """An import of files into an archive.

    Parameters
    ----------
    options : argparse.Namespace
        Options of `capsule.importing.command.add_arguments`.

    Attributes
    ----------
    written, known, refused : int
        Numbers of recordings written, of recordings that the archive already held, and of files
        refused.

    Raises
    ------
    CapsuleError
        The options, lab.yaml or the configuration cannot be used.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        settings = read_settings(options.config)
        bench = {key: settings["diagonal"][key] for key in BENCH}
        self._settings = settings | {"diagonal": bench}
        rules = settings["recording"]
        self._bench = Bench(
            rules["sensors"], rules["rate_hz"], rules["rate_tolerance"], bench["full_scale"]
        )
        self._options = options
        given = read_config_file(options.map) if options.map else {}
        with _named(str(options.map or "")):
            self._keys = checked_map(given | _given_keys(options), lab_schema(), rules["sensors"])
        self._folder = UNLABELLED if options.unlabelled else options.size
        self._archive = _Archive(options.raw, int(rules["max_megabytes"] * 1e6))
        self.written = self.known = self.refused = 0

    def run(self) -> None:
        """Import all files; print the name of each file that cannot be imported."""
        asked: dict[str, list[str]] = {}
        for files in self._groups():
            names = _names(files)
            try:
                self._import(files)
            except QuestionError as question:
                self.refused += 1
                alike = asked.setdefault(question.subject, [])
                alike.append(names)
                if len(alike) == 1:
                    tell(f"refused: {names}: {question}", sys.stderr)
            except CapsuleError as fault:
                self.refused += 1
                tell(f"refused: {names}: {fault}", sys.stderr)
            except OSError as fault:
                self.refused += 1
                remedy = "free some space or choose another --raw, and run again"
                tell(f"refused: {names}: {fault.strerror or fault}; {remedy}", sys.stderr)
        for first, *more in asked.values():
            if more:
                tell(f"refused: {', '.join(more)}: the same question as for {first}", sys.stderr)

    def _groups(self) -> list[list[Path]]:
        """Return the files in groups; the files of one group are one run."""
        files = [file for given in self._options.files for file in _expanded(given)]
        if not files:
            raise CapsuleError("no FILE is given; name the files to import")
        sensors = self._bench.sensors
        if self._keys.per_sensor:
            if len(files) != sensors:
                raise CapsuleError(
                    f"per_sensor: {len(files)} files are given, but recording.sensors is "
                    f"{sensors}; give the files of one run, in the order of the sensors"
                )
            return [files]
        if self._options.name and len(files) > 1:
            raise CapsuleError(
                f"--name {self._options.name} is given for {len(files)} files; give it for one"
            )
        return [[file] for file in files]

    def _import(self, files: list[Path]) -> None:
        read = [self._guess(file, together=len(files) > 1) for file in files]
        guesses = [guess for guesses_of_file, _ in read for guess in guesses_of_file]
        if len(files) > 1:
            runs = [(guesses[0], joined_run(guesses, self._keys, self._bench))]
        else:
            runs = [(guess, run) for guess in guesses for run in self._runs_of(guess, len(guesses))]
        tell(_names(files))
        for guess in guesses:
            tell("\n".join(guess_lines(guess)))
        sums = ", ".join(sha256 for _, sha256 in read)
        planned = [self._plan(files, sums, run, guess, guesses) for guess, run in runs]
        # A file is imported completely or not at all. Half of its runs in the archive would hide
        # the error in the other half.
        self._archive.check_free([name for name, run in planned if not self._archive.known(run)])
        for name, run in planned:
            self._archive_run(name, run)
        if not self._options.map:
            self._keep_map(as_map(guesses[0], self._keys))

    def _guess(self, file: Path, *, together: bool) -> tuple[list[Guess], str]:
        """Read a file, and find out what its columns are; return the file's checksum, too."""
        bench = replace(self._bench, sensors=1) if together else self._bench
        with _named(displayed(file.name) if together else ""):
            tables, sha256 = read_source(file, self._keys, bench.sensors)
            tables = choose_tables(tables, self._keys, bench.sensors)
            guesses = []
            for table in tables[:1] if together else tables:
                with _named(table.place):
                    guesses.append(guess_table(table, self._keys, bench))
        return guesses, sha256

    def _runs_of(self, guess: Guess, tables: int) -> list[Run]:
        """Return the runs of a table; of several tables, their labels begin with the table's."""
        with _named(guess.table.place):
            runs = runs_of(guess, self._keys, self._bench)
        if tables == 1:
            return runs
        return [replace(run, label=f"{guess.table.label} {run.label}".strip()) for run in runs]

    def _plan(
        self, files: Sequence[Path], sums: str, run: Run, guess: Guess, guesses: Sequence[Guess]
    ) -> tuple[str, Run]:
        """Name a run, and complete its header."""
        stem = files[0].name if files[0].is_dir() else files[0].stem
        name = f"{self._folder}/{_run_name(self._options.name or stem, run.label)}"
        header = _origin(files, sums, run.label, guess, guesses) | dict(run.recording.header)
        run = replace(run, recording=replace(run.recording, header=header))
        if known := self._archive.known(run):
            self._archive.refuse_other_size(known, name)
        return name, run

    def _archive_run(self, name: str, run: Run) -> None:
        recording = run.recording
        plain = not (sys.stdout.encoding or "").lower().startswith("utf")
        tell("\n".join(sample_lines(recording, plain=plain)))
        # It may be one that this file holds twice.
        if known := self._archive.known(run):
            self.known += 1
            tell(f"  already in the archive: {known} holds the same samples; nothing is written")
            return
        if not self._options.dry_run:
            self._archive.add(name, run)
        self.written += 1
        verb = "would write" if self._options.dry_run else "wrote"
        path, here = self._options.raw / f"{name}.csv", Path.cwd()
        near = path.relative_to(here) if path.is_relative_to(here) else path
        tell(f"  {verb} {near}: {recording.time_s.size} samples, {recording.time_s[-1]:g} s")
        if resampled := recording.header.get("import_resampled"):
            tell(f"  resampled {resampled}")
        for remark in (
            *run.remarks,
            *advice(recording, self._bench.full_scale),
            *self._rejection(recording),
        ):
            tell(f"  note: {remark}")

    def _rejection(self, recording: Recording) -> list[str]:
        """Return the report's reason against a recording that it cannot use; empty if it can."""
        try:
            _, no_verdict = readings_of(recording, self._settings)
        except RecordingError as reason:
            return [f"the report will reject it: {reason}"]
        return [f"the report will give no verdict: {no_verdict}"] if no_verdict else []

    def _keep_map(self, content: dict[str, Any]) -> None:
        if self._options.dry_run:
            lines = [f"    {line}" for line in map_text(content).splitlines()[1:]]
            tell("\n".join(["  lab.yaml would be:", *lines]))
        elif told := keep_map(self._options.write_map, content):
            tell(f"  {told}")

    def summary(self) -> str:
        """Return a line with the numbers of recordings imported and known, and files refused."""
        verb = "would be imported" if self._options.dry_run else "imported"
        there = f", {self.known} already there" if self.known else ""
        came = "1 recording" if self.written == 1 else f"{self.written} recordings"
        kept_out = "1 file" if self.refused == 1 else f"{self.refused} files"
        return f"{came} {verb}{there}, {kept_out} refused"


def _origin(
    files: Sequence[Path], sums: str, label: str, guess: Guess, guesses: Sequence[Guess]
) -> dict[str, str]:
    """Return the header lines with a recording's origin: files, columns, time and unit."""
    table = guess.table
    names = ", ".join(displayed(file.name) for file in files)
    origin = {"source": f"imported from {names}", "import_file": names, "import_sha256": sums}
    if table.kind:
        origin[f"import_{table.kind}"] = table.label
    if label:
        origin["import_run"] = label
    columns = [table.column_label(index) for index in guess.sensors]
    if len(files) > 1:
        columns = [each.table.column_label(each.sensors[0]) for each in guesses]
    time = "none" if guess.time is None else table.column_label(guess.time)
    named = [f"time = {time}"] + [f"sensor_{n} = {each}" for n, each in enumerate(columns, start=1)]
    origin["import_columns"] = "; ".join(named)
    origin["import_time"] = f"{guess.clock.unit}, {guess.clock.reason}"
    origin["import_unit"] = f"{guess.unit}, {guess.unit_reason}"
    if table.passed_over:
        origin["import_passed_over"] = f"{len(table.passed_over)} lines without a whole sample"
    return {key: displayed(text)[:_LONGEST_ENTRY] for key, text in origin.items()}


def _given_keys(options: argparse.Namespace) -> dict[str, object]:
    """Return the keys of lab.yaml that are given as options."""
    said = {key: getattr(options, key) for key in lab_schema()["properties"]}
    if said["sensors"] is not None:
        said["sensors"] = _without_commas(said["sensors"])
    return {key: value for key, value in said.items() if value is not None}


def _without_commas(names: list[str]) -> list[str]:
    """Return column names that are separated by commas, blanks or both."""
    if len(names) > 1 and not all(name.endswith(",") for name in names[:-1]):
        return names
    return [part.strip() for name in names for part in name.split(",") if part.strip()]


@contextlib.contextmanager
def _named(place: str) -> Iterator[None]:
    """Put the place of an error in front of its message."""
    try:
        yield
    except CapsuleError as fault:
        kind = QuestionError if isinstance(fault, QuestionError) else CapsuleError
        raise kind(f"{place}: {fault}" if place else str(fault)) from None


def tell(text: str, stream: TextIO | None = None) -> None:
    """Print a text at once; if its reader has ended, as ``| head`` does, the import goes on."""
    stream = stream or sys.stdout
    try:
        print(text, file=stream, flush=True)
    except BrokenPipeError:
        # The stream's buffer keeps the text, and Python writes it again when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _expanded(given: Path) -> list[Path]:
    """Return the files of a pattern such as *.csv, which a shell of Windows does not expand."""
    if given.exists() or not re.search(r"[*?\[]", given.name):
        return [given]
    return sorted(given.parent.glob(given.name)) or [given]


def _names(files: Sequence[Path]) -> str:
    return ", ".join(displayed(str(file)) for file in files)


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


class _Archive:
    """The recordings under raw/, by the checksum of their samples; larger files are none."""

    def __init__(self, raw: Path, max_bytes: int) -> None:
        self._raw = raw
        self._names: dict[str, str] = {}
        for name in sorted(list_archive(raw).recordings) if raw.is_dir() else ():
            content = read_limited(raw / f"{name}.csv", max_bytes)
            if content is not None:
                self._names[_checksum(content)] = name

    def known(self, run: Run) -> str:
        """Return the name of the recording with the same samples; empty if there is none."""
        return self._names.get(_checksum(format_recording(run.recording)), "")

    def refuse_other_size(self, known: str, name: str) -> None:
        """Raise an error if the archive holds the same samples under another size."""
        reason = reason_of_copy(known, name)
        if "mislabelled" in reason:
            raise CapsuleError(f"{reason}; move {self._raw / known}.csv, or give the right size")

    def check_free(self, names: Sequence[str]) -> None:
        """Raise an error if recordings with names such as ``3mm/r07`` cannot be written."""
        for at, name in enumerate(names):
            path = self._raw / f"{name}.csv"
            part = path.with_name(path.name + PART)
            if taken := next((each for each in (path, part) if each.exists()), None):
                raise CapsuleError(_taken(taken))
            if name in names[:at]:
                raise CapsuleError(
                    f"two of its runs would be written to {path}; give them different names"
                )

    def add(self, name: str, run: Run) -> None:
        """Write a run; its name must be free."""
        path, content = self._raw / f"{name}.csv", format_recording(run.recording)
        try:
            write_new(path, content)
        except FileExistsError:
            raise CapsuleError(_taken(path)) from None
        self._names[_checksum(content)] = name


def _taken(path: Path) -> str:
    return f"{path} exists and holds other samples, so it is not overwritten; give another --name"


def _checksum(content: bytes) -> str:
    """Return the checksum of a recording's samples, without its header lines."""
    lines = [line for line in content.splitlines() if not line.lstrip().startswith(b"#")]
    return hashlib.sha256(b"\n".join(lines)).hexdigest()
