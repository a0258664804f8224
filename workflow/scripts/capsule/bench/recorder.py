"""Record a run, or recover the recording of a killed recorder."""

import argparse
import contextlib
import json
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path

from capsule.bench import growing_file, recovery
from capsule.bench.bench_errors import AcquisitionError, BoardLostError
from capsule.bench.board import Board, connect
from capsule.bench.clock import StopRequest, elapsed_s
from capsule.bench.growing_file import FrameLog, GrowingFile
from capsule.bench.line import BAUD, READ_TIMEOUT_S
from capsule.bench.live import LivePage, opened_page
from capsule.bench.logger import SILENT_AFTER_S, Logger, Source, check_fits, moment_text
from capsule.bench.loop import Loop, kept
from capsule.bench.lsl import SampleOutlet, StreamLine
from capsule.bench.terminal import Terminal
from capsule.bench.wave import Drive, Wave
from capsule.engine.configuration import read_settings
from capsule.judging.verdict import FinalVerdict, note_of_change
from capsule.kinds import Settings
from capsule.recordings.acceptance import check_recording
from capsule.recordings.names import UNLABELLED
from capsule.recordings.recording import WAVE_UNTIL, format_header, format_sample
from capsule.store.results import OfArchive

JUDGE_EVERY_S = 0.5
FLUSH_EVERY = 1000  # samples: a gap of days is written in pieces
# An end stop that is pressed in so many samples was never open.
AT_ONCE = 3
# Characters of "# ", ": " and a time in s, which lasts for years.
_ROOM = 4 + 11


def head_of(header: Mapping[str, str], sensors: int) -> str:
    """Return the first lines of a recording; the time until which the wave ran has room."""
    text = format_header(header, sensors)
    line = f"# {WAVE_UNTIL}: {header.get(WAVE_UNTIL)}"
    return text.replace(f"{line}\n", f"{line:<{len(WAVE_UNTIL) + _ROOM}}\n")


@dataclass
class Recorder:
    """One recording from its first to its last sample, whatever happens to the board."""

    source: Logger
    part: GrowingFile
    header: dict[str, str]
    loop: Loop
    patience_s: float
    stop: StopRequest
    drive: Drive | None = None

    def __post_init__(self) -> None:
        self.state, self.log = self.loop.state, self.loop.log
        self._trouble: AcquisitionError | None = None
        self._begun_s = elapsed_s()

    def archive(self) -> None:
        """Run from the start of the wave to its stop, and archive the samples.

        Raises
        ------
        BoardLostError
            No sample came within the patience; the samples before that are archived.
        AcquisitionError
            The wave does not start, samples cannot be written, or there is none.
        """
        with kept(self.part, lambda: self.state.samples > 0):
            try:
                if self.drive and not self.stop.reason:
                    self.drive.start()
                self.loop.go_on(self._look)
                self.source.end()
            finally:
                leave(self.drive)  # before the files: a disk can be slow
            self._write()
            self._note_wave()
            self.log.note(f"ended: {self.state.ended}")
            if not self.state.samples:
                none = "the run ended before the first sample; nothing is archived"
                raise self._trouble or AcquisitionError(none)
        if self._trouble:
            archived = f"the samples before that are archived in {self.part.final}"
            raise BoardLostError(f"{self._trouble}; {archived}")

    def _look(self) -> str:
        """Read and write what is new, and serve the wave; return why the recording ends."""
        # Read first: samples that came while this program was stopped are in the port.
        self.source.serve(READ_TIMEOUT_S)
        self._write()
        self.part.sync()
        if self.drive:
            self.drive.serve(self.state.samples * self.state.period_s)
        self._note_wave()
        self._note_faults()
        return self._why_over()

    def _write(self) -> None:
        """Write the new samples to the file."""
        new = self.source.take()
        first = self.state.samples - len(new)
        if new and first == 0:
            self._date()
        for number, counts in enumerate(new, first):
            # Without rounding, 3 * 0.1 would be written as 0.30000000000000004.
            time_s = round(number * self.state.period_s, 6)
            self.part.add(format_sample(time_s, counts, self.source.sensors))
            if number % FLUSH_EVERY == 0:
                self.part.flush()
        self.part.flush()

    def _date(self) -> None:
        """Write the time of the first sample into the header."""
        first_s = self.source.taken_s - (self.state.samples - 1) * self.state.period_s
        started = datetime.now(UTC) - timedelta(seconds=elapsed_s() - first_s)
        self._amend("started", moment_text(started))

    def _amend(self, key: str, value: str) -> None:
        """Write an entry of the header anew."""
        self.header[key] = value
        self.part.amend(head_of(self.header, self.source.sensors))

    def _note_faults(self) -> None:
        """Show what is wrong now and what to do, the worst first; warn once of what lasts."""
        longest, too_long = self.state.longest, ""
        if self.state.samples > longest:
            too_long = (
                f"the run is longer than {longest:g} samples "
                f"({longest * self.state.period_s:g} s), so the workflow will reject it "
                "(preprocessing.length); end it, and record anew"
            )
        wave = self.drive.fault if self.drive else ""
        for fault in (wave, too_long):
            if fault and fault not in self.state.faults:
                self.log.tell(f"warning: {fault}")
        self.state.faults = [fault for fault in (wave, self.source.fault, too_long) if fault]

    def _note_wave(self) -> None:
        """Show the wave, and write into header and log until when it ran."""
        if not self.drive:
            return
        self.state.wave = self.drive.summary()
        if (until := self.drive.until) != self.header[WAVE_UNTIL]:
            self._amend(WAVE_UNTIL, until)
            self.log.note(f"the wave runs until {until} (s of the recording)")

    def _why_over(self) -> str:
        """Return why the recording ends; empty if it goes on."""
        if self.source.complete and not self.source.at_end:
            return "--duration is over"
        if self.source.complete and self.state.samples > AT_ONCE:
            return "the capsule reached the end stop"
        if self.source.complete:
            return (
                "the end stop was pressed from the start: its wire is broken, or there is none, "
                "and D2 is not connected to GND (docs/bench.md)"
            )
        if self.stop.reason:
            return self.stop.reason
        late = elapsed_s() - self._begun_s > (self.state.end_s or math.inf)
        over = self.source.trouble(SILENT_AFTER_S, "--duration is over") if late else None
        self._trouble = self.source.trouble(self.patience_s) or over
        return str(self._trouble or "")


def record(
    options: argparse.Namespace,
    played: Source | None = None,
    detectors: FinalVerdict | None = None,
    page: LivePage | None = None,
) -> Path:
    """Record one run: of the options' source, or a `played` one with its `detectors` and `page`.

    Raises
    ------
    AcquisitionError
        The bench or the disk fails.
    """
    started = datetime.now(UTC)
    folder = options.size or UNLABELLED
    name = f"{folder}/{options.name or started.strftime('%Y%m%dT%H%M%SZ')}"
    final: Path = options.raw / f"{name}.csv"
    growing_file.check_free(final)
    settings = read_settings(options.config)
    if parts := growing_file.unfinished(options.raw):
        print(
            f"unfinished recordings under {options.raw}: {len(parts)}, such as {parts[0]}; to "
            "complete them, run: capsule record --recover"
        )
    if options.detect and detectors is None:
        detectors = _learned(options, settings)
    wave = Wave(options.speed, options.ramp, options.direction)
    with contextlib.ExitStack() as at_end:
        terminal = Terminal(sys.stdout)
        at_end.callback(terminal.clear)
        log = FrameLog(options.logs / f"{name}.log", terminal.note)
        at_end.callback(log.close)
        drive = None
        if options.drive:
            # This board is silent, since the drive itself warns.
            wave_board = Board(options.drive, BAUD, "peristalsis", lambda text: None)
            at_end.callback(wave_board.close)
            drive = Drive(wave_board, wave, log)
            drive.set_up()
            at_end.callback(leave, drive)
        if options.live and page is None:
            page = at_end.enter_context(opened_page())
        board = played or _source(options, settings, log)
        check_fits(board.identity, settings["recording"])
        source = Logger(board, log)
        state, loop = source.state, Loop("the recording", source.state, log)
        header = {**board.header, "started": moment_text(started)}
        header |= wave.entries | {WAVE_UNTIL: drive.until} if drive else {}
        for entry in ("site", "session", "setup"):
            header |= {entry: value} if (value := getattr(options, entry)) else {}
        if options.stream_out:
            outlet = SampleOutlet(options.stream_out, header, source.sensors, name)
            loop.add("its stream", partial(outlet.send, state))
        if detectors:
            loop.add("verdicts", partial(_judge_so_far, detectors, source, header), JUDGE_EVERY_S)
        loop.show_on(terminal, page)
        stop = at_end.enter_context(contextlib.closing(StopRequest()))
        part = GrowingFile(final, head_of(header, source.sensors), tell=terminal.note)
        log.note(f"logger at {board.port}: {json.dumps(header)}")
        terminal.note(f"recording {final} from {board.port}; Ctrl-C ends it")
        state.title = f"{name}{', simulated' if played else ''}"
        state.longest = settings["preprocessing"]["length"]
        if options.duration:
            state.end_s = round(options.duration * source.rate_hz) / source.rate_hz
        # From here on, Ctrl-C ends the run in order, and samples are on the disk.
        Recorder(source, part, header, loop, options.patience, stop, drive).archive()
        loop.attempt_due()
        terminal.note(f"ended: {state.ended}")
        if state.damaged:
            terminal.note(f"{state.damaged} damaged frames are kept in {log.path}")
        terminal.note(f"archived {final}: {state.summary()}")
        check = partial(_check, final, settings, detectors, terminal.note)
        loop.attempt("the check at its end", check)
    return final


def recover(options: argparse.Namespace) -> None:
    """Recover unfinished recordings; raise `AcquisitionError` if one of them fails."""
    everything = options.recover == "all"
    parts = growing_file.unfinished(options.raw) if everything else [Path(options.recover)]
    if not parts:
        print(f"nothing to recover under {options.raw}")
    sensors, faults = read_settings(options.config)["recording"]["sensors"], []
    for part in parts:
        try:
            print(recovery.recover(part, sensors))
        except AcquisitionError as fault:
            faults.append(fault)
    for other in faults[:-1]:
        print(f"error: {other}", file=sys.stderr)
    if faults:
        raise faults[-1]


def _learned(options: argparse.Namespace, settings: Settings) -> FinalVerdict:
    """Return the learned detectors; tell the user if they have not learned from all of raw/."""
    learned = options.templates.with_name(OfArchive.DETECTORS)
    detectors = FinalVerdict(options.templates, learned, settings)
    if note := note_of_change(learned.parent, settings):
        print(note)
    return detectors


def _source(options: argparse.Namespace, settings: Settings, log: FrameLog) -> Board | Source:
    """Return the logger that the options name, or the stream in its place."""
    if options.stream_in:
        rules, named = settings["recording"], options.stream_channels
        return StreamLine(options.stream_in, named, rules, log.tell)
    skip = [options.drive] if options.drive else []
    return connect(options.port, options.baud, "logger", log.tell, skip)


def _judge_so_far(detectors: FinalVerdict, source: Logger, header: Mapping[str, str]) -> None:
    source.state.judgement = detectors.judge_so_far(source.samples, header)


def leave(drive: Drive | None) -> None:
    """Stop the wave, and warn if its board does not obey."""
    if drive and (warning := drive.leave()):
        print(warning, file=sys.stderr)


def _check(
    recording: Path, settings: Settings, detectors: FinalVerdict | None, tell: Callable[[str], None]
) -> None:
    """Check a recording as the workflow does, while the run can still be repeated, and judge it."""
    max_bytes = int(settings["recording"]["max_megabytes"] * 1e6)
    name = f"{recording.parent.name}/{recording.stem}"
    content = recording.read_bytes()
    check, values, _ = check_recording(name, content, max_bytes, settings, str(recording))
    rejected = "the workflow will reject this recording: " if check["status"] == "rejected" else ""
    if check["reason"]:
        tell(f"warning: {rejected}{check['reason']}")
    if check["no_verdict"]:
        tell(f"warning: no detector will judge this recording: {check['no_verdict']}")
    elif detectors and not rejected:
        for line in detectors.judge(values).lines():
            tell(line)
