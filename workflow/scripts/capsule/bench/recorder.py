"""Record a run, or recover the recording of a killed recorder."""

import argparse
import contextlib
import json
import math
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from capsule.bench import growing_file, recovery
from capsule.bench.bench_errors import AcquisitionError, BoardLostError
from capsule.bench.board import Board
from capsule.bench.clock import AWAKE, StopRequest, elapsed_s
from capsule.bench.growing_file import FrameLog, PartFile
from capsule.bench.identification import connect, find
from capsule.bench.line import BAUD, AnyLine
from capsule.bench.logger import SILENT_AFTER_S, Logger, check_fits, header_of, moment_text
from capsule.bench.lsl import SampleOutlet, StreamLine
from capsule.bench.protocol import Acknowledgement, Identity
from capsule.bench.terminal import Progress, Terminal
from capsule.bench.wave import WatchedDrive, Wave
from capsule.engine.configuration import read_settings
from capsule.errors import RecordingError
from capsule.recordings.acceptance import no_evidence_after, readings_of
from capsule.recordings.names import UNLABELLED
from capsule.recordings.recording import WAVE_UNTIL, read_recording
from capsule.store.results import OfArchive

if TYPE_CHECKING:
    from capsule.bench.verdict import FinalVerdict

JUDGE_EVERY_S = 0.5
LAST_FRAMES_S = 0.5
RATE_OVER_S = 5.0
LOOK_EVERY_S = 0.05
# An end stop that is pressed in so many samples was never open.
AT_ONCE = 3
Samples = list[tuple[float, ...] | None]
Watcher = Callable[[Progress, Samples], None]


class Recorder:
    """One recording from its first to its last sample, whatever happens to the board.

    Parameters
    ----------
    board : Board
        The logger.
    logger : Logger
        The samples of the board.
    part : PartFile
        The file of the samples.
    patience_s : float
        Longest wait in seconds for the next sample.
    stop : StopRequest
        Request to stop, by Ctrl-C.
    watch : callable
        Function that shows, drives and judges; often called with progress and first samples.

    Attributes
    ----------
    ended : str
        Why the recording has ended; empty while it goes on.
    """

    def __init__(
        self,
        board: Board,
        logger: Logger,
        part: PartFile,
        patience_s: float,
        stop: StopRequest,
        watch: Watcher,
    ) -> None:
        self._board, self._logger, self._part = board, logger, part
        self._patience_s, self._stop, self._watch = patience_s, stop, watch
        self.progress = logger.progress
        self.ended = ""
        self._rate_mark = (time.monotonic(), 0)
        self._begun_s = elapsed_s()
        self._dated = False

    def run(self) -> None:
        """Record until a limit, a request or an error ends it; `ended` is then the reason.

        Raises
        ------
        BoardLostError
            No sample came within the patience; the samples before that are in the file.
        AcquisitionError
            Samples cannot be written.
        """
        while not self.ended:
            # Read first: samples that came while this program was stopped are in the port.
            self._logger.serve(LOOK_EVERY_S)
            self._check_patience()
            self._date()
            self._part.flush()
            self._part.sync()
            self._measure_rate()
            self._watch(self.progress, self._logger.samples)
            self.ended = self._completed() or self._stop.reason
        self._pause()

    def _date(self) -> None:
        """Write the time of the first sample into the header, once it is known."""
        if self._dated or not self.progress.samples:
            return
        self._dated = True
        first_s = self._logger.taken_s - (self.progress.samples - 1) * self.progress.period_s
        started = datetime.now(UTC) - timedelta(seconds=elapsed_s() - first_s)
        self._part.amend("started", moment_text(started))

    def _completed(self) -> str:
        if not self._logger.complete:
            return ""
        if self._logger.at_end and self.progress.samples <= AT_ONCE:
            return (
                "the end stop was pressed from the start: its wire is broken, or there is none, "
                "and D2 is not connected to GND (docs/bench.md)"
            )
        if self._logger.at_end:
            return "the capsule reached the end stop"
        return "--duration is over"

    def _check_patience(self) -> None:
        """Raise `BoardLostError` if no sample came for too long, even if other frames come."""
        silent_s = self._logger.silent_s
        duration_s = self.progress.end_s or math.inf
        if self._logger.complete or self._stop.reason:
            return
        if silent_s > self._patience_s:
            option = "--patience"
        elif silent_s > SILENT_AFTER_S and elapsed_s() - self._begun_s > duration_s:
            option = "--duration is over"
        else:
            return
        what = "sent no sample for" if self._board.connected else "did not come back within"
        raise BoardLostError(f"the board at {self._board.port} {what} {silent_s:.0f} s ({option})")

    def _measure_rate(self) -> None:
        now_s = time.monotonic()
        since_s, count = self._rate_mark
        if now_s - since_s >= RATE_OVER_S or (self.progress.rate_hz == 0 and now_s - since_s >= 1):
            received = self._logger.received
            self.progress.rate_hz = (received - count) / (now_s - since_s)
            self._rate_mark = (now_s, received)

    def _pause(self) -> None:
        """Pause the board, and keep the samples that it sends until it confirms."""
        deadline = AWAKE.now_s() + LAST_FRAMES_S
        self._board.send("pause")
        while self._board.connected and AWAKE.now_s() < deadline:
            if Acknowledgement("pause", "") in self._logger.receive(LOOK_EVERY_S):
                break
        for piece in self._board.close():
            self._logger.note_damaged(piece)
        self._logger.settle()
        self._part.flush()


def record(
    options: argparse.Namespace,
    played: tuple[AnyLine, Identity] | None = None,
    origin: Mapping[str, str] | None = None,
) -> Path:
    """Record one run.

    Parameters
    ----------
    options : argparse.Namespace
        The command line of capsule record.
    played : tuple of AnyLine and Identity, optional
        A simulated board in place of the one that the options name.
    origin : mapping of str to str, optional
        Entries of the header that describe a simulated board.

    Returns
    -------
    Path
        The recording.

    Raises
    ------
    AcquisitionError
        The bench or the disk fails.
    """
    started = datetime.now(UTC)
    name = options.name or started.strftime("%Y%m%dT%H%M%SZ")
    folder = options.size or UNLABELLED
    final = options.raw / folder / f"{name}.csv"
    growing_file.check_free(final)
    settings = read_settings(options.config)
    _tell_of_unfinished(options.raw)
    detectors = _detectors(options, settings) if options.detect else None
    wave = Wave(options.speed, options.ramp, options.direction)
    drive = connected_drive(options.drive, wave) if options.drive else None
    stop: StopRequest | None = None
    try:
        line, identity = played or _source(options, settings)
        check_fits(identity, settings["recording"])
        counts = 2 ** int(identity.entries["adc_bits"]) - 1
        if isinstance(line, StreamLine):
            terminal = Terminal(sys.stdout, line.full_scale)
            header, line.tell = line.header(started), terminal.note
        else:
            terminal = Terminal(sys.stdout, counts)
            header = header_of(identity, started)
        header |= wave.entries | {WAVE_UNTIL: drive.until} if drive else {}
        header |= dict(origin or {})
        for entry in ("site", "session", "setup"):
            header |= {entry: value} if (value := getattr(options, entry)) else {}
        length = settings["preprocessing"]["length"]
        outlet = None
        if options.stream_out:
            sensors = int(identity.entries["channels"])
            outlet = SampleOutlet(options.stream_out, header, sensors, f"{folder}/{name}")
        judge = partial(detectors.judge_so_far, header=header) if detectors else None
        stop = StopRequest()
        log = FrameLog(options.logs / folder / f"{name}.log", terminal.note)
        part = PartFile(final, header, int(identity.entries["channels"]), terminal.note)
        log.note(f"logger at {line.port}: {json.dumps(identity.entries)}")
        terminal.note(f"recording {final} from {line.port}; Ctrl-C ends it")

        def tell(text: str) -> None:
            terminal.note(text)
            log.note(text)

        def note_wave() -> None:
            if drive and drive.until != header[WAVE_UNTIL]:
                header[WAVE_UNTIL] = drive.until
                part.amend(WAVE_UNTIL, drive.until)
                log.note(
                    f"the wave runs until {drive.until} (s of the recording): {drive.summary()}"
                )

        aside = Aside(log)
        watch = _watcher(drive, note_wave, judge, outlet, terminal, aside, length)
        board = Board(line, identity, tell)
        rate_hz = float(identity.entries["rate_hz"])
        limit = round(options.duration * rate_hz) if options.duration else None
        logger = Logger(board, part, log, tell, limit=limit, kept=length + 1)
        recorder = Recorder(board, logger, part, options.patience, stop, watch)
        # Last of all: from here on, Ctrl-C ends the run in order, and samples are on the disk.
        if drive and not stop.reason:
            _start(drive, part, log)
        _run(recorder, part, terminal, log, drive, note_wave, aside)
    finally:
        _stop(drive)
        if stop:
            stop.close()
    if drive:
        recorder.progress.wave = drive.summary()
    progress = recorder.progress
    terminal.note(f"ended: {recorder.ended}")
    if progress.damaged:
        terminal.note(f"{progress.damaged} damaged frames are kept in {log.path}")
    terminal.note(f"archived {part.final}: {progress.summary()}")
    for text in aside("the check at its end", partial(_check, part.final, settings, detectors)):
        terminal.note(text)
    return part.final


def recover(options: argparse.Namespace) -> None:
    """Recover unfinished recordings; raise `AcquisitionError` if one of them fails."""
    everything = options.recover == "all"
    parts = growing_file.unfinished(options.raw) if everything else [Path(options.recover)]
    if not parts:
        print(f"nothing to recover under {options.raw}")
    settings = read_settings(options.config)
    failed: list[AcquisitionError] = []
    for part in parts:
        try:
            rescued = recovery.recover(part, settings["recording"]["sensors"])
        except AcquisitionError as fault:
            failed.append(fault)
            continue
        print(rescued.summary())
    for reason in failed[:-1]:
        print(f"error: {reason}", file=sys.stderr)
    if failed:
        raise failed[-1]


def _tell_of_unfinished(raw: Path) -> None:
    parts = growing_file.unfinished(raw)
    if parts:
        print(
            f"unfinished recordings under {raw}: {len(parts)}, such as {parts[0]}; to complete "
            "them, run: capsule record --recover"
        )


def _detectors(options: argparse.Namespace, settings: dict[str, Any]) -> "FinalVerdict":
    """Return the learned detectors; tell the user if they have not learned from all of raw/."""
    from capsule.bench.verdict import FinalVerdict, note_of_change  # only if they are used

    learned = options.templates.with_name(OfArchive.DETECTORS)
    final = FinalVerdict(options.templates, learned, settings)
    if note := note_of_change(learned.parent, settings):
        print(note)
    return final


def _source(options: argparse.Namespace, settings: dict[str, Any]) -> tuple[AnyLine, Identity]:
    if options.stream_in:
        line = StreamLine(options.stream_in, options.stream_channels, settings["recording"])
        return line, line.identity
    if options.port:
        return connect(options.port, options.baud, "logger")
    skip = [options.drive] if options.drive else []
    return find("logger", options.baud, print, skip=skip)


def connected_drive(port: str, wave: Wave) -> WatchedDrive:
    """Return the wave at a port, set up; its board is silent, since the drive itself warns."""
    board = Board(*connect(port, BAUD, "peristalsis"), lambda text: None)
    drive = WatchedDrive(board, wave)
    try:
        drive.set_up()
    except AcquisitionError:
        board.close()
        raise
    return drive


class Aside:
    """What a recording can do without, such as verdicts and a display: no fault of it ends one.

    Parameters
    ----------
    log : FrameLog
        Log of the recording, for the traceback of a fault.
    """

    def __init__(self, log: FrameLog) -> None:
        self._log = log
        self._failed: set[str] = set()

    def __call__(self, what: str, act: Callable[[], list[str] | None]) -> list[str]:
        """Do something and return its lines; after a fault, warn once and never do it again."""
        if what in self._failed:
            return []
        try:
            return act() or []
        # Whatever it is: a run of the capsule cannot be repeated, a verdict can.
        except Exception as fault:  # noqa: BLE001
            self._failed.add(what)
            text = f"the recording goes on without {what}: {type(fault).__name__}: {fault}"
            print(f"warning: {text}", file=sys.stderr, flush=True)
            self._log.note(f"{text}\n{traceback.format_exc()}")
            return []


def _watcher(
    drive: WatchedDrive | None,
    note_wave: Callable[[], None],
    judge: Callable[[Samples], list[str]] | None,
    outlet: SampleOutlet | None,
    terminal: Terminal,
    aside: Aside,
    length: int,
) -> Watcher:
    """Return one function that shows, drives, judges and sends during the recording."""
    judged_s = 0.0
    told_of_length = False

    def watch(progress: Progress, samples: Samples) -> None:
        nonlocal judged_s, told_of_length
        if outlet:
            aside("its stream", partial(outlet.send, progress))
        if progress.samples > length and not told_of_length:
            told_of_length = True
            terminal.note(
                f"warning: the run is longer than {length} samples "
                f"({length * progress.period_s:g} s), so the workflow will reject it "
                "(preprocessing.length); recording continues"
            )
        if drive:
            if warning := drive.watch(progress.samples * progress.period_s):
                terminal.note(warning)
            note_wave()
            progress.wave = drive.summary()
        if judge and time.monotonic() - judged_s >= JUDGE_EVERY_S:
            progress.verdicts = aside("verdicts", partial(judge, samples))
            judged_s = time.monotonic()
        aside("its display", partial(terminal.show, progress))

    return watch


def _start(drive: WatchedDrive, part: PartFile, log: FrameLog) -> None:
    """Start the wave; leave no file if the board refuses."""
    try:
        drive.start()
    except AcquisitionError:
        part.discard()
        log.close()
        raise


def _stop(drive: WatchedDrive | None) -> None:
    if drive and (warning := drive.leave()):
        print(warning, file=sys.stderr)


def _run(
    recorder: Recorder,
    part: PartFile,
    terminal: Terminal,
    log: FrameLog,
    drive: WatchedDrive | None,
    note_wave: Callable[[], None],
    aside: Aside,
) -> None:
    """Record, and archive the samples, even if the board was lost."""
    lost = None
    try:
        try:
            recorder.run()
        finally:
            _stop(drive)  # before the files: a disk can be slow
        note_wave()
    except BoardLostError as reason:
        recorder.ended, lost = str(reason), reason
    except AcquisitionError as reason:
        with contextlib.suppress(AcquisitionError):  # write what still fits on the disk
            part.flush()
        part.close()
        aside("its display", terminal.clear)
        raise reason
    log.note(f"ended: {recorder.ended}")
    log.close()
    aside("its display", terminal.clear)
    if not recorder.progress.samples:
        part.discard()
        raise lost or AcquisitionError("the run ended before the first sample; nothing is archived")
    part.finish()
    if lost:
        raise BoardLostError(f"{lost}; the samples before that are archived in {part.final}")


def _check(
    recording: Path, settings: dict[str, Any], detectors: "FinalVerdict | None"
) -> list[str]:
    """Check a recording as the workflow does, while the run can still be repeated, and judge it."""
    rules = settings["recording"]
    try:
        with recording.open("rb") as stream:
            read = read_recording(stream, rules["sensors"], int(rules["max_megabytes"] * 1e6))
        values, no_verdict = readings_of(read, settings)
    except RecordingError as reason:
        return [f"warning: the workflow will reject this recording: {reason}"]
    warnings = [f"warning: {text}"] if (text := no_evidence_after(read)) else []
    if no_verdict:
        return [*warnings, f"warning: no detector will judge this recording: {no_verdict}"]
    return [*warnings, *(detectors.judge(values) if detectors else [])]
