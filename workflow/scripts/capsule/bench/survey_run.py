"""One survey from its first sample to its last, on boards or in a simulated gut."""

import argparse
import contextlib
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from capsule import words
from capsule.bench.bench_errors import AcquisitionError, CannotArriveError, SurveyFaultError
from capsule.bench.beside import Beside
from capsule.bench.board import Board
from capsule.bench.clock import StopRequest
from capsule.bench.fold import set_up_fold
from capsule.bench.growing_file import FrameLog
from capsule.bench.live import SHOW_EVERY_S, opened_page
from capsule.bench.logger import check_fits, header_of, moment_text
from capsule.bench.pass_sizes import PassSizes
from capsule.bench.state import State
from capsule.bench.survey_bench import BoardBench, open_boards
from capsule.bench.survey_folder import (
    BOARDS_LOG,
    INDEX,
    SessionFolder,
    check_new,
    read_about,
    read_stored,
)
from capsule.bench.terminal import Terminal
from capsule.bench.wave import Wave
from capsule.engine.configuration import read_settings
from capsule.engine.project import config_file
from capsule.phantom.files import read_phantom
from capsule.phantom.simulated_bench import SOURCE, SimulatedBench, simulated_bench
from capsule.recordings.recording import Recording
from capsule.survey.cycle import STATUSES
from capsule.survey.pilot import Pilot
from capsule.survey.survey_log import UNFOLDED, UNKNOWN_FOLD, Event, Readings
from capsule.survey.suspects import Place

Bench = BoardBench | SimulatedBench
# Samples in the recording of one pass. It must fit into the paper's matrix, and be long enough to
# show the sensors' usual beats. Two recordings share no samples.
_LONGEST_PASS, _SHORTEST_PASS = 990, 300
# Resolution of stored times.
_CLOCK_STEP_S = 0.001


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
    terminal : Terminal
        The display on the terminal.
    state : State
        What the displays show; the survey writes it.
    header : mapping of str to str
        Header of the recordings.
    rate_hz : float
        Sampling rate in Hz.
    length_mm : float
        Length of the gut; an end stop may end the survey earlier.

    Attributes
    ----------
    beside : Beside
        What is done after each judgement, such as the display.
    trouble : AcquisitionError or None
        The fault of the bench that ended the survey.
    """

    def __init__(
        self,
        pilot: Pilot,
        disk: SessionFolder,
        sizes: PassSizes,
        terminal: Terminal,
        state: State,
        header: Mapping[str, str],
        rate_hz: float,
        length_mm: float = math.inf,
    ) -> None:
        self.pilot, self._disk, self._sizes, self._terminal = pilot, disk, sizes, terminal
        self.state = state
        self.beside = Beside("the survey", disk.note)
        self.beside.add("its display", partial(terminal.show, state), terminal.every_s)
        self._header, self._rate_hz, self._length_mm = header, rate_hz, length_mm
        self._size_words: dict[int, str] = {}
        self._heard: list[Readings] = []
        self._told = self._kept = 0
        self._repeating = False
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
        return round(judged * self.pilot.every / self._rate_hz, 3)

    def go_on(self, bench: Bench, stop: StopRequest, begun: datetime | None = None) -> None:
        """Run the survey to its end.

        Parameters
        ----------
        bench : BoardBench or SimulatedBench
            Boards and capsule.
        stop : StopRequest
            Request to stop, by Ctrl-C.
        begun : datetime, optional
            Start of an interrupted survey, from which follows the length of the interruption.
        """
        pilot = self.pilot
        while not pilot.cycle.over:
            for event, reason in self._outside(bench, stop):
                self._obey(bench, pilot.tell(event, reason))
            readings = bench.read(pilot.every)
            if begun is not None:
                self._obey(bench, self._interrupt(begun))
                begun = None
            self._obey(bench, self._take(readings))
            self._disk.keep()
            self._disk.note_index(bench.index_mm)
            self._note_state(bench)
            self.beside.attempt_due()
        self.state.ended = pilot.log[-1].reason
        self.beside.attempt("the end of its display", partial(self._terminal.show, self.state))
        self._terminal.leave()
        self._disk.write_places([self._row(place) for place in pilot.suspects.places])

    def repeat(self, judged: Sequence[tuple[Readings, float]], told: Mapping[int, Event]) -> None:
        """Repeat what `read_stored` returns, so that the pilot has its former state.

        Raises
        ------
        AcquisitionError
            The pilot's decisions differ from the stored ones.
        """
        pilot, now_s, self._repeating = self.pilot, 0.0, True
        for readings, away_s in judged:
            # A later event was the pilot's own; the readings cause it again.
            until_s = now_s + away_s + _CLOCK_STEP_S
            while (event := told.get(len(pilot.log))) and event.time_s <= until_s:
                pilot.tell(event.event, event.reason)
            self._away_s = away_s
            self._take(readings)
            now_s = float(readings.time_s[-1])
        self._repeating = False
        self._disk.go_on()

    def _outside(self, bench: Bench, stop: StopRequest) -> list[tuple[str, str]]:
        """Return events that no reading shows, with their reasons."""
        if self.pilot.cycle.state == "closing":
            return []
        if self.trouble is None and (trouble := bench.trouble):
            self.trouble = trouble
            return [("fault", str(trouble))]
        if stop.reason:
            return [("stopped", stop.reason)]
        if bench.at_end or self.pilot.sensing.position_mm >= self._length_mm:
            return [("gut_ended", "the end of the gut")]
        return []

    def _interrupt(self, begun: datetime) -> tuple[str, ...]:
        """Record the interruption: let the pilot judge missing readings in its place."""
        if not self._heard:
            return ()
        pilot, last = self.pilot, self._heard[-1]
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
        for column in readings.values.T:
            missing = bool(np.isnan(column).all())
            self.state.missing += missing
            self.state.add(None if missing else tuple(column.tolist()))
        commands = self.pilot.tick(readings)
        kept = replace(readings, time_s=readings.time_s + self._away_s)
        suspects = self.pilot.suspects
        self._disk.add_readings(
            kept,
            self.pilot.sensing.head_mm,
            suspects.newest_score,
            suspects.threshold.threshold,
        )
        self._note_events()
        return commands

    def _note_state(self, bench: Bench) -> None:
        """Write what the displays show."""
        state, pilot, suspects = self.state, self.pilot, self.pilot.suspects
        state.away_s = self._away_s
        state.faults = [str(self.trouble)] if self.trouble else bench.faults
        state.doing, state.following = pilot.cycle.state, pilot.following
        state.origami = bench.origami
        state.head_known = not math.isnan(pilot.sensing.head_mm)
        if state.head_known:
            state.head_mm = pilot.sensing.head_mm
        state.score, state.threshold = suspects.newest_score, suspects.threshold.threshold
        state.places = [
            (place.number, place.status, place.place_mm, self._size_words.get(place.number, ""))
            for place in suspects.places
        ]

    @staticmethod
    def _obey(bench: Bench, commands: tuple[str, ...]) -> None:
        for command in commands:
            bench.tell(command)

    def _note_events(self) -> None:
        """Write the new events, and store the passes that are complete."""
        events = self.pilot.log[self._told :]
        self._told = len(self.pilot.log)
        if self._away_s:
            events = [
                replace(event, time_s=round(event.time_s + self._away_s, 3)) for event in events
            ]
        self._disk.add_events(events)
        for event in events:
            if not self._repeating and not self._terminal.redraws:
                at = f"{event.time_s:8.1f} s {event.position_mm:7.1f} mm"
                self._terminal.note(f"{at}  {event.after:<11} {event.reason}")
            if event.before == "finishing" and event.event == "passed":
                self._keep_pass()
            elif event.before == "passing" and event.event != "lost":
                self._keep_pass()
                places = self.pilot.suspects.places
                self._disk.write_places([self._row(place) for place in places])

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
        time_s = np.concatenate([readings.time_s for readings in stretch])
        passes = self._passes.setdefault(place.number, [])
        name = f"place-{place.number:02d}-pass-{len(passes) + 1}"
        header = {**self._header, "site": f"{self._header['session']}/place-{place.number:02d}"}
        if "started" in header:  # of the survey; a simulated one has no date
            since = timedelta(seconds=float(time_s[0]) + self._away_s)
            header["started"] = moment_text(datetime.fromisoformat(header["started"]) + since)
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
            "may_be_off_mm": place.may_be_off_mm,
            "passes": place.passes,
            **dict(zip(("size_mm", "size_low_mm", "size_high_mm"), size, strict=True)),
            "evidence": place.evidence[0] if place.evidence else float("nan"),
            "height": float(np.mean(heights)) if heights else float("nan"),
            "threshold": place.threshold,
            "recordings": " ".join(name for name, _ in passes),
            **kind.cells,
        }


def survey(options: argparse.Namespace) -> None:
    """Survey a gut, go to targets in it, or set up the fold board.

    Raises
    ------
    CannotArriveError
        The capsule did not reach its target.
    SurveyFaultError
        The origami did not fold or unfold.
    AcquisitionError
        A board is missing, refuses or was lost.
    """
    if options.fold_set_up:
        set_up_fold(options.fold, options.baud)
        return
    folder, resumed = options.resume or options.out, options.resume is not None
    if not resumed:
        check_new(folder)
    about = read_about(folder) if resumed else _about(options)
    settings = read_settings(config_file())
    # From here on Ctrl-C no longer kills the program: the origami must be unfolded first.
    stop = StopRequest()
    survey_it = _on_boards if "boards" in about else _simulated
    run = survey_it(options, about, settings, folder, stop)
    _tell_outcome(run, folder, to_targets=bool(about["goto"]))


def _length_mm(about: dict[str, Any]) -> float:
    """Return the length of the gut; infinite if unknown."""
    return math.inf if about["metres"] is None else 1000 * float(about["metres"])


def _about(options: argparse.Namespace) -> dict[str, Any]:
    about = {
        "metres": options.metres,
        "goto": options.goto,
        "raw": None if options.raw is None else str(options.raw),
    }
    if options.simulate:
        return about | {
            "source": SOURCE,
            "nodules": options.nodules,
            "seed": options.seed,
            "parameters": str(options.parameters),
            "bench": options.bench,
            "changes": options.changes,
        }
    return about | {
        "boards": _ports(options),
        "wave": {
            "speed_mm_s": options.speed,
            "ramp_mm_s2": options.ramp,
            "direction": options.direction,
        },
        INDEX: None,
    }


def _ports(options: argparse.Namespace) -> dict[str, str | None]:
    return {"drive": options.drive, "fold": options.fold, "logger": options.port}


def _simulated(
    options: argparse.Namespace,
    about: dict[str, Any],
    settings: dict[str, Any],
    folder: Path,
    stop: StopRequest,
) -> SurveyRun:
    """Survey a simulated gut."""
    phantom = read_phantom(Path(about["parameters"]), about["changes"], about["bench"])
    bench = simulated_bench(
        phantom,
        seed=about["seed"],
        length_mm=_length_mm(about),
        nodules_mm=about["nodules"],
        sensors=settings["recording"]["sensors"],
    )
    header = bench.header | {"session": folder.name}
    with _run(options, about, settings, folder, phantom.electronics.rate_hz, header) as run:
        run.go_on(bench, stop)
    return run


def _on_boards(
    options: argparse.Namespace,
    about: dict[str, Any],
    settings: dict[str, Any],
    folder: Path,
    stop: StopRequest,
) -> SurveyRun:
    """Survey on boards.

    A resumed survey reads the stored samples and continues where the capsule is.
    """
    resumed = options.resume is not None
    # A board can have another port than in the killed session.
    given = {name: port for name, port in _ports(options).items() if port is not None}
    ports = about["boards"] | given
    boards = {} if resumed else open_boards(ports, options.baud, print, stop)
    try:
        if not resumed:
            about |= _known_with(boards, settings, Wave(**about["wave"]), folder)
        rate_hz, sensors = (settings["recording"][key] for key in ("rate_hz", "sensors"))
        with _run(options, about, settings, folder, rate_hz, about["header"]) as run:
            if resumed:
                run.repeat(*read_stored(folder, sensors, rate_hz, run.pilot.every))
            if not run.pilot.cycle.over:
                boards = boards or open_boards(ports, options.baud, print, stop)
                _lead(run, boards, about, folder, stop, options.patience)
    finally:
        for board in boards.values():
            board.close()
    return run


@contextlib.contextmanager
def _run(
    options: argparse.Namespace,
    about: dict[str, Any],
    settings: dict[str, Any],
    folder: Path,
    rate_hz: float,
    header: Mapping[str, str],
) -> Iterator[SurveyRun]:
    """Make a survey with its pilot and its files; complete the files at its end."""
    raw = None if about["raw"] is None else Path(about["raw"])
    sensors, resumed = settings["recording"]["sensors"], options.resume is not None
    detector, length_mm, title = settings["diagonal"], _length_mm(about), folder.name
    sizes = PassSizes(options.results, detector, rate_hz)
    state = State(1.0 / rate_hz, title, length_mm=length_mm)
    if "boards" in about:
        # Odometer and beat detection need the speed of the wave that the board drives.
        detector = detector | {"wave_speed_mm_s": about["wave"]["speed_mm_s"]}
    else:
        state.title = f"{title}, simulated"
        length_mm = math.inf  # the bench knows itself where the gut ends
    disk = SessionFolder(folder, about, sensors, resumed=resumed, raw=raw)
    pilot = Pilot(detector, rate_hz, sensors, targets_mm=about["goto"])
    run = SurveyRun(pilot, disk, sizes, Terminal(sys.stdout), state, header, rate_hz, length_mm)
    try:
        with contextlib.ExitStack() as at_end:
            if options.live:
                page = at_end.enter_context(opened_page())
                run.beside.add("its live page", partial(page.show, state), SHOW_EVERY_S)
            yield run
            if options.live:
                run.beside.attempt("its live page", partial(page.show, state))
    except BaseException:
        if run.begun or resumed:
            disk.close()
        else:
            disk.discard()
        raise
    disk.finish()


def _lead(
    run: SurveyRun,
    boards: Mapping[str, Board],
    about: dict[str, Any],
    folder: Path,
    stop: StopRequest,
    patience_s: float,
) -> None:
    """Run the survey; always stop the wave and unfold the origami at its end."""
    log = FrameLog(folder / BOARDS_LOG)
    bench = BoardBench(
        boards,
        Wave(**about["wave"]),
        log,
        stop,
        patience_s=patience_s,
        begin_s=run.next_s,
        index_mm=about[INDEX],
    )
    try:
        bench.start()
        begun = datetime.fromisoformat(about["begun"]) if run.begun else None
        run.go_on(bench, stop, begun)
    except KeyboardInterrupt:
        print("ended by Ctrl-C before the first sample; nothing new is kept", file=sys.stderr)
        raise
    finally:
        for warning in bench.leave():
            print(warning, file=sys.stderr)
        log.close()


def _known_with(
    boards: Mapping[str, Board], settings: dict[str, Any], wave: Wave, folder: Path
) -> dict[str, Any]:
    """Return the entries known only once the boards are connected: start time and header."""
    logger, peristalsis = boards["logger"].identity, boards["peristalsis"].identity
    check_fits(
        float(logger.entries["rate_hz"]), int(logger.entries["channels"]), settings["recording"]
    )
    driven_mm = peristalsis.entries["wavelength_mm"]
    expected_mm = settings["diagonal"]["wavelength_mm"]
    if float(driven_mm) != expected_mm:
        raise AcquisitionError(
            f"the peristalsis board drives waves of {driven_mm} mm, but the workflow is configured "
            f"for {expected_mm:g} mm; correct diagonal.wavelength_mm in config/config.yaml"
        )
    begun = datetime.now(UTC)
    header = header_of(logger) | {"started": moment_text(begun)} | wave.entries
    header |= {"session": folder.name}
    return {"begun": begun.isoformat(timespec="milliseconds"), "header": header}


def _tell_outcome(run: SurveyRun, folder: Path, *, to_targets: bool) -> None:
    pilot = run.pilot
    places = pilot.suspects.places
    counts = {
        status: sum((place.status or "undecided") == status for place in places)
        for status in STATUSES
    }
    listed = ", ".join(f"{count} {status}" for status, count in counts.items())
    print(f"{folder}: {len(places)} places suspected ({listed})")
    if pilot.cycle.no_return:
        print("the capsule cannot go back: folding did not bring it back", file=sys.stderr)
    if run.trouble:
        raise run.trouble
    happened = {event.event for event in pilot.log}
    if "cannot_arrive" in happened:
        raise CannotArriveError("the capsule cannot go back to the target")
    if "fault" in happened or any(
        event.event == "late" and event.after in ("closing", "ended") for event in pilot.log
    ):
        raise SurveyFaultError(f"the origami did not obey: {pilot.log[-1].reason}")
    if "stopped" in happened:
        raise KeyboardInterrupt
    if to_targets and "arrived" not in happened:
        raise CannotArriveError("the survey ended before the capsule reached the target")
