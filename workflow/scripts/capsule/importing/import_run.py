"""Import files one after the other; a file that cannot be imported is named and passed over."""

import argparse
import contextlib
import os
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TextIO

from capsule.acceptance import readings_of
from capsule.configuration import BENCH, read_settings
from capsule.errors import CapsuleError, RecordingError
from capsule.importing.archiving import ArchivedRuns, run_name
from capsule.importing.guess_view import guess_lines, sample_lines
from capsule.importing.lab_files import keep_map, lab_schema, map_text, read_map
from capsule.importing.lab_map import checked_map
from capsule.importing.mapped_runs import Bench, Guess, Run, as_map, guess_table, runs_of
from capsule.importing.origin import origin_lines
from capsule.importing.question import QuestionError
from capsule.importing.reading_units import advice
from capsule.importing.sensor_files import joined_run
from capsule.importing.source_files import Source, read_source
from capsule.importing.table_choice import choose_tables
from capsule.names import UNLABELLED, displayed
from capsule.recording import Recording

# One option cannot hold one file for each sensor.
NO_OPTION = ("sensor_files",)


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
        self._keys = self._read_keys()
        self._folder = UNLABELLED if options.unlabelled else options.size
        self._archive = ArchivedRuns(options.raw, int(rules["max_megabytes"] * 1e6))
        encoding = (sys.stdout.encoding or "").lower()
        self._plain = not encoding.startswith("utf")
        self.written = self.known = self.refused = 0

    def _read_keys(self) -> SimpleNamespace:
        path = self._options.map
        given = read_map(path) if path else {}
        with _named(str(path) if path else ""):
            return checked_map(
                given | _given_keys(self._options), lab_schema(), self._bench.sensors
            )

    def run(self) -> None:
        """Import all files; print the name of each file that cannot be imported."""
        asked: dict[str, list[str]] = {}
        for files in self._groups():
            try:
                self._import(files)
            except QuestionError as question:
                self.refused += 1
                alike = asked.setdefault(question.subject, [])
                alike.append(_names(files))
                if len(alike) == 1:
                    tell(f"refused: {alike[0]}: {question}", sys.stderr)
            except (CapsuleError, OSError) as fault:
                self.refused += 1
                text = fault if isinstance(fault, CapsuleError) else _disk_text(fault)
                tell(f"refused: {_names(files)}: {text}", sys.stderr)
        for first, *more in asked.values():
            if more:
                tell(f"refused: {', '.join(more)}: the same question as for {first}", sys.stderr)

    def _groups(self) -> list[list[Path]]:
        """Return the files in groups; the files of one group are one run."""
        files = [file for given in self._options.files for file in _expanded(given)]
        sensors = self._bench.sensors
        if self._keys.sensor_files:
            wanted = [f"sensor_{number}" for number in range(1, sensors + 1)]
            named = self._keys.sensor_files
            if sorted(named) != sorted(wanted) or files:
                raise CapsuleError(
                    f"sensor_files: {', '.join(named)} are given; give the files of "
                    f"{', '.join(wanted)} there, and no FILE on the command line"
                )
            return [[Path(named[sensor]) for sensor in wanted]]
        if not files:
            raise CapsuleError("no FILE is given, and lab.yaml names none under sensor_files")
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
        together = len(files) > 1
        guesses, runs, sources = [], [], []
        for file in files:
            guesses_of_file, source = self._guess(file, together=together)
            guesses += guesses_of_file
            sources.append(source)
        if together:
            runs = [(joined_run(guesses, self._keys, self._bench), guesses[0])]
        else:
            several = len(guesses) > 1
            for guess in guesses:
                with _named(guess.table.place):
                    runs_of_table = runs_of(guess, self._keys, self._bench)
                for run in runs_of_table:
                    label = f"{guess.table.label} {run.label}".strip() if several else run.label
                    runs.append((Run(label, run.recording, run.remarks), guess))
        tell(_names(files))
        for guess in guesses:
            tell("\n".join(guess_lines(guess)))
        planned = [self._plan(files, sources, run, guess, guesses) for run, guess in runs]
        # A file is imported completely or not at all. Half of its runs in the archive would hide
        # the error in the other half.
        self._archive.check_free([name for name, _, known, _ in planned if not known])
        for name, recording, known, remarks in planned:
            self._archive_run(name, recording, known, remarks)
        if not self._options.map:
            self._keep_map(as_map(guesses[0], self._keys))

    def _guess(self, file: Path, *, together: bool) -> tuple[list[Guess], Source]:
        """Read a file, and find out what its columns are."""
        bench = self._bench
        needed = 1 if together else bench.sensors
        guesses = []
        with _named(displayed(file.name) if together else ""):
            source = read_source(file, self._keys, needed)
            tables = choose_tables(source.tables, self._keys, needed)
            if together:
                bench = replace(bench, sensors=1)
            for table in tables[:1] if together else tables:
                with _named(table.place):
                    guesses.append(guess_table(table, self._keys, bench))
        return guesses, source

    def _plan(
        self,
        files: Sequence[Path],
        sources: Sequence[Source],
        run: Run,
        guess: Guess,
        guesses: Sequence[Guess],
    ) -> tuple[str, Recording, str, tuple[str, ...]]:
        """Name a run, complete its header, and check whether the archive holds it."""
        stem = files[0].name if files[0].is_dir() else files[0].stem
        name = f"{self._folder}/{run_name(self._options.name or stem, run.label)}"
        header = origin_lines(files, sources, run, guess, guesses) | dict(run.recording.header)
        recording = Recording(run.recording.time_s, run.recording.values, header)
        known = self._archive.known(recording)
        if known:
            self._archive.refuse_other_size(known, name)
        return name, recording, known, run.remarks

    def _archive_run(
        self, name: str, recording: Recording, known: str, remarks: Sequence[str]
    ) -> None:
        tell("\n".join(sample_lines(recording, plain=self._plain)))
        # Two runs of one file may be the same.
        known = known or self._archive.known(recording)
        if known:
            self.known += 1
            tell(f"  already in the archive: {known} holds the same samples; nothing is written")
            return
        if not self._options.dry_run:
            self._archive.add(name, recording)
        self.written += 1
        count, last = recording.time_s.size, recording.time_s[-1]
        verb = "would write" if self._options.dry_run else "wrote"
        path = _near(self._options.raw / f"{name}.csv")
        tell(f"  {verb} {path}: {count} samples, {last:g} s")
        if resampled := recording.header.get("import_resampled"):
            tell(f"  resampled {resampled}")
        for remark in (
            *remarks,
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
            tell("  lab.yaml would be:")
            tell("\n".join(f"    {line}" for line in map_text(content).splitlines()[1:]))
        elif told := keep_map(self._options.write_map, content):
            tell(f"  {told}")

    def summary(self) -> str:
        """Return a line with the numbers of recordings imported and known, and files refused."""
        verb = "would be imported" if self._options.dry_run else "imported"
        there = f", {self.known} already there" if self.known else ""
        came = "1 recording" if self.written == 1 else f"{self.written} recordings"
        kept_out = "1 file" if self.refused == 1 else f"{self.refused} files"
        return f"{came} {verb}{there}, {kept_out} refused"


@contextlib.contextmanager
def _named(place: str) -> Iterator[None]:
    """Put the place of an error in front of its message."""
    try:
        yield
    except QuestionError as question:
        raise QuestionError(f"{place}: {question}" if place else str(question)) from None
    except CapsuleError as fault:
        raise CapsuleError(f"{place}: {fault}" if place else str(fault)) from None


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


def _near(path: Path) -> Path:
    """Return a path relative to the working directory, if it lies below it."""
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path


def _disk_text(fault: OSError) -> str:
    return f"{fault.strerror or fault}; free some space or choose another --raw, and run again"


def _given_keys(options: argparse.Namespace) -> dict[str, object]:
    """Return the keys of lab.yaml that are given as options."""
    said = {
        key: getattr(options, key) for key in lab_schema()["properties"] if key not in NO_OPTION
    }
    if said["sensors"] is not None:
        said["sensors"] = _without_commas(said["sensors"])
    return {key: value for key, value in said.items() if value is not None}


def _without_commas(names: list[str]) -> list[str]:
    """Return column names that are separated by commas, blanks or both."""
    if len(names) > 1 and not all(name.endswith(",") for name in names[:-1]):
        return names
    return [part.strip() for name in names for part in name.split(",") if part.strip()]
