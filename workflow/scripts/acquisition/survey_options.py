"""The command line of survey.py."""

import argparse
from pathlib import Path

from acquisition.options import add_board_options, add_wave_options
from edges.phantom import natural, phantom_arguments

EXAMPLES = """
examples:
  %(prog)s --simulate --metres 2 --nodules 1 3 --seed 7 --out sessions/demo
                                   a simulated gut of 2 m with a nodule of 1 and one of 3 mm
  %(prog)s --resume sessions/demo take up a session that was killed
  %(prog)s --simulate --metres 1 --goto 500 140 --out sessions/there
                                   go to 500 mm, then back to 140 mm, and stop
  %(prog)s --simulate --metres 1 --goto 140 --map sessions/demo --out sessions/again
                                   140 mm as an earlier session has it
  %(prog)s --drive /dev/ttyACM1 --fold /dev/ttyACM2 --out sessions/tuesday
                                   on the bench, until the end stop or Ctrl-C
  %(prog)s --resume sessions/tuesday --fold /dev/ttyACM3
                                   go on with it; the fold board has another port now

Nothing of the folding was measured: docs/survey.md.

exit status:
  0 the gut was surveyed, or the target reached     1 other fault        2 wrong option
  3 no board       4 no answer         5 port in use        6 no permission for the port
  7 wrong baud rate                    8 wrong board        9 disk full      10 name exists
 11 a board was lost for longer than --patience            12 a board refuses
 13 the target was not reached       14 the origami did not obey
130 ended by Ctrl-C
"""
# Room for a pass before the first nodule and behind the last.
SHORTEST_M = 0.2


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line; ends the program with status 2 where it is wrong."""
    parser = argparse.ArgumentParser(
        description="Survey a gut: go back to what looks like a nodule, and look again.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        parents=[phantom_arguments()],
    )
    add = parser.add_argument
    add("--simulate", action="store_true", help="in a simulated gut, without boards")
    metres = "length of the gut (default: 1 if simulated, else to the end stop)"
    add("--metres", type=_length, metavar="M", help=metres)
    nodules = "diameters of nodules, which lie at places drawn from the seed"
    add("--nodules", type=_diameter, nargs="+", default=[], metavar="MM", help=nodules)
    add("--seed", type=natural, default=1, metavar="N", help="same seed, same session (default: 1)")
    add("--goto", type=float, nargs="+", default=[], metavar="MM", help="go there, one by one")
    earlier = "earlier sessions from the same start of this bench: use the map that they agree on"
    add("--map", type=Path, nargs="+", default=[], metavar="SESSION", help=earlier)
    add("--out", type=Path, metavar="FOLDER", help="the session's new folder")
    raw = "put each pass into FOLDER/unlabelled/ as well, for the workflow to judge"
    add("--raw", type=Path, metavar="FOLDER", help=raw)
    add("--resume", type=Path, metavar="FOLDER", help="take up a session that was killed")
    results = "where the workflow has put detectors.json, for sizes (default: results)"
    add("--results", type=Path, default=Path("results"), metavar="FOLDER", help=results)
    add_board_options(parser)
    add_wave_options(parser)
    parser.add_argument_group("the fold board").add_argument(
        "--fold", metavar="PORT", help="serial port; fold and unfold the origami"
    )
    options = parser.parse_args(arguments)
    if options.resume is None:
        _check_new(options, parser)
    return options


def _check_new(options: argparse.Namespace, parser: argparse.ArgumentParser) -> None:
    """Check what a new session needs, and fill in what was left out."""
    boards = {"--drive": options.drive, "--fold": options.fold}
    if options.simulate == any(boards.values()):
        parser.error("say --simulate, or where the boards are: --drive PORT --fold PORT")
    missing = [option for option, port in boards.items() if not options.simulate and not port]
    if missing:
        parser.error(f"a survey needs {missing[0]} PORT too")
    if options.out is None:
        parser.error("say where the session goes: --out FOLDER")
    if options.simulate and options.metres is None:
        options.metres = 1.0
    length_mm = float("inf") if options.metres is None else options.metres * 1000
    outside = [target for target in options.goto if not 0 <= target <= length_mm]
    if outside:
        parser.error(f"--goto {outside[0]:g}: the gut is {length_mm:g} mm long")


def _length(text: str) -> float:
    value = float(text)
    if not SHORTEST_M <= value <= 10:
        raise argparse.ArgumentTypeError(f"{text} m is not within {SHORTEST_M:g} to 10 m")
    return value


def _diameter(text: str) -> float:
    value = float(text)
    if not 0 < value <= 5:
        raise argparse.ArgumentTypeError(f"{text} mm is not within 0 to 5 mm")
    return value
