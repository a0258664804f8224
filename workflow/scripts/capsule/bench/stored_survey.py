"""Read a killed survey from disk, in the form in which its pilot got it."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from capsule.bench.session_folder import JUDGED, stream_columns
from capsule.names import PART
from capsule.survey.listed import EVENTS, STREAM
from capsule.survey.survey_log import (
    FOLDED,
    FOLDING,
    RESTING,
    UNFOLDED,
    UNFOLDING,
    UNKNOWN_FOLD,
    Readings,
)

_FOLDS = {UNFOLDED, FOLDING, FOLDED, UNFOLDING, RESTING, UNKNOWN_FOLD}
# Events that the pilot gets from outside; no reading shows them.
_TOLD = {"stopped", "gut_ended", "fault"}


@dataclass(frozen=True)
class Told:
    """An event that the pilot got from outside, with its reason and its number in the log."""

    number: int
    time_s: float
    event: str
    reason: str


@dataclass(frozen=True)
class StoredSurvey:
    """A stored survey.

    Attributes
    ----------
    readings : list of Readings
        Readings of each judgement; their times do not count interruptions.
    away_s : list of float
        Total time of interruptions before each judgement, in seconds.
    told : list of Told
        Events that may have come from outside.
    """

    readings: list[Readings]
    away_s: list[float]
    told: list[Told]


def read_stored(folder: Path, sensors: int, rate_hz: float, every: int) -> StoredSurvey:
    """Read a killed survey up to the last complete judgement that can be read.

    Parameters
    ----------
    folder : Path
        The session's folder.
    sensors : int
        Number of sensors S.
    rate_hz : float
        Sampling rate in Hz.
    every : int
        Number of samples from one judgement to the next.
    """
    rows = list(_rows(folder / (STREAM + PART), sensors))
    readings, away_s, shift_s = [], [], 0.0
    for start in range(0, len(rows) - every + 1, every):
        some = rows[start : start + every]
        # Between two samples there is one period, or an interruption.
        passed_s = np.round((start + np.arange(every)) / rate_hz, 3)
        shift_s = round(some[0][0] - float(passed_s[0]), 3)
        # The same order in memory as at first: another order of sums changes the last digits.
        numbers = np.array([row[1] for row in some]).T.copy()
        readings.append(Readings(passed_s, numbers[:-1], numbers[-1], some[0][2]))
        away_s.append(shift_s)
    return StoredSurvey(readings, away_s, list(_told(folder / (EVENTS + PART))))


def _rows(path: Path, sensors: int) -> Iterator[tuple[float, list[float], str]]:
    """Read time, numbers and fold state of each row, up to the first unreadable one."""
    lines = path.read_bytes().split(b"\n")[:-1] if path.exists() else []
    if lines[:1] != [stream_columns(sensors).encode()]:
        return
    for line in lines[1:]:
        cells = line.decode("ascii", errors="replace").split(",")
        if len(cells) != sensors + 3 + len(JUDGED) or cells[-1] not in _FOLDS:
            return
        try:
            numbers = [float(cell or "nan") for cell in cells[1 : sensors + 2]]
            yield float(cells[0]), numbers, cells[-1]
        except ValueError:
            return


def _told(path: Path) -> Iterator[Told]:
    lines = path.read_bytes().split(b"\n")[:-1] if path.exists() else []
    for number, line in enumerate(lines):
        try:
            event = json.loads(line)
        except ValueError:
            return
        if event["event"] in _TOLD:
            yield Told(number, event["time_s"], event["event"], event["reason"])
