"""Read the files of a survey."""

import contextlib
import csv
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from capsule import words
from capsule.arrays import FloatArray
from capsule.detectors.verdicts import OF_SURVEY
from capsule.errors import CapsuleError
from capsule.kinds import Row, Settings
from capsule.recordings.names import displayed
from capsule.store.files import read_limited
from capsule.survey.cycle import STATUSES
from capsule.survey.listed import ABOUT, EVENTS, FILES, LARGEST_BYTES, PLACES, STREAM
from capsule.survey.survey_log import Event

_SHOWN = 60


class SessionError(CapsuleError):
    """The error of a session that cannot be read; its text names the file and the fault."""


@dataclass(frozen=True, kw_only=True)
class StoredPlace:
    """A row of places.csv, with an attribute for each column; a number is NaN if it is unknown."""

    place: int  # its number, from 1
    status: str  # one of `capsule.survey.cycle.STATUSES`
    place_mm: float
    may_be_off_mm: float = 0.0  # error of the position, if the capsule was not felt for long
    passes: int  # with evidence
    size_mm: float  # of the nodule, with its interval
    size_low_mm: float
    size_high_mm: float  # infinite if the interval has no upper end
    evidence: float  # of the first pass
    height: float  # mean evidence of all passes in units of the usual evidence
    threshold: float  # above which the first pass was suspicious
    recordings: str  # names of those of its passes
    familiar: str = ""  # yes or no: whether all passes are like the recordings that teach the size
    unfamiliar_because: str = ""  # why they are not, or why that is not known, in words

    @property
    def size(self) -> str:
        """Size of the nodule in words, with its interval."""
        ends = {"mm": self.size_mm, "low_mm": self.size_low_mm, "high_mm": self.size_high_mm}
        return words.estimated_size({f"estimate_{end}": size for end, size in ends.items()})

    @property
    def verdict(self) -> str:
        """Verdict in words, with the size of a nodule: ``nodule, 3.1 mm (2.4 to 3.8)``."""
        word = str(OF_SURVEY[self.status])
        sized = self.status == "confirmed" and words.is_known(self.size_mm)
        return f"{word}, {self.size}" if sized else word


@dataclass(frozen=True)
class Session:
    """A whole survey."""

    name: str  # of its folder
    about: Settings  # parameters with which the survey was started
    # Of each sample, shape (K,); NaN where a cell is empty.
    time_s: FloatArray
    values: FloatArray  # the readings, shape (S, K)
    wave_mm: FloatArray
    head_mm: FloatArray
    score: FloatArray
    threshold: FloatArray
    events: Sequence[Event]
    places: Sequence[StoredPlace]  # those suspected

    @property
    def source(self) -> str:
        """Source of the survey from its own files; empty if they name none."""
        header = self.about.get("header")
        told = header if isinstance(header, dict) and "source" in header else self.about
        return str(told.get("source", ""))


def read_session(folder: Path) -> Session:
    """Read a survey.

    Raises
    ------
    SessionError
        A file cannot be read; the message names the file and the reason.
    """
    contents = {}
    for file in FILES:
        try:
            content = read_limited(folder / file, LARGEST_BYTES)
        except OSError as error:
            raise SessionError(f"{file}: {error.strerror}") from error
        if content is None:
            raise SessionError(f"{file}: larger than {LARGEST_BYTES / 1e6:g} MB")
        contents[file] = content
    return parse_session(folder.name, contents)


def parse_session(name: str, contents: Mapping[str, bytes]) -> Session:
    """Return the session in some files.

    Raises
    ------
    SessionError
        A file is damaged, or was written by an earlier version.
    """
    texts = {file: _text(file, content) for file, content in contents.items()}
    lines = texts[EVENTS].splitlines()
    return Session(
        name,
        _parse_about(texts[ABOUT]),
        **_parse_stream(texts[STREAM]),
        events=[parse_event(number, line) for number, line in enumerate(lines, start=1)],
        places=_parse_places(texts[PLACES]),
    )


def _text(file: str, content: bytes) -> str:
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SessionError(f"{file}: byte {error.start + 1} is not UTF-8 text") from error


def _parse_about(text: str) -> Row:
    try:
        about = json.loads(text)
    except ValueError as error:
        raise SessionError(f"{ABOUT}: this is not JSON: {error}") from error
    if not isinstance(about, dict):
        raise SessionError(f"{ABOUT}: this is not a JSON object of names and values")
    return about


def _columns(file: str, text: str, wanted: Sequence[str]) -> dict[str, list[str]]:
    """Return the cells of a table by column, which must have the wanted ones."""
    try:
        head, *rows = list(csv.reader(io.StringIO(text), strict=True)) or [[]]
    except csv.Error as error:
        raise SessionError(f"{file}: {error}") from error
    if missing := [name for name in wanted if name not in head]:
        raise SessionError(
            f"{file}: there is no column {missing[0]}; another version may have written it"
        )
    for line, row in enumerate(rows, start=2):
        if len(row) != len(head):
            raise SessionError(f"{file}: line {line} has {len(row)} cells instead of {len(head)}")
    return {name: [row[at] for row in rows] for at, name in enumerate(head)}


def _numbers(file: str, columns: Mapping[str, list[str]], name: str) -> FloatArray:
    """Return the numbers in a column; NaN where a cell is empty."""
    numbers = np.full(len(columns[name]), np.nan)
    for at, cell in enumerate(columns[name]):
        if cell == "":
            continue
        with contextlib.suppress(ValueError):
            numbers[at] = float(cell)
        # An interval of the size without an upper end, as the tables of results write it.
        if not math.isfinite(numbers[at]) and (name, cell) != ("size_high_mm", "inf"):
            shown = displayed(cell)[:_SHOWN]
            raise SessionError(f"{file}: line {at + 2}: {name} is {shown!r}, which is not a number")
    return numbers


def _parse_stream(text: str) -> dict[str, Any]:
    named = ("time_s", "wave_mm", "head_mm", "score", "threshold")
    columns = _columns(STREAM, text, ("sensor_1", *named))
    numbers = {name: _numbers(STREAM, columns, name) for name in named}
    if numbers["time_s"].size < 2:
        raise SessionError(f"{STREAM}: there are no samples")
    if not np.all(np.diff(numbers["time_s"]) > 0):
        raise SessionError(f"{STREAM}: time_s does not increase from line to line")
    if np.count_nonzero(~np.isnan(numbers["threshold"])) < 2:
        raise SessionError(f"{STREAM}: fewer than 2 lines have a threshold, so nothing was judged")
    sensors = [name for name in columns if name.startswith("sensor_")]
    values = np.array([_numbers(STREAM, columns, name) for name in sensors])
    return {**numbers, "values": values}


def parse_event(number: int, line: str | bytes) -> Event:
    """Return the event in a line of the log; raise `SessionError` if there is none."""
    try:
        content = json.loads(line)
        cells: dict[str, Any] = {each.name: content[each.name] for each in fields(Event)}
    except (ValueError, KeyError, TypeError) as error:
        raise SessionError(f"{EVENTS}: line {number} is not an event") from error
    for each in fields(Event):
        value, text = cells[each.name], each.type is str
        if value is None and not text and each.name != "time_s":
            cells[each.name] = math.nan
        elif not (isinstance(value, str) if text else _is_number(value)):
            shown, kind = displayed(str(value))[:_SHOWN], "text" if text else "a number"
            raise SessionError(
                f"{EVENTS}: line {number}: {each.name} is {shown!r}, which is not {kind}"
            )
    return Event(**cells)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _parse_places(text: str) -> list[StoredPlace]:
    # A survey of an earlier version has no columns for what has a default.
    needed = [each.name for each in fields(StoredPlace) if each.default is MISSING]
    columns = _columns(PLACES, text, needed)
    known: dict[str, list[Any]] = {
        each.name: columns[each.name]
        if each.type is str
        else _numbers(PLACES, columns, each.name).tolist()
        for each in fields(StoredPlace)
        if each.name in columns
    }
    places = []
    for at, status in enumerate(columns["status"]):
        row = {name: column[at] for name, column in known.items()}
        if status not in STATUSES or math.isnan(row["place"] + row["passes"]):
            raise SessionError(f"{PLACES}: line {at + 2} is not a place with a verdict")
        row |= {name: int(row[name]) for name in ("place", "passes")}
        places.append(StoredPlace(**row))
    return places
