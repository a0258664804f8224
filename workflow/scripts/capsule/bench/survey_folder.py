"""The folder of a survey: write its files, and read those of a killed survey."""

import contextlib
import json
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from capsule.arrays import FloatArray, plain
from capsule.bench.bench_errors import AcquisitionError, NameExistsError
from capsule.bench.growing_file import RESUME, FrameLog, GrowingFile, writing
from capsule.kinds import Settings
from capsule.recordings.names import PART, UNLABELLED
from capsule.recordings.recording import Recording, column_names, format_recording
from capsule.store.files import read_json, write_csv, write_json, write_whole
from capsule.survey.files import SessionError, StoredPlace, parse_event
from capsule.survey.listed import ABOUT, EVENTS, PLACES, STREAM
from capsule.survey.survey_log import FOLD_STATES, Event, Readings

RECORDINGS, BOARDS_LOG = "recordings", "boards.log"
# Results of a judgement, with their decimals; only the row of its last sample has them.
JUDGED = {"head_mm": 2, "score": 5, "threshold": 5}
# Entry of session.json that becomes known later: the phase of the wave at the cam shaft's index.
INDEX = "index_mm"


class SessionFolder:
    """The files of one survey.

    Raises
    ------
    NameExistsError
        The session exists.
    AcquisitionError
        A file cannot be written, here and in each method that writes one.
    """

    def __init__(
        self,
        folder: Path,
        about: Settings,
        sensors: int,
        tell: Callable[[str], None] = print,
        *,
        resumed: bool = False,
    ) -> None:
        if not resumed:
            check_new(folder)
            try:
                with writing(folder / ABOUT, "the same command again"):
                    write_json(folder / ABOUT, about)
            except AcquisitionError:
                with contextlib.suppress(OSError):
                    folder.rmdir()
                raise
        self.folder, self._about = folder, dict(about)
        columns = stream_columns(sensors) + "\n"
        self._stream = GrowingFile(folder / STREAM, columns, RESUME, resumed=resumed)
        self._events = GrowingFile(folder / EVENTS, "", RESUME, resumed=resumed)
        self._files = self._stream, self._events
        self.log = FrameLog(folder / BOARDS_LOG, tell)

    def note_index(self, index_mm: float | None) -> None:
        """Store the phase of the wave at the index, once it is known."""
        if index_mm is not None and self._about.get(INDEX) is None:
            self._about[INDEX] = round(index_mm, 3)
            with writing(self.folder / ABOUT, RESUME):
                write_json(self.folder / ABOUT, self._about)

    def add_readings(
        self, time_s: FloatArray, readings: Readings, judgement: tuple[float, float, float]
    ) -> None:
        """Add samples and their times, (K,), to the stream, and their judgement to the last.

        The judgement is the position of the head in mm, the largest evidence that counts in the
        present state, and the threshold above which it is suspicious. The cell of a value that is
        NaN stays empty.
        """
        judged = np.full((time_s.size, len(JUDGED)), np.nan)
        judged[-1] = judgement
        digits = [3, *[0] * len(readings.values), 2, *JUDGED.values()]
        rows = np.column_stack([time_s, readings.values.T, readings.wave_mm, judged])
        for row in rows.tolist():
            cells = [
                "" if math.isnan(value) else f"{value:.{decimals}f}"
                for value, decimals in zip(row, digits, strict=True)
            ]
            self._stream.add(",".join([*cells, readings.fold]) + "\n")

    def add_events(self, events: Iterable[Event]) -> None:
        """Add events to the log."""
        for event in events:
            self._events.add(json.dumps(plain(asdict(event))) + "\n")

    def go_on(self) -> None:
        """Go on behind the repeated lines; the lines of a judgement that was cut off are dropped.

        Raises
        ------
        AcquisitionError
            The repeated lines differ from those of the files, which are unchanged.
        """
        for file, repeated in [(file, file.repeated()) for file in self._files]:
            file.go_on(repeated)

    def keep(self) -> None:
        """Write all lines to the files, and once a second to the disk."""
        for file in self._files:
            file.flush()
            file.sync()

    def add_recording(self, name: str, recording: Recording) -> str:
        """Store a complete pass as a recording, and return its name within the folder."""
        wanted = [self.folder / RECORDINGS / f"{name}.csv"]
        if raw := self._about.get("raw"):
            wanted.append(Path(raw) / UNLABELLED / f"{self.folder.name}-{name}.csv")
        for path in wanted:
            if not path.exists():
                with writing(path, RESUME), write_whole(path, "wb") as stream:
                    stream.write(format_recording(recording))
        return f"{RECORDINGS}/{name}.csv"

    def write_places(self, places: Sequence[StoredPlace]) -> None:
        """Write the table of places."""
        columns = [each.name for each in fields(StoredPlace)]
        with writing(self.folder / PLACES, RESUME):
            write_csv(self.folder / PLACES, columns, map(vars, places))

    def finish(self) -> None:
        """Rename the files to their final names."""
        for file in self._files:
            file.finish()
        self.log.close()

    def close(self) -> None:
        """Close the files under their unfinished names."""
        for file in (*self._files, self.log):
            file.close()

    def discard(self) -> None:
        """Remove a session that holds no sample."""
        self.close()
        for name in (STREAM + PART, EVENTS + PART, BOARDS_LOG, ABOUT):
            (self.folder / name).unlink(missing_ok=True)
        self.folder.rmdir()


def check_new(folder: Path) -> None:
    """Raise `NameExistsError` if the session exists."""
    if folder.exists():
        raise NameExistsError(
            f"{folder} exists, and a session is never overwritten; choose another --out, "
            "or continue the session with --resume"
        )


def stream_columns(sensors: int) -> str:
    """Return the first line of a stream with this number of sensors."""
    return ",".join([*column_names(sensors), "wave_mm", *JUDGED, "fold"])


def read_about(folder: Path) -> dict[str, Any]:
    """Read the settings of a session that was killed.

    Raises
    ------
    AcquisitionError
        The session does not exist, is finished, or was simulated, or its settings are damaged.
    """
    if not (folder / ABOUT).exists():
        raise AcquisitionError(
            f"{folder} holds no session: there is no {ABOUT}; give the folder of a session"
        )
    try:
        about = read_json(folder / ABOUT)
    except ValueError as error:
        raise AcquisitionError(
            f"{folder / ABOUT} is damaged ({error}), so this session cannot be resumed; its "
            f"samples stay in {folder}"
        ) from None
    if (folder / STREAM).exists():
        raise AcquisitionError(f"the session in {folder} is finished; there is nothing to resume")
    if "boards" not in about:
        raise AcquisitionError(
            f"the session in {folder} is simulated, and only a session on boards can be resumed; "
            "simulate it again: its options are the same, with another --out"
        )
    return about


def read_stored(
    folder: Path, recording: Settings, every: int
) -> tuple[list[tuple[Readings, float]], list[Event]]:
    """Read a killed survey up to the last complete judgement that can be read.

    There is a judgement after each `every` samples; `recording` is a section of the configuration.

    Returns
    -------
    judged : list of (Readings, float)
        Readings of each judgement, and the total time of interruptions before it, in seconds.
    events : list of Event
        The log of events.
    """
    rate_hz = recording["rate_hz"]
    rows = list(_rows(folder / (STREAM + PART), recording["sensors"]))
    judged = []
    for start in range(0, len(rows) - every + 1, every):
        numbers, folds = zip(*rows[start : start + every], strict=True)
        # Between two samples there is one period, or an interruption.
        away_s = round(numbers[0][0] - round(start / rate_hz, 3), 3)
        # The same order in memory as at first: another order of sums changes the last digits.
        columns = np.array(numbers).T.copy()
        judged.append((Readings(columns[1:-1], columns[-1], folds[0]), away_s))
    events: list[Event] = []
    with contextlib.suppress(SessionError):
        for number, line in enumerate(_whole_lines(folder / (EVENTS + PART)), start=1):
            events.append(parse_event(number, line))
    return judged, events


def _whole_lines(path: Path) -> list[bytes]:
    """Return the lines of an unfinished file up to its last line feed."""
    return path.read_bytes().split(b"\n")[:-1] if path.exists() else []


def _rows(path: Path, sensors: int) -> Iterator[tuple[list[float], str]]:
    """Read time, readings and wave, and fold state of each row, up to the first unreadable one."""
    lines = _whole_lines(path)
    if lines[:1] != [stream_columns(sensors).encode()]:
        return
    for line in lines[1:]:
        try:
            time_s, *cells, fold = line.decode("ascii").split(",")
            numbers = [float(time_s), *(float(cell or "nan") for cell in cells)]
        except ValueError:
            return
        if len(cells) != sensors + 1 + len(JUDGED) or fold not in FOLD_STATES:
            return
        yield numbers[: sensors + 2], fold
