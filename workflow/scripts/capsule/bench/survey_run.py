"""One survey from its first sample to its last: pilot, files and displays on any bench."""

import contextlib
import math
import sys
from argparse import Namespace
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import partial

import numpy as np

from capsule import words
from capsule.arrays import FloatArray
from capsule.bench.bench_errors import AcquisitionError
from capsule.bench.clock import StopRequest
from capsule.bench.live import opened_page
from capsule.bench.logger import moment_text
from capsule.bench.loop import Loop
from capsule.bench.state import State
from capsule.bench.survey_bench import BoardBench
from capsule.bench.survey_folder import SessionFolder, read_stored
from capsule.bench.terminal import Terminal
from capsule.detectors.files import read_learned
from capsule.detectors.unlike import because, unlike
from capsule.kinds import Settings
from capsule.phantom.simulated_bench import SimulatedBench
from capsule.recordings.recording import Recording
from capsule.store.results import OfArchive
from capsule.survey.cycle import STATES
from capsule.survey.files import StoredPlace
from capsule.survey.pass_sizes import PassSizes
from capsule.survey.pilot import Pilot
from capsule.survey.survey_log import UNFOLDED, UNKNOWN_FOLD, Readings
from capsule.survey.suspects import Place

Bench = BoardBench | SimulatedBench
# Samples in the recording of one pass. It must fit into the paper's matrix, and be long enough to
# show the sensors' usual beats. Two recordings share no samples.
_LONGEST_PASS, _SHORTEST_PASS = 990, 300
# Resolution of stored times.
_CLOCK_STEP_S = 0.001


class SurveyRun:
    """One survey."""

    def __init__(
        self, options: Namespace, about: Settings, settings: Settings, header: Mapping[str, str]
    ) -> None:
        self._recording, detector = settings["recording"], settings["diagonal"]
        sensors = self._recording["sensors"]
        self._header, self._rate_hz = header, float(header["rate_hz"])
        path = options.results / OfArchive.DETECTORS
        learned = read_learned(path) if path.exists() else {}
        self._sizes = PassSizes(learned, detector, self._rate_hz)
        self._on_boards, self._live = "boards" in about, options.live
        if self._on_boards:
            # Odometer and beat detection need the speed of the wave that the board drives.
            detector = detector | {"wave_speed_mm_s": about["wave"]["speed_mm_s"]}
        title = f"{options.out.name}{'' if self._on_boards else ', simulated'}"
        length_mm = math.inf if about["metres"] is None else 1000 * float(about["metres"])
        self.state = State(1.0 / self._rate_hz, title, length_mm=length_mm)
        self._terminal = Terminal(sys.stdout)
        note, resumed = self._terminal.note, options.resume is not None
        self.disk = SessionFolder(options.out, about, sensors, note, resumed=resumed)
        self.pilot = Pilot(detector, self._rate_hz, sensors, targets_mm=about["goto"])
        self._loop = Loop("the survey", self.state, self.disk.log)
        self._size_words: dict[int, str] = {}
        self._heard: list[Readings] = []
        self._told = self._kept = 0
        self._tells_events = False
        self._passes: dict[int, list[tuple[str, np.ndarray]]] = {}
        self._begun: datetime | None = None
        self.trouble: AcquisitionError | None = None

    def go_on(self, bench: Bench, stop: StopRequest, begun: datetime | None = None) -> None:
        """Run the survey to its end; a resumed one has `begun` at this time."""
        self._begun = begun if self._heard else None
        self._tells_events = not self._terminal.redraws
        with opened_page() if self._live else contextlib.nullcontext() as page:
            self._loop.show_on(self._terminal, page)
            self._loop.go_on(partial(self._look, bench, stop))
            self._loop.attempt_due()
        self._terminal.leave()
        self._write_places()

    def _look(self, bench: Bench, stop: StopRequest) -> str:
        """Read, decide and write; return why the survey has ended."""
        pilot = self.pilot
        if event := self._outside(bench, stop):
            for command in pilot.tell(*event):
                bench.tell(command)
        readings = bench.read(pilot.every)
        if readings is not None:
            for command in (*self._interrupt(), *self._take(readings)):
                bench.tell(command)
        self.disk.keep()
        self.disk.note_index(bench.index_mm)
        self._note_state(bench)
        return pilot.log[-1].reason if pilot.cycle.over else ""

    def repeat(self) -> None:
        """Repeat what is stored, so that the pilot has its former state.

        Raises
        ------
        AcquisitionError
            The pilot's decisions differ from the stored ones.
        """
        pilot = self.pilot
        judged, events = read_stored(self.disk.folder, self._recording, pilot.every)
        for readings, away_s in judged:
            # No reading shows these events. A later one was the pilot's own: it comes again.
            until_s = pilot.sensing.now_s + away_s + _CLOCK_STEP_S
            for event in events[len(pilot.log) :]:
                if event.time_s > until_s:
                    break
                pilot.tell(event.event, event.reason)
            self.state.away_s = away_s
            self._take(readings)
        self.disk.go_on()

    def _outside(self, bench: Bench, stop: StopRequest) -> tuple[str, str] | None:
        """Return an event that no reading shows, with its reason; None if there is none."""
        if self.pilot.cycle.state == "closing":
            return None
        if trouble := bench.trouble:
            self.trouble = trouble
            return "fault", str(trouble)
        if stop.reason:
            return "stopped", stop.reason
        # A simulated bench knows itself where the gut ends.
        length_mm = self.state.length_mm if self._on_boards else math.inf
        if bench.at_end or self.pilot.sensing.position_mm >= length_mm:
            return "gut_ended", "the end of the gut"
        return None

    def _interrupt(self) -> tuple[str, ...]:
        """Record an interruption once: let the pilot judge missing readings in its place."""
        begun, self._begun = self._begun, None
        if begun is None:
            return ()
        # The bench has already read the first samples after the interruption.
        unread_s = (2 * self.pilot.every) / self._rate_hz
        away_s = (datetime.now(UTC) - begun).total_seconds() - unread_s - self.pilot.sensing.now_s
        self.state.away_s = round(max(self.state.away_s, away_s), 3)
        nothing = np.full(self._heard[-1].values.shape, np.nan)
        return self._take(Readings(nothing, nothing[0], UNKNOWN_FOLD))

    def _take(self, readings: Readings) -> tuple[str, ...]:
        """Store readings, let the pilot judge them, and return its commands."""
        time_s = self._times_s(len(self._heard), readings.wave_mm.size) + self.state.away_s
        self._heard.append(readings)
        for column in readings.values.T:
            self.state.add(None if np.isnan(column).all() else tuple(column.tolist()))
        commands = self.pilot.tick(readings)
        head_mm, suspects, state = self.pilot.sensing.head_mm, self.pilot.suspects, self.state
        state.score, state.threshold = suspects.newest_score, suspects.threshold.threshold
        self.disk.add_readings(time_s, readings, (head_mm, state.score, state.threshold))
        state.head_known = not math.isnan(head_mm)
        state.head_mm = head_mm if state.head_known else state.head_mm
        self._note_events()
        return commands

    def _times_s(self, judged: int, samples: int) -> FloatArray:
        """Return the times of samples that follow so many judgements, by the pilot's clock."""
        return np.round((judged * self.pilot.every + np.arange(samples)) / self._rate_hz, 3)

    def _note_state(self, bench: Bench) -> None:
        """Write what the displays show."""
        state, pilot = self.state, self.pilot
        state.faults = [str(self.trouble)] if self.trouble else bench.faults
        state.doing, state.following = STATES[pilot.cycle.state], pilot.following
        state.origami = bench.origami
        state.places = [
            (place.number, place.status, place.place_mm, self._size_words.get(place.number, ""))
            for place in pilot.suspects.places
        ]

    def _note_events(self) -> None:
        """Write the new events, and store the passes that are complete."""
        events = [
            replace(event, time_s=round(event.time_s + self.state.away_s, 3))
            for event in self.pilot.log[self._told :]
        ]
        self._told = len(self.pilot.log)
        self.disk.add_events(events)
        for event in events:
            if self._tells_events:
                at = f"{event.time_s:8.1f} s {event.position_mm:7.1f} mm"
                self._terminal.note(f"{at}  {event.after:<11} {event.reason}")
            if event.before == "finishing" and event.event == "passed":
                self._keep_pass()
            elif event.before == "passing" and event.event != "lost":
                self._keep_pass()
                self._write_places()

    def _keep_pass(self) -> None:
        """Store the pass that has just ended as a recording."""
        place = self.pilot.suspects.present
        last = first = len(self._heard)
        least = max(self._kept, last - _LONGEST_PASS // self.pilot.every)
        while first > least and self._heard[first - 1].fold == UNFOLDED:
            first -= 1
        self._kept = last
        stretch = self._heard[first:last]
        if len(stretch) * self.pilot.every < _SHORTEST_PASS:
            return
        values = np.concatenate([readings.values for readings in stretch], axis=1)
        time_s = self._times_s(first, values.shape[1])
        passes = self._passes.setdefault(place.number, [])
        name = f"place-{place.number:02d}-pass-{len(passes) + 1}"
        header = {**self._header, "site": f"{self._header['session']}/place-{place.number:02d}"}
        if "started" in header:  # of the survey; a simulated one has no date
            since = timedelta(seconds=float(time_s[0]) + self.state.away_s)
            header["started"] = moment_text(datetime.fromisoformat(header["started"]) + since)
        recording = Recording(np.round(time_s - time_s[0], 6), values, header)
        passes.append((self.disk.add_recording(name, recording), values))

    def _write_places(self) -> None:
        self.disk.write_places([self._row(place) for place in self.pilot.suspects.places])

    def _row(self, place: Place) -> StoredPlace:
        passes = self._passes.get(place.number, [])
        values = [readings for _, readings in passes]
        kind = self._sizes.familiarity(values).cells
        size = self._sizes.of(values if place.status == "confirmed" else [])
        heights = [height for height in place.heights if not np.isnan(height)]
        row = StoredPlace(
            place=place.number,
            status=place.status or "undecided",
            place_mm=round(place.place_mm, 1),
            may_be_off_mm=place.may_be_off_mm,
            passes=place.passes,
            size_mm=size[0],
            size_low_mm=size[1],
            size_high_mm=size[2],
            evidence=place.evidence[0] if place.evidence else float("nan"),
            height=float(np.mean(heights)) if heights else float("nan"),
            threshold=place.threshold,
            recordings=" ".join(name for name, _ in passes),
            familiar=str(kind["familiar"]),
            unfamiliar_because=because(kind),
        )
        said = [unlike(kind), row.size if words.is_known(row.size_mm) else ""]
        self._size_words[place.number] = "; ".join(filter(None, said))
        return row
