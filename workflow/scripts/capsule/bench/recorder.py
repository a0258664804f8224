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
from capsule.bench.terminal import Terminal
from capsule.bench.wave import WatchedDrive, Wave
from capsule.engine.configuration import read_settings
from capsule.errors import RecordingError
from capsule.recordings.acceptance import no_evidence_after, readings_of
from capsule.recordings.names import UNLABELLED
from capsule.recordings.recording import TO_THE_END, WAVE_UNTIL, read_recording
from capsule.store.results import OfArchive

if TYPE_CHECKING:
    from capsule.judging.verdict import FinalVerdict

JUDGE_EVERY_S = 0.5
LAST_FRAMES_S = 0.5
RATE_OVER_S = 5.0
LOOK_EVERY_S = 0.05
# An end stop that is pressed in so many samples was never open.
AT_ONCE = 3


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
    log : FrameLog
        Log of the recording.
    tell : callable
        Function that shows a message to the user, and logs it.
    patience_s : float
        Longest wait in seconds for the next sample.
    stop : StopRequest
        Request to stop, by Ctrl-C.
    drive : WatchedDrive, optional
        The wave.

    Attributes
    ----------
    ended : str
        Why the recording has ended; empty while it goes on.
    longest : int or float
        Number of samples beyond which the workflow will reject the recording.
    beside : dict of str to callable
        What is done after each look at the line, and what the recording can do without, such as
        the display: no fault of it ends the recording.
    """

    def __init__(
        self,
        board: Board,
        logger: Logger,
        part: PartFile,
        log: FrameLog,
        tell: Callable[[str], None],
        patience_s: float,
        stop: StopRequest,
        drive: WatchedDrive | None = None,
    ) -> None:
        self._board, self._logger, self._part = board, logger, part
        self._log, self._tell = log, tell
        self._patience_s, self._stop, self._drive = patience_s, stop, drive
        self._wave_until = TO_THE_END
        self.progress = logger.progress
        self.ended = ""
        self.longest = math.inf
        self.beside: dict[str, Callable[[], None]] = {}
        self._rate_mark = (time.monotonic(), 0)
        self._begun_s = elapsed_s()
        self._dated = False

    def archive(self) -> None:
        """Run from the start of the wave to its stop, and archive the samples.

        Raises
        ------
        BoardLostError
            No sample came within the patience; the samples before that are archived.
        AcquisitionError
            The wave does not start, samples cannot be written, or there is none.
        """
        part, lost = self._part, None
        try:
            self._start_wave()
            try:
                self.run()
            finally:
                _stop(self._drive)  # before the files: a disk can be slow
        except BoardLostError as reason:
            self.ended, lost = str(reason), reason
        except AcquisitionError:
            with contextlib.suppress(AcquisitionError):  # write what still fits on the disk
                part.flush()
            part.close()
            raise
        self._note_wave()
        self._log.note(f"ended: {self.ended}")
        if not self.progress.samples:
            part.discard()
            none = AcquisitionError("the run ended before the first sample; nothing is archived")
            raise lost or none
        part.finish()
        if lost:
            raise BoardLostError(f"{lost}; the samples before that are archived in {part.final}")

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
            self._serve_wave()
            self._tell_of_length()
            for what, act in list(self.beside.items()):
                self.attempt(what, act)
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

    def attempt(self, what: str, act: Callable[[], None]) -> None:
        """Do what the recording can do without; after a fault, warn, and do it no more."""
        try:
            act()
        # Whatever it is: a run of the capsule cannot be repeated, a verdict can.
        except Exception as fault:  # noqa: BLE001
            self.beside.pop(what, None)
            text = f"the recording goes on without {what}: {type(fault).__name__}: {fault}"
            print(f"warning: {text}", file=sys.stderr, flush=True)
            self._log.note(f"{text}\n{traceback.format_exc()}")

    def _start_wave(self) -> None:
        """Start the wave; leave no file if the board refuses."""
        if self._drive and not self._stop.reason:
            try:
                self._drive.start()
            except AcquisitionError:
                self._part.path.unlink(missing_ok=True)
                raise

    def _serve_wave(self) -> None:
        """Renew the lease of the wave, and tell if it has stopped."""
        if self._drive:
            if warning := self._drive.watch(self.progress.samples * self.progress.period_s):
                self._tell(warning)
            self.progress.wave = self._drive.summary()
            self._note_wave()

    def _tell_of_length(self) -> None:
        if self.progress.samples > self.longest:
            self._tell(
                f"warning: the run is longer than {self.longest:g} samples "
                f"({self.longest * self.progress.period_s:g} s), so the workflow will reject it "
                "(preprocessing.length); recording continues"
            )
            self.longest = math.inf

    def _note_wave(self) -> None:
        """Write into header and log until when the wave ran."""
        until = self._drive.until if self._drive else TO_THE_END
        if until != self._wave_until:
            self._wave_until = until
            self._part.amend(WAVE_UNTIL, until)
            self._log.note(f"the wave runs until {until} (s of the recording)")

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
    with contextlib.ExitStack() as at_end:
        drive = connected_drive(options.drive, wave) if options.drive else None
        at_end.callback(_stop, drive)
        line, identity = played or _source(options, settings)
        check_fits(identity, settings["recording"])
        sensors, rate_hz = (float(identity.entries[key]) for key in ("channels", "rate_hz"))
        if isinstance(line, StreamLine):
            terminal = Terminal(sys.stdout, line.full_scale)
            header, line.tell = line.header(started), terminal.note
        else:
            terminal = Terminal(sys.stdout, 2 ** int(identity.entries["adc_bits"]) - 1)
            header = header_of(identity, started)
        at_end.callback(terminal.clear)
        header |= wave.entries | {WAVE_UNTIL: drive.until} if drive else {}
        header |= dict(origin or {})
        for entry in ("site", "session", "setup"):
            header |= {entry: value} if (value := getattr(options, entry)) else {}
        outlet = None
        if options.stream_out:
            outlet = SampleOutlet(options.stream_out, header, int(sensors), f"{folder}/{name}")
        stop = at_end.enter_context(contextlib.closing(StopRequest()))
        log = FrameLog(options.logs / folder / f"{name}.log", terminal.note)
        at_end.callback(log.close)
        part = PartFile(final, header, int(sensors), terminal.note)
        log.note(f"logger at {line.port}: {json.dumps(identity.entries)}")
        terminal.note(f"recording {final} from {line.port}; Ctrl-C ends it")

        def tell(text: str) -> None:
            terminal.note(text)
            log.note(text)

        board = Board(line, identity, tell)
        limit = round(options.duration * rate_hz) if options.duration else None
        length = settings["preprocessing"]["length"]
        logger = Logger(board, part, log, tell, limit=limit, kept=length + 1)
        recorder = Recorder(board, logger, part, log, tell, options.patience, stop, drive)
        recorder.longest = length
        progress = recorder.progress
        if outlet:
            recorder.beside["its stream"] = partial(outlet.send, progress)
        if detectors:
            recorder.beside["verdicts"] = _running_verdict(detectors, logger, part.header)
        recorder.beside["its display"] = partial(terminal.show, progress)
        # From here on, Ctrl-C ends the run in order, and samples are on the disk.
        recorder.archive()
        progress.wave = drive.summary() if drive else ""
        terminal.note(f"ended: {recorder.ended}")
        if progress.damaged:
            terminal.note(f"{progress.damaged} damaged frames are kept in {log.path}")
        terminal.note(f"archived {part.final}: {progress.summary()}")
        final_check = partial(_check, part.final, settings, detectors, terminal.note)
        recorder.attempt("the check at its end", final_check)
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
    from capsule.judging.verdict import FinalVerdict, note_of_change  # only if they are used

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


def _running_verdict(
    detectors: "FinalVerdict", logger: Logger, header: Mapping[str, str]
) -> Callable[[], None]:
    """Return a function that judges the recording so far, from time to time."""
    judged_s = 0.0

    def judge() -> None:
        nonlocal judged_s
        if time.monotonic() - judged_s >= JUDGE_EVERY_S:
            logger.progress.verdicts = detectors.judge_so_far(logger.samples, header)
            judged_s = time.monotonic()

    return judge


def _stop(drive: WatchedDrive | None) -> None:
    if drive and (warning := drive.leave()):
        print(warning, file=sys.stderr)


def _check(
    recording: Path,
    settings: dict[str, Any],
    detectors: "FinalVerdict | None",
    tell: Callable[[str], None],
) -> None:
    """Check a recording as the workflow does, while the run can still be repeated, and judge it."""
    rules = settings["recording"]
    try:
        with recording.open("rb") as stream:
            read = read_recording(stream, rules["sensors"], int(rules["max_megabytes"] * 1e6))
        values, no_verdict = readings_of(read, settings)
    except RecordingError as reason:
        tell(f"warning: the workflow will reject this recording: {reason}")
        return
    if reason_in_part := no_evidence_after(read):
        tell(f"warning: {reason_in_part}")
    if no_verdict:
        tell(f"warning: no detector will judge this recording: {no_verdict}")
    elif detectors:
        for line in detectors.judge(values):
            tell(line)
