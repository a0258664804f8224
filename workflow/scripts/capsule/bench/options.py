"""The command line of acquire.py."""

import argparse
from pathlib import Path

from capsule.bench.line import BAUD
from capsule.bench.stream_options import add_stream_options, fault_of_streams
from capsule.number_arguments import positive
from capsule.run_arguments import recording_name, size_folder
from capsule.workflow_call import data_config, data_folder

LONGEST_ENTRY = 100  # characters of a site or session

EXAMPLES = """
examples:
  %(prog)s --size 3                     record a run over a 3 mm nodule until Ctrl-C
  %(prog)s --unlabelled --detect        record a run over an unknown place, and judge it
  %(prog)s --size 0 --duration 90 --drive /dev/ttyACM1
                                          start the wave, record 90 s without a nodule, stop both
  %(prog)s --size 3 --stream-in gripper record from a stream of the Lab Streaming Layer
  %(prog)s --recover                    complete the recordings of killed recorders

exit status:
  0 archived            1 other fault        2 wrong option       3 no board, or several
  4 no answer           5 port in use        6 no permission      7 wrong baud rate
  8 wrong board         9 disk full         10 name exists       11 board lost (part is archived)
 12 refused by a board
"""


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the options; end the program with status 2 if one is wrong."""
    parser = argparse.ArgumentParser(
        description="Record a run of the capsule from the logger board into raw/.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    _add_run_options(parser)
    add_board_options(parser)
    add_wave_options(parser)
    add_stream_options(parser)
    _add_place_options(parser)
    options = parser.parse_args(arguments)
    for option, value in vars(options).items():
        # Argparse returns an empty list for an option whose value is two dashes.
        if value == []:
            parser.error(f"argument --{option.replace('_', '-')}: '--' is not a value")
    modes = [options.size is not None, options.unlabelled, options.recover is not None]
    if sum(modes) != 1:
        parser.error("give exactly one of --size MM, --unlabelled and --recover")
    if fault := fault_of_streams(options):
        parser.error(fault)
    return options


def _add_run_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("the run")
    group.add_argument(
        "--size",
        type=size_folder,
        metavar="MM",
        help="record a run over a nodule of this size; 0: no nodule",
    )
    group.add_argument(
        "--unlabelled", action="store_true", help="record a run over an unknown place"
    )
    group.add_argument(
        "--recover",
        nargs="?",
        const="all",
        metavar="FILE",
        help="complete the unfinished recording FILE (.part); without FILE, all under raw/",
    )
    group.add_argument("--duration", type=positive, metavar="S", help="stop after S seconds")
    group.add_argument(
        "--name", type=recording_name, help="the recording's name (default: UTC time)"
    )
    group.add_argument(
        "--site",
        type=_entry,
        help="name of the site, written to the header; the report combines its passes",
    )
    group.add_argument(
        "--session",
        type=_entry,
        help="name of the session, written to the header, such as a date or an assembly",
    )
    group.add_argument(
        "--setup",
        type=_entry,
        help="name of the set-up, written to the header: one nodule, gut and capsule, set up once",
    )
    group.add_argument("--plot", action="store_true", help="show the sensors in a window")
    group.add_argument(
        "--detect",
        action="store_true",
        help="show every detector's verdict, during the run and at its end",
    )


def add_board_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for the logger's port and the waiting time."""
    group = parser.add_argument_group("the logger board")
    group.add_argument("--port", help="serial port (default: search the USB ports)")
    group.add_argument(
        "--baud", type=int, default=BAUD, help="bits per second (default: %(default)s)"
    )
    group.add_argument(
        "--patience",
        type=positive,
        default=60.0,
        metavar="S",
        help="longest wait for the next sample in seconds, also while the board is unplugged "
        "(default: %(default)g)",
    )


def add_wave_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for the peristalsis board's port and the wave."""
    group = parser.add_argument_group("the peristalsis board")
    group.add_argument("--drive", metavar="PORT", help="start and stop the wave at this port")
    group.add_argument(
        "--speed",
        type=positive,
        default=25.0,
        metavar="MM_S",
        help="speed of the wave in mm/s (default: %(default)g)",
    )
    group.add_argument(
        "--ramp",
        type=positive,
        default=25.0,
        metavar="MM_S2",
        help="acceleration of the wave in mm/s^2 (default: %(default)g)",
    )
    group.add_argument(
        "--direction",
        choices=("forward", "backward"),
        default="forward",
        help="direction of the wave (default: %(default)s)",
    )


def _add_place_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("files")
    folder = data_folder()
    group.add_argument("--raw", type=Path, default=folder / "raw", help="archive (default: raw/)")
    group.add_argument(
        "--logs",
        type=Path,
        default=folder / "logs" / "acquisition",
        help="logs, with all damaged frames (default: logs/acquisition/)",
    )
    group.add_argument(
        "--templates",
        type=Path,
        default=folder / "results" / "templates.npz",
        help="templates for --detect; detectors.json must be in the same folder "
        "(default: results/templates.npz)",
    )
    group.add_argument(
        "--config",
        type=Path,
        default=data_config(),
        help="the workflow's configuration (default: config/config.yaml)",
    )


def _entry(text: str) -> str:
    """Return an entry of the header; a text that the workflow could not read is an error."""
    if not text.strip() or not text.isprintable() or len(text) > LONGEST_ENTRY:
        raise argparse.ArgumentTypeError(
            f"{text[:LONGEST_ENTRY]!r} is not allowed in a header: use 1 to {LONGEST_ENTRY} "
            "printable characters (UTF-8)"
        )
    return text
