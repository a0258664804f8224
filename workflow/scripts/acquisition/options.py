"""The command line of acquire.py."""

import argparse
import re
from pathlib import Path

from acquisition.line import BAUD
from capsule.naming import UNLABELLED, Entry, classify, folder_size_mm, repeated_end, size_label

_LONGEST_NAME = 96  # without .csv
LONGEST_ENTRY = 100  # characters of a site or session
PROJECT = Path(__file__).resolve().parents[3]

EXAMPLES = """
examples:
  acquire.py --size 3                     record a run over a 3 mm nodule until Ctrl-C
  acquire.py --unlabelled --detect        record a run to be detected, and judge it
  acquire.py --size 0 --duration 90 --drive /dev/ttyACM1
                                          start the wave, record 90 s without a nodule, stop both
  acquire.py --recover                    make recordings of what killed recorders have left

exit status:
  0 archived            1 other fault        2 wrong option       3 no board, or several
  4 no answer           5 port in use        6 no permission      7 wrong baud rate
  8 wrong board         9 disk full         10 name exists       11 board lost (part is archived)
 12 refused by a board
"""


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line; ends the program with status 2 where it is wrong."""
    parser = argparse.ArgumentParser(
        prog="acquire.py",
        description="Record a run of the capsule from the logger board into raw/.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    _add_run_options(parser)
    _add_board_options(parser)
    _add_wave_options(parser)
    _add_place_options(parser)
    options = parser.parse_args(arguments)
    for option, value in vars(options).items():
        # What argparse makes of an option whose value is two dashes.
        if value == []:
            parser.error(f"argument --{option.replace('_', '-')}: '--' is no value")
    modes = [options.size is not None, options.unlabelled, options.recover is not None]
    if sum(modes) != 1:
        parser.error("say what is recorded: --size MM or --unlabelled (or --recover)")
    return options


def _add_run_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("the run")
    group.add_argument("--size", type=_size, metavar="MM", help="nodule under the wall; 0 for none")
    group.add_argument("--unlabelled", action="store_true", help="a run whose nodule is unknown")
    group.add_argument(
        "--recover",
        nargs="?",
        const="all",
        metavar="FILE",
        help="make a recording of an unfinished one (.part); of all under raw/ without FILE",
    )
    group.add_argument("--duration", type=_positive, metavar="S", help="end after S seconds")
    group.add_argument("--name", type=_name, help="the recording's name (default: UTC time)")
    group.add_argument(
        "--site", type=_entry, help="header: the place of the nodule, for several passes"
    )
    group.add_argument(
        "--session", type=_entry, help="header: what these recordings have in common"
    )
    group.add_argument("--plot", action="store_true", help="open a live window")
    group.add_argument(
        "--detect",
        action="store_true",
        help="show the running verdict, and in the end every detector's",
    )


def _add_board_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("the logger board")
    group.add_argument("--port", help="its port (default: found among the USB ports)")
    group.add_argument(
        "--baud", type=int, default=BAUD, help="bits per second (default: %(default)s)"
    )
    group.add_argument(
        "--patience",
        type=_positive,
        default=60.0,
        metavar="S",
        help="wait so long for the next sample, of an unplugged board too (default: %(default)g)",
    )


def _add_wave_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("the peristalsis board")
    group.add_argument("--drive", metavar="PORT", help="start and stop the wave too")
    group.add_argument(
        "--speed",
        type=_positive,
        default=25.0,
        metavar="MM_S",
        help="wave speed (default: %(default)g)",
    )
    group.add_argument(
        "--ramp",
        type=_positive,
        default=25.0,
        metavar="MM_S2",
        help="its acceleration (default: %(default)g)",
    )
    group.add_argument(
        "--direction",
        choices=("forward", "backward"),
        default="forward",
        help="of the wave (default: %(default)s)",
    )


def _add_place_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("files")
    group.add_argument("--raw", type=Path, default=PROJECT / "raw", help="archive (default: raw/)")
    group.add_argument(
        "--logs",
        type=Path,
        default=PROJECT / "logs" / "acquisition",
        help="where damaged frames are kept (default: logs/acquisition/)",
    )
    group.add_argument(
        "--templates",
        type=Path,
        default=PROJECT / "results" / "templates.npz",
        help="for --detect, with detectors.json beside it (default: results/templates.npz)",
    )
    group.add_argument(
        "--config",
        type=Path,
        default=PROJECT / "config" / "config.yaml",
        help="the workflow's configuration (default: config/config.yaml)",
    )


def _size(text: str) -> str:
    """Read a size and give its folder: 3mm, 2.5mm."""
    # ASCII alone: float() would also read -0, 1_0 and digits of other scripts.
    if not re.fullmatch(r"[0-9]{1,9}(\.[0-9]{1,9})?|\.[0-9]{1,9}", text) or float(text) >= 100:
        raise argparse.ArgumentTypeError(f"{text!r} is no size in mm from 0 to 100")
    label = size_label(float(text))
    if folder_size_mm(label) != float(text):
        raise argparse.ArgumentTypeError(
            f"{text!r} is finer than the workflow's folders, which would pass {label}/ over; "
            "give at most four digits, three of them behind the point"
        )
    return label


def _positive(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0 < number < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is no number above 0")
    return number


def _name(text: str) -> str:
    repeated = len(text) <= _LONGEST_NAME and repeated_end(text)
    if repeated:
        raise argparse.ArgumentTypeError(
            f"{text!r} ends in {repeated!r} again and again, which Snakemake takes for a mistake "
            "and stops at"
        )
    if not classify([Entry(f"{UNLABELLED}/{text}.csv")]).recordings or text.endswith(".csv"):
        raise argparse.ArgumentTypeError(
            f"{text!r} is no plain name: letters, digits, '_', '-', '.', '+', at most "
            f"{_LONGEST_NAME} of them; without .csv"
        )
    return text


def _entry(text: str) -> str:
    """Read an entry of the header; what the workflow could not read is refused."""
    if not text.strip() or not text.isprintable() or len(text) > LONGEST_ENTRY:
        raise argparse.ArgumentTypeError(
            f"{text[:LONGEST_ENTRY]!r} cannot stand in a header: printable characters (UTF-8), "
            f"1 to {LONGEST_ENTRY} of them"
        )
    return text
