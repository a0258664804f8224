"""Record a run of the capsule from the logger board into raw/."""

import argparse
import signal
import sys
from pathlib import Path

from capsule.bench import recorder, terminal
from capsule.bench.bench_errors import AcquisitionError, CannotArriveError, SurveyFaultError
from capsule.bench.line import BAUD
from capsule.bench.lsl import EXTRA
from capsule.commands.options import positive, recording_name, size_folder
from capsule.engine.project import RECORD_LOGS, config_file
from capsule.errors import WrongOptionError
from capsule.store.results import OfArchive

LONGEST = 100  # characters of an entry of the header, or of a stream's name
STREAM_NAME = "capsule"

EXAMPLES = """
examples:
  %(prog)s --size 3                     record a run over a 3 mm nodule until Ctrl-C
  %(prog)s --unlabelled --detect        record a run over an unknown place, and judge it
  %(prog)s --size 0 --duration 90 --drive /dev/ttyACM1
                                          start the wave, record 90 s without a nodule, stop both
  %(prog)s --size 3 --stream-in gripper record from a stream of the Lab Streaming Layer
  %(prog)s --recover                    complete the recordings of killed recorders
"""


def exit_statuses(success: str, *, of_survey: bool = False) -> str:
    """Return the lines of a command's help that list its exit statuses."""
    kinds = [
        kind
        for kind in AcquisitionError.__subclasses__()
        if of_survey or kind not in (CannotArriveError, SurveyFaultError)
    ]
    statuses = {0: success, 1: "Another fault.", 2: "A wrong option."}
    statuses |= {kind.status: str(kind.__doc__) for kind in kinds} | {130: "Ctrl-C."}
    return "\nexit status:\n" + "\n".join(f"{n:5d} {text}" for n, text in statuses.items())


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of a run, the boards, the streams and the files."""
    parser.epilog = EXAMPLES + exit_statuses("A recording that is archived.")
    run = parser.add_argument_group("the run")
    add = run.add_mutually_exclusive_group(required=True).add_argument
    size = "record a run over a nodule of this size; 0: no nodule"
    add("--size", type=size_folder, metavar="MM", help=size)
    add("--unlabelled", action="store_true", help="record a run over an unknown place")
    recover = "complete the unfinished recording FILE (.part); without FILE, all under raw/"
    add("--recover", nargs="?", const="all", metavar="FILE", help=recover)
    add = run.add_argument
    add("--duration", type=positive, metavar="S", help="stop after S seconds")
    add("--name", type=recording_name, help="the recording's name (default: UTC time)")
    site = "name of the site, written to the header; the report combines its passes"
    add("--site", type=_entry, help=site)
    session = "name of the session, written to the header, such as a date or an assembly"
    add("--session", type=_entry, help=session)
    setup = "name of the set-up, written to the header: one nodule, gut and capsule, set up once"
    add("--setup", type=_entry, help=setup)
    live = "show the sensors in a page on this computer, and open it in the browser"
    add("--live", action="store_true", help=live)
    detect = "show every detector's verdict, during the run and at its end"
    add("--detect", action="store_true", help=detect)

    add_board_options(parser)
    add_wave_options(parser)

    group = parser.add_argument_group("streams of the Lab Streaming Layer", f"need {EXTRA}")
    out = f"also send the samples as a stream while recording (default NAME: {STREAM_NAME})"
    add = group.add_argument
    add("--stream-out", nargs="?", const=STREAM_NAME, type=_stream_name, metavar="NAME", help=out)
    source = "record from the stream of this name or source id instead of a logger board"
    add("--stream-in", type=_stream_name, metavar="NAME", help=source)
    channels = (
        "channels to record, if the stream has more than sensors: labels or numbers from 1, "
        "such as 2,3,4,5; sensor 1 first"
    )
    add("--stream-channels", metavar="LIST", help=channels)

    add = parser.add_argument_group("files").add_argument
    add("--raw", type=Path, default=Path("raw"), help="archive (default: raw/)")
    logs = f"logs, with all damaged frames (default: {RECORD_LOGS}/)"
    add("--logs", type=Path, default=RECORD_LOGS, help=logs)
    templates = (
        "templates for --detect; detectors.json must be in the same folder "
        "(default: results/templates.npz)"
    )
    add("--templates", type=Path, default=Path("results", OfArchive.TEMPLATES), help=templates)
    config = "the workflow's configuration (default: config/config.yaml here, or the shipped one)"
    add("--config", type=Path, default=config_file(), help=config)


def main(arguments: argparse.Namespace) -> None:
    """Record a run or recover one; each fault at the bench has its own exit status.

    Raises
    ------
    AcquisitionError
        A fault at the bench.
    WrongOptionError
        Options contradict each other.
    """
    check(arguments)
    terminal.install()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        if arguments.recover is not None:
            recorder.recover(arguments)
        else:
            recorder.record(arguments)
    except KeyboardInterrupt:
        print("interrupted before the recording began; nothing is archived", file=sys.stderr)
        raise


def check(options: argparse.Namespace) -> None:
    """Raise an error if options contradict each other.

    Raises
    ------
    WrongOptionError
        The message names the options.
    """
    for option, value in vars(options).items():
        # Argparse returns an empty list for an option whose value is two dashes.
        if value == []:
            raise WrongOptionError(f"argument --{option.replace('_', '-')}: '--' is not a value")
    if options.stream_in and options.port:
        raise WrongOptionError(
            "--stream-in records from a stream, --port from a board: give one of the two"
        )
    if options.stream_channels and not options.stream_in:
        raise WrongOptionError(
            "--stream-channels chooses channels of --stream-in NAME, which is not given"
        )
    if options.stream_in and options.stream_in == options.stream_out:
        raise WrongOptionError(
            f"--stream-in and --stream-out both name {options.stream_in!r}: rename one"
        )


def add_board_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for the logger's port and the waiting time."""
    add = parser.add_argument_group("the logger board").add_argument
    add("--port", help="serial port (default: search the USB ports)")
    add("--baud", type=int, default=BAUD, help="bits per second (default: %(default)s)")
    patience = (
        "longest wait for the next sample in seconds, also while the board is unplugged "
        "(default: %(default)g)"
    )
    add("--patience", type=positive, default=60.0, metavar="S", help=patience)


def add_wave_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for the peristalsis board's port and the wave."""
    add = parser.add_argument_group("the peristalsis board").add_argument
    add("--drive", metavar="PORT", help="start and stop the wave at this port")
    speed = "speed of the wave in mm/s (default: %(default)g)"
    add("--speed", type=positive, default=25.0, metavar="MM_S", help=speed)
    ramp = "acceleration of the wave in mm/s^2 (default: %(default)g)"
    add("--ramp", type=positive, default=25.0, metavar="MM_S2", help=ramp)
    ways, direction = ("forward", "backward"), "direction of the wave (default: %(default)s)"
    add("--direction", choices=ways, default="forward", help=direction)


def _stream_name(text: str) -> str:
    """Return the name of a stream; a name that would break a query is an error."""
    if "'" in text:
        raise argparse.ArgumentTypeError(f"{text!r} is not allowed as a stream's name: leave out '")
    return _entry(text)


def _entry(text: str) -> str:
    """Return an entry of the header; a text that the workflow could not read is an error."""
    if not text.strip() or not text.isprintable() or len(text) > LONGEST:
        raise argparse.ArgumentTypeError(
            f"{text[:LONGEST]!r} is not allowed: use 1 to {LONGEST} printable characters (UTF-8)"
        )
    return text
