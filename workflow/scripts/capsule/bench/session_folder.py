"""The folder of a survey; its files get their final names only when they are complete."""

import contextlib
import json
import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from capsule.bench.archive import SYNC_EVERY_S, writing
from capsule.bench.bench_errors import AcquisitionError, NameExistsError
from capsule.bench.growing_file import REMEDY, GrowingFile
from capsule.files import read_json, write_csv, write_json, write_whole
from capsule.kinds import Row, Settings
from capsule.names import PART, UNLABELLED
from capsule.recording import Recording, column_names, format_recording
from capsule.survey.listed import ABOUT, EVENTS, PLACES, STREAM
from capsule.survey.odometer import mean_origin
from capsule.survey.survey_log import Event, Readings

RECORDINGS, BOARDS_LOG = "recordings", "boards.log"
# Results of a judgement; only the row of its last sample has them.
JUDGED = ("head_mm", "score", "threshold")
# Entries of session.json that become known later: the phase of the wave at the cam shaft's index;
# the start of the map, as a phase from that index on; and that start in earlier sessions.
INDEX, ORIGIN, EARLIER_ORIGIN = "index_mm", "origin_mm", "earlier_origin_mm"
PLACE_COLUMNS = (
    "place",
    "status",
    "place_mm",
    "passes",
    "size_mm",
    "size_low_mm",
    "size_high_mm",
    "evidence",
    "height",
    "threshold",
    "recordings",
    "familiar",
    "unfamiliar_because",
)


class SessionFolder:
    """The files of one survey.

    Parameters
    ----------
    folder : Path
        The session's folder.
    about : mapping
        Settings of the session, stored as ``session.json``.
    sensors : int
        Number of sensors S.
    resumed : bool
        Whether a killed session left the folder.
    raw : Path or None
        Also store the passes in this ``raw/`` folder of the workflow.

    Raises
    ------
    NameExistsError
        The session exists.
    AcquisitionError
        A file cannot be written, here and in each method that writes one.
    """

    def __init__(
        self, folder: Path, about: Settings, sensors: int, *, resumed: bool, raw: Path | None = None
    ) -> None:
        if not resumed:
            _begin(folder, about)
        self.folder, self._raw, self._about = folder, raw, dict(about)
        self._stream = GrowingFile(folder / STREAM)
        self._events = GrowingFile(folder / EVENTS)
        self._synced_s = time.monotonic()
        self._stream.add(stream_columns(sensors) + "\n")

    @property
    def caught_up(self) -> bool:
        """Return whether a resumed session has reached the point at which it was killed."""
        return self._stream.caught_up

    def note(self, entry: str, value_mm: float | None) -> None:
        """Store an entry of session.json that becomes known during the session."""
        if value_mm is not None and self._about.get(entry) is None:
            self._about[entry] = round(value_mm, 3)
            self._write_about()

    def leave_out(self, entry: str) -> None:
        """Store that an entry is not available."""
        self._about[entry] = None
        self._write_about()

    def _write_about(self) -> None:
        with writing(self.folder / ABOUT, REMEDY):
            write_json(self.folder / ABOUT, self._about)

    def add_readings(
        self, readings: Readings, head_mm: float, score: float, threshold: float
    ) -> None:
        """Add samples to the stream, and the judgement of them to the last.

        The cell of a missing value stays empty.

        Parameters
        ----------
        readings : Readings
            The samples since the last judgement.
        head_mm : float
            Position of the head; NaN if the samples do not show it.
        score, threshold : float
            The largest evidence that counts in the present state (NaN if there is none), and the
            threshold above which it is suspicious.
        """
        judged = [_cell(head_mm, 2), _cell(score, 5), _cell(threshold, 5)]
        last = readings.time_s.size - 1
        for number, (time_s, values, wave_mm) in enumerate(
            zip(readings.time_s.tolist(), readings.values.T, readings.wave_mm.tolist(), strict=True)
        ):
            cells = [f"{time_s:.3f}", *(_cell(value, 0) for value in values), _cell(wave_mm, 2)]
            cells += judged if number == last else [""] * len(judged)
            self._stream.add(",".join([*cells, readings.fold]) + "\n")

    def add_events(self, events: Iterable[Event]) -> None:
        """Add events to the log."""
        for event in events:
            content = {
                key: None if isinstance(value, float) and not math.isfinite(value) else value
                for key, value in asdict(event).items()
            }
            self._events.add(json.dumps(content) + "\n")

    def go_on_from_here(self) -> None:
        """Drop the stored lines that were not repeated: new readings on boards differ from them."""
        self._stream.cut()
        self._events.cut()

    def keep(self) -> None:
        """Write all lines to the files, and once a second to the disk."""
        for file in (self._stream, self._events):
            file.flush()
        if time.monotonic() - self._synced_s >= SYNC_EVERY_S:
            for file in (self._stream, self._events):
                file.sync()
            self._synced_s = time.monotonic()

    def add_recording(self, name: str, recording: Recording) -> str:
        """Store a complete pass as a recording, and return its name within the folder."""
        wanted = [self.folder / RECORDINGS / f"{name}.csv"]
        if self._raw is not None:
            wanted.append(self._raw / UNLABELLED / f"{self.folder.name}-{name}.csv")
        for path in wanted:
            if not path.exists():
                with writing(path, REMEDY), write_whole(path, "wb") as stream:
                    stream.write(format_recording(recording))
        return f"{RECORDINGS}/{name}.csv"

    def write_places(self, rows: Sequence[Row]) -> None:
        """Write the table of places."""
        with writing(self.folder / PLACES, REMEDY):
            write_csv(self.folder / PLACES, PLACE_COLUMNS, rows)

    def finish(self) -> None:
        """Rename the files to their final names."""
        self._stream.finish()
        self._events.finish()

    def close(self) -> None:
        """Close the files under their unfinished names."""
        self._stream.close()
        self._events.close()

    def discard(self) -> None:
        """Remove a session that holds no sample."""
        self.close()
        for name in (STREAM + PART, EVENTS + PART, BOARDS_LOG, ABOUT):
            (self.folder / name).unlink(missing_ok=True)
        self.folder.rmdir()


def _begin(folder: Path, about: Settings) -> None:
    """Make the folder of a new session, or leave none."""
    check_new(folder)
    try:
        with writing(folder / ABOUT, "the same command again"):
            write_json(folder / ABOUT, about)
    except AcquisitionError:
        with contextlib.suppress(OSError):
            folder.rmdir()
        raise


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


def read_origin(folders: Sequence[Path], wavelength_mm: float) -> float:
    """Read the starts of the maps of earlier sessions, and return their mean.

    Raises
    ------
    AcquisitionError
        A folder holds no session, or a session without the start of its map.
    """
    origins_mm = []
    for folder in folders:
        origin_mm = _read_entries(folder, "--map: ").get(ORIGIN)
        if origin_mm is None:
            raise AcquisitionError(
                f"--map: {folder} does not tell where its map begins: the session ended before its "
                "position was known, its bench has no index switch, or an earlier version made it; "
                "leave it out"
            )
        origins_mm.append(origin_mm)
    return mean_origin(origins_mm, wavelength_mm)


def read_about(folder: Path) -> dict[str, Any]:
    """Read the settings of a session that was killed.

    Raises
    ------
    AcquisitionError
        The session does not exist, or it is finished.
    """
    about = _read_entries(folder)
    if (folder / STREAM).exists():
        raise AcquisitionError(f"the session in {folder} is finished; there is nothing to resume")
    return about


def _read_entries(folder: Path, option: str = "") -> dict[str, Any]:
    """Read the entries of ``session.json``."""
    if not (folder / ABOUT).exists():
        raise AcquisitionError(
            f"{option}{folder} holds no session: there is no {ABOUT}; give the folder of a session"
        )
    return read_json(folder / ABOUT)


def _cell(value: float, digits: int) -> str:
    return "" if np.isnan(value) else f"{value:.{digits}f}"
