"""One survey from its first sample to its last: pilot, bench, files and display together."""

import math
import sys
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np

from capsule import words
from capsule.bench.bench_errors import AcquisitionError
from capsule.bench.limits import StopRequest
from capsule.bench.pass_sizes import PassSizes
from capsule.bench.session_folder import EARLIER_ORIGIN, INDEX, ORIGIN, SessionFolder
from capsule.bench.stored_survey import StoredSurvey
from capsule.bench.survey_bench import SurveyBench
from capsule.bench.survey_view import SurveyView
from capsule.recording import Recording
from capsule.survey.pilot import Pilot
from capsule.survey.survey_log import UNFOLDED, UNKNOWN_FOLD, Readings
from capsule.survey.suspects import Place

# Samples in the recording of one pass. It must fit into the paper's matrix, and be long enough to
# show the sensors' usual beats. Two recordings share no samples.
_LONGEST_PASS, _SHORTEST_PASS = 990, 300
# Resolution of stored times.
_CLOCK_STEP_S = 0.001
_NO_INDEX = (
    "warning: the cam shaft has not passed its index, so the map of the earlier sessions (--map) "
    "cannot be used; positions begin at the start of this session"
)


class SurveyRun:
    """One survey.

    Parameters
    ----------
    pilot : Pilot
        The pilot, which decides.
    disk : SessionFolder
        The survey's files.
    sizes : PassSizes
        Estimates nodule sizes from passes.
    view : SurveyView
        The display.
    header : mapping of str to str
        Header of the recordings.
    rate_hz : float
        Sampling rate in Hz.
    length_mm : float
        Length of the gut; an end stop may end the survey earlier.
    earlier_mm : float, optional
        Start of the map of earlier sessions, from the cam shaft's index on.
    index_mm : float, optional
        Phase of the wave at that index, in a resumed session.

    Attributes
    ----------
    trouble : AcquisitionError or None
        The fault of the bench that ended the survey.
    """

    def __init__(
        self,
        pilot: Pilot,
        disk: SessionFolder,
        sizes: PassSizes,
        view: SurveyView,
        header: Mapping[str, str],
        rate_hz: float,
        length_mm: float = math.inf,
        *,
        earlier_mm: float | None = None,
        index_mm: float | None = None,
    ) -> None:
        self._pilot, self._disk, self._sizes, self._view = pilot, disk, sizes, view
        self._header, self._rate_hz, self._length_mm = header, rate_hz, length_mm
        self._earlier_mm, self._index_mm = earlier_mm, index_mm
        self._size_words: dict[int, str] = {}
        self._heard: list[Readings] = []
        self._told = self._kept = 0
        self._passes: dict[int, list[tuple[str, np.ndarray]]] = {}
        # Total time of interruptions; the pilot's clock does not count it.
        self._away_s = 0.0
        self.trouble: AcquisitionError | None = None

    @property
    def begun(self) -> bool:
        """Return whether the survey has samples."""
        return bool(self._heard)

    @property
    def next_s(self) -> float:
        """Time of the next sample from the boards, by the pilot's clock."""
        # Before it comes the empty judgement that stands for the interruption.
        judged = len(self._heard) + bool(self._heard)
        return round(judged * self._pilot.every / self._rate_hz, 3)

    def go_on(self, bench: SurveyBench, stop: StopRequest, begun: datetime | None = None) -> None:
        """Run the survey to its end.

        Parameters
        ----------
        bench : SurveyBench
            Boards and capsule.
        stop : StopRequest
            Request to stop, by Ctrl-C.
        begun : datetime, optional
            Start of an interrupted survey, from which follows the length of the interruption.
        """
        pilot = self._pilot
        while not pilot.cycle.over:
            for event, reason in self._outside(bench, stop):
                self._obey(bench, pilot.tell(event, reason))
            readings = bench.read(pilot.every)
            self._index_mm = bench.index_mm
            if begun is not None:
                self._obey(bench, self._interrupt(begun))
                begun = None
            self._obey(bench, self._take(readings))
            self._disk.keep()
            self._note_map()
            if self._disk.caught_up:
                self._view.show(self._now_s, pilot, self._size_words)
        self._view.end(self._now_s, pilot, self._size_words)
        self._disk.write_places([self._row(place) for place in pilot.suspects.places])

    def repeat(self, stored: StoredSurvey) -> None:
        """Repeat the stored readings and events, so that the pilot has its former state.

        Raises
        ------
        AcquisitionError
            The pilot's decisions differ from the stored ones.
        """
        pilot, told, now_s = self._pilot, list(stored.told), 0.0
        for readings, away_s in zip(stored.readings, stored.away_s, strict=True):
            while told and told[0].number <= len(pilot.log):
                if told[0].number == len(pilot.log):
                    # A later event was the pilot's own; the readings below cause it again.
                    if told[0].time_s > now_s + away_s + _CLOCK_STEP_S:
                        break
                    pilot.tell(told[0].event, told[0].reason)
                del told[0]
            self._away_s = away_s
            self._take(readings)
            now_s = float(readings.time_s[-1])
        self._disk.go_on_from_here()

    def _outside(self, bench: SurveyBench, stop: StopRequest) -> list[tuple[str, str]]:
        """Return events that no reading shows, with their reasons."""
        if self._pilot.cycle.state == "closing":
            return []
        if self.trouble is None and (trouble := bench.trouble):
            self.trouble = trouble
            return [("fault", str(trouble))]
        if stop.reason:
            return [("stopped", stop.reason)]
        if bench.at_end or self._pilot.sensing.position_mm >= self._length_mm:
            return [("gut_ended", "the end of the gut")]
        return []

    def _interrupt(self, begun: datetime) -> tuple[str, ...]:
        """Record the interruption: let the pilot judge missing readings in its place."""
        if not self._heard:
            return ()
        pilot, last = self._pilot, self._heard[-1]
        time_s = np.round(last.time_s + pilot.every / self._rate_hz, 3)
        # The bench has already read the first samples after the interruption.
        unread_s = (2 * pilot.every) / self._rate_hz
        now_s = (datetime.now(UTC) - begun).total_seconds()
        self._away_s = round(max(self._away_s, now_s - unread_s - float(last.time_s[-1])), 3)
        nothing = np.full(last.values.shape, np.nan)
        return self._take(Readings(time_s, nothing, nothing[0], UNKNOWN_FOLD))

    def _take(self, readings: Readings) -> tuple[str, ...]:
        """Store readings, let the pilot judge them, and return its commands."""
        self._heard.append(readings)
        if self._earlier_mm is not None and self._index_mm is not None:
            self._pilot.sensing.take_origin(self._earlier_mm + self._index_mm)
        commands = self._pilot.tick(readings)
        kept = replace(readings, time_s=readings.time_s + self._away_s)
        suspects = self._pilot.suspects
        self._disk.add_readings(
            kept,
            self._pilot.sensing.head_mm,
            suspects.newest_score,
            suspects.threshold.threshold,
        )
        self._note_events()
        return commands

    @property
    def _now_s(self) -> float:
        """Time of the newest sample, interruptions included."""
        return float(self._heard[-1].time_s[-1]) + self._away_s

    def _note_map(self) -> None:
        """Store the start of the map, as soon as it is known."""
        origin_mm, index_mm = self._pilot.sensing.origin_mm, self._index_mm
        self._disk.note(INDEX, index_mm)
        if origin_mm is not None and index_mm is not None:
            self._disk.note(ORIGIN, origin_mm - index_mm)
        if self._earlier_mm is not None and origin_mm is not None and index_mm is None:
            print(_NO_INDEX, file=sys.stderr)
            self._earlier_mm = None
            self._disk.leave_out(EARLIER_ORIGIN)

    @staticmethod
    def _obey(bench: SurveyBench, commands: tuple[str, ...]) -> None:
        for command in commands:
            bench.tell(command)

    def _note_events(self) -> None:
        """Write the new events, and store the passes that are complete."""
        events = self._pilot.log[self._told :]
        self._told = len(self._pilot.log)
        if self._away_s:
            events = [
                replace(event, time_s=round(event.time_s + self._away_s, 3)) for event in events
            ]
        self._disk.add_events(events)
        for event in events:
            if self._disk.caught_up:
                self._view.tell(event)
            if event.before == "finishing" and event.event == "passed":
                self._keep_pass()
            elif event.before == "passing" and event.event != "lost":
                self._keep_pass()
                places = self._pilot.suspects.places
                self._disk.write_places([self._row(place) for place in places])

    def _keep_pass(self) -> None:
        """Store the pass that has just ended as a recording."""
        place = self._pilot.suspects.present
        last = first = len(self._heard)
        least = max(self._kept, last - _LONGEST_PASS // self._pilot.every)
        while first > least and self._heard[first - 1].fold == UNFOLDED:
            first -= 1
        self._kept = last
        stretch = self._heard[first:last]
        if len(stretch) * self._pilot.every < _SHORTEST_PASS:
            return
        values = np.concatenate([readings.values for readings in stretch], axis=1)
        time_s = np.concatenate([readings.time_s for readings in stretch])
        passes = self._passes.setdefault(place.number, [])
        name = f"place-{place.number:02d}-pass-{len(passes) + 1}"
        header = {**self._header, "site": f"{self._header['session']}/place-{place.number:02d}"}
        recording = Recording(np.round(time_s - time_s[0], 6), values, header)
        passes.append((self._disk.add_recording(name, recording), values))

    def _row(self, place: Place) -> dict[str, Any]:
        passes = self._passes.get(place.number, [])
        kind = self._sizes.familiarity([values for _, values in passes])
        said = [kind.sentence] if kind.familiar is False else []
        size = (float("nan"), float("nan"), float("nan"))
        if place.status == "confirmed":
            size = self._sizes.of([values for _, values in passes])
            names = ("estimate_mm", "estimate_low_mm", "estimate_high_mm")
            estimate = dict(zip(names, size, strict=True))
            if words.is_known(size[0]):
                said.append(words.estimated_size(estimate))
        self._size_words[place.number] = "; ".join(said)
        heights = [height for height in place.heights if not np.isnan(height)]
        return {
            "place": place.number,
            "status": place.status or "undecided",
            "place_mm": round(place.place_mm, 1),
            "passes": place.passes,
            **dict(zip(("size_mm", "size_low_mm", "size_high_mm"), size, strict=True)),
            "evidence": place.evidence[0] if place.evidence else float("nan"),
            "height": float(np.mean(heights)) if heights else float("nan"),
            "threshold": place.threshold,
            "recordings": " ".join(name for name, _ in passes),
            **kind.cells,
        }
