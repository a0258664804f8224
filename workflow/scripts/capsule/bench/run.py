"""The steps of capsule record: record a run, or recover the recording of a killed recorder."""

import argparse
import contextlib
import json
import sys
import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from capsule.acceptance import readings_of
from capsule.bench import archive, boards, recovery
from capsule.bench.bench_errors import AcquisitionError, BoardLostError
from capsule.bench.drive import Drive, Wave
from capsule.bench.frame_log import FrameLog
from capsule.bench.limits import Limits, StopRequest
from capsule.bench.line import Line
from capsule.bench.logger_board import check_fits, header_of
from capsule.bench.protocol import Identity
from capsule.bench.session import Session
from capsule.bench.terminal import Progress, Terminal
from capsule.configuration import read_settings
from capsule.errors import RecordingError
from capsule.names import UNLABELLED
from capsule.recording import read_recording

if TYPE_CHECKING:
    from capsule.bench.stream_line import StreamLine

JUDGE_EVERY_S = 0.5
Samples = list[tuple[float, ...] | None]
Watcher = Callable[[Progress, Samples], None]
# Functions that judge the samples so far; the second has its header already.
Judge = Callable[[Samples, Mapping[str, str]], list[str]]
RunningJudge = Callable[[Samples], list[str]]
Describe = Callable[[datetime, Wave | None], dict[str, str]]


def record(options: argparse.Namespace, origin: Mapping[str, str] | None = None) -> Path:
    """Record one run.

    Parameters
    ----------
    options : argparse.Namespace
        The command line of capsule record.
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
    archive.check_free(final)
    settings = read_settings(options.config)
    _tell_of_unfinished(options.raw)
    judge, judge_all = _judges(options, settings)
    wave = Wave(options.speed, options.ramp, options.direction)
    drive = Drive(options.drive, wave) if options.drive else None
    try:
        line, identity = _source(options, settings)
        stream = None if isinstance(line, Line) else line
        counts = 2 ** int(identity.entries["adc_bits"]) - 1
        terminal = Terminal(sys.stdout, stream.full_scale if stream else counts)
        sensors = int(identity.entries["channels"])
        check_fits(identity, settings["recording"])
        length = settings["preprocessing"]["length"]
        describe: Describe = partial(header_of, identity)
        if stream:
            describe, stream.tell = stream.header, terminal.note
        header = describe(started, wave if drive else None) | dict(origin or {})
        header |= {"site": options.site} if options.site else {}
        header |= {"session": options.session} if options.session else {}
        header |= {"setup": options.setup} if options.setup else {}
        running = _beside(judge, header) if judge else None
        watchers = _watchers(options, drive, running, terminal, f"{folder}/{name}", sensors, length)
        if options.stream_out:
            from capsule.bench.stream_outlet import SampleOutlet, watched_and_sent

            outlet = SampleOutlet(options.stream_out, header, sensors, f"{folder}/{name}")
            watchers = watched_and_sent(watchers, outlet)
        stop = StopRequest()
        log = FrameLog(options.logs / folder / f"{name}.log", terminal.note)
        part = archive.PartFile(final, header, sensors, terminal.note)
        log.note(f"logger at {line.port}: {json.dumps(identity.entries)}")
        limit = round(options.duration / _period_s(identity)) if options.duration else None
        limits = Limits(limit, options.patience, length + 1)
        terminal.note(f"recording {final} from {line.port}; Ctrl-C ends it")
        session = Session(line, identity, part, log, terminal, limits, stop, watchers)
        # Last of all: from here on, Ctrl-C ends the run in order, and samples are on the disk.
        if drive and not stop.reason:
            _start(drive, part, log)
        _run(session, part, terminal, log, drive)
    finally:
        _stop(drive)
    if drive:
        session.progress.wave = drive.summary()
    checked = _tell_outcome(session, terminal, part.final, log.path, settings)
    if checked is None:
        return part.final
    values, no_verdict = checked
    if no_verdict:
        terminal.note(f"warning: no detector will judge this recording: {no_verdict}")
    elif judge_all:
        for verdict in judge_all(values):
            terminal.note(verdict)
    return part.final


def recover(options: argparse.Namespace) -> None:
    """Recover unfinished recordings; raise `AcquisitionError` if one of them fails."""
    everything = options.recover == "all"
    parts = archive.unfinished(options.raw) if everything else [Path(options.recover)]
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
    parts = archive.unfinished(raw)
    if parts:
        print(
            f"unfinished recordings under {raw}: {len(parts)}, such as {parts[0]}; to complete "
            "them, run: capsule record --recover"
        )


def _judges(
    options: argparse.Namespace, settings: dict[str, Any]
) -> tuple[Judge | None, Callable[[np.ndarray], list[str]] | None]:
    """Return functions that judge the samples so far and the whole recording, if wanted."""
    if not options.detect:
        return None, None
    from capsule.bench.verdict import (  # only if they are used
        FinalVerdict,
        RunningVerdict,
        note_of_change,
    )

    learned = options.templates.with_name("detectors.json")
    final = FinalVerdict(options.templates, learned, settings)
    if note := note_of_change(learned.parent, settings):
        print(note)
    return RunningVerdict(final, settings).judge, final.judge


def _beside(judge: Judge, header: Mapping[str, str]) -> RunningJudge:
    return lambda samples: judge(samples, header)


def _source(
    options: argparse.Namespace, settings: dict[str, Any]
) -> tuple["Line | StreamLine", Identity]:
    if options.stream_in:
        from capsule.bench.stream_line import StreamLine  # only if a stream is recorded

        line = StreamLine(options.stream_in, options.stream_channels, settings["recording"])
        return line, line.identity
    if options.port:
        return boards.connect(options.port, options.baud, "logger")
    skip = [options.drive] if options.drive else []
    return boards.find("logger", options.baud, print, skip=skip)


def _period_s(identity: Identity) -> float:
    return 1.0 / float(identity.entries["rate_hz"])


def _watchers(
    options: argparse.Namespace,
    drive: Drive | None,
    judge: RunningJudge | None,
    terminal: Terminal,
    title: str,
    sensors: int,
    length: int,
) -> Watcher:
    """Return one function that shows, drives and judges during the recording."""
    window = None
    if options.plot:
        from capsule.bench.window import Window  # matplotlib only if it is used

        window = Window(title, sensors)
    judged_s = 0.0
    told_of_length = False

    def watch(progress: Progress, samples: Samples) -> None:
        nonlocal judged_s, told_of_length
        if progress.places > length and not told_of_length:
            told_of_length = True
            terminal.note(
                f"warning: the run is longer than {length} samples "
                f"({length * progress.period_s:g} s), so the workflow will reject it "
                "(preprocessing.length); recording continues"
            )
        if drive:
            if warning := drive.watch():
                terminal.note(warning)
            progress.wave = drive.summary()
        if judge and time.monotonic() - judged_s >= JUDGE_EVERY_S:
            progress.verdicts = judge(samples)
            judged_s = time.monotonic()
        terminal.show(progress)
        if window:
            window.show(progress)

    return watch


def _start(drive: Drive, part: archive.PartFile, log: FrameLog) -> None:
    """Start the wave; leave no file if the board refuses."""
    try:
        drive.start()
    except AcquisitionError:
        part.discard()
        log.close()
        raise


def _stop(drive: Drive | None) -> None:
    if drive and (warning := drive.stop()):
        print(warning, file=sys.stderr)


def _run(
    session: Session,
    part: archive.PartFile,
    terminal: Terminal,
    log: FrameLog,
    drive: Drive | None,
) -> None:
    """Record, and archive the samples, even if the board was lost."""
    lost = None
    try:
        try:
            session.run()
        finally:
            _stop(drive)  # before the files: a disk can be slow
    except BoardLostError as reason:
        session.ended, lost = str(reason), reason
    except AcquisitionError as reason:
        with contextlib.suppress(AcquisitionError):  # write what still fits on the disk
            part.flush()
        part.close()
        terminal.clear()
        raise reason
    log.note(f"ended: {session.ended}")
    log.close()
    terminal.clear()
    if not session.progress.places:
        part.discard()
        raise lost or AcquisitionError("the run ended before the first sample; nothing is archived")
    part.finish()
    if lost:
        raise BoardLostError(f"{lost}; the samples before that are archived in {part.final}")


def _tell_outcome(
    session: Session, terminal: Terminal, final: Path, log: Path, settings: dict[str, Any]
) -> tuple[np.ndarray, str] | None:
    """Print how the recording ended.

    Return the result of `readings_of`, or None if the workflow will reject the recording.
    """
    progress = session.progress
    terminal.note(f"ended: {session.ended}")
    if progress.damaged:
        terminal.note(f"{progress.damaged} damaged frames are kept in {log}")
    terminal.note(f"archived {final}: {progress.summary()}")
    try:
        return _accepted(final, settings)
    except RecordingError as reason:
        terminal.note(f"warning: the workflow will reject this recording: {reason}")
        return None


def _accepted(recording: Path, settings: dict[str, Any]) -> tuple[np.ndarray, str]:
    """Check the recording as the workflow does, while the run can still be repeated."""
    rules = settings["recording"]
    with recording.open("rb") as stream:
        read = read_recording(stream, rules["sensors"], int(rules["max_megabytes"] * 1e6))
    return readings_of(read, settings)
