"""Survey a gut: go back to each suspected nodule, and test it again."""

import argparse
from pathlib import Path

from capsule.arguments import natural, number_within
from capsule.bench import survey_session, terminal
from capsule.bench.record_command import add_board_options, add_wave_options, exit_statuses
from capsule.errors import WrongOptionError
from capsule.phantom.files import add_phantom_arguments

EXAMPLES = """
examples:
  %(prog)s --simulate --metres 2 --nodules 1 3 --seed 7 --out sessions/demo
                                   a simulated gut of 2 m with a nodule of 1 and one of 3 mm
  %(prog)s --simulate --metres 1 --goto 500 140 --out sessions/there
                                   go to 500 mm, then back to 140 mm, and stop
  %(prog)s --drive /dev/ttyACM1 --fold /dev/ttyACM2 --out sessions/tuesday
                                   on the bench, until the end stop or Ctrl-C
  %(prog)s --resume sessions/tuesday --fold /dev/ttyACM3
                                   continue it after a kill; the fold board has another port now
  %(prog)s --fold /dev/ttyACM2 --fold-set-up
                                   tell a new fold board that the origami is unfolded

Nobody has measured the folding: docs/survey.md.
"""
# Leaves room for a pass before the first nodule and after the last.
SHORTEST_M = 0.2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of a survey, its bench and its files."""
    success = "A gut that is surveyed, or a target that is reached."
    parser.epilog = EXAMPLES + exit_statuses(success, of_survey=True)
    add_phantom_arguments(parser)
    add = parser.add_argument
    add("--simulate", action="store_true", help="survey a simulated gut, without boards")
    metres = "length of the gut in m (default: 1 if simulated, else up to the end stop)"
    add("--metres", type=number_within(SHORTEST_M, 10, "m"), metavar="M", help=metres)
    nodules = "diameters of the simulated nodules in mm; the seed decides their places"
    diameters = number_within(0.1, 5, "mm")
    add("--nodules", type=diameters, nargs="+", default=[], metavar="MM", help=nodules)
    seed = "random seed; the same seed gives the same session (default: 1)"
    add("--seed", type=natural, default=1, metavar="N", help=seed)
    targets = "go to these positions one after the other, in mm from the start"
    add("--goto", type=float, nargs="+", default=[], metavar="MM", help=targets)
    live = "show the survey in a page on this computer, and open it in the browser"
    add("--live", action="store_true", help=live)
    add("--out", type=Path, metavar="FOLDER", help="the session's new folder")
    raw = "also store each pass in FOLDER/unlabelled/, for the workflow"
    add("--raw", type=Path, metavar="FOLDER", help=raw)
    add("--resume", type=Path, metavar="FOLDER", help="continue a killed session on boards")
    results = "the workflow's results; detectors.json gives the sizes (default: results)"
    add("--results", type=Path, default=Path("results"), metavar="FOLDER", help=results)
    add_board_options(parser)
    add_wave_options(parser)
    fold = parser.add_argument_group("the fold board")
    fold.add_argument("--fold", metavar="PORT", help="fold and unfold the origami at this port")
    fold.add_argument(
        "--fold-set-up",
        action="store_true",
        help="only set up a fold board that is new or has lost what it knew of its thread: asks "
        "you to look at the origami, and to confirm that it is unfolded",
    )


def main(arguments: argparse.Namespace) -> None:
    """Run a survey; each fault has its own exit status.

    Raises
    ------
    AcquisitionError
        A fault at the bench.
    WrongOptionError
        Options contradict each other.
    """
    check(arguments)
    terminal.install()
    survey_session.survey(arguments)


def check(options: argparse.Namespace) -> None:
    """Raise an error if options contradict each other, and set the default length.

    Raises
    ------
    WrongOptionError
        The message names the options.
    """
    if options.fold_set_up:
        if not options.fold:
            raise WrongOptionError("--fold-set-up needs the port of the fold board: --fold PORT")
    elif options.resume is None:
        _check_new(options)


def _check_new(options: argparse.Namespace) -> None:
    """Check the options of a new session, and set the default length."""
    boards = {"--drive": options.drive, "--fold": options.fold}
    if options.simulate == any(boards.values()):
        raise WrongOptionError(
            "give either --simulate, or the ports of the boards: --drive PORT --fold PORT"
        )
    missing = [option for option, port in boards.items() if not options.simulate and not port]
    if missing:
        raise WrongOptionError(f"a survey needs {missing[0]} PORT too")
    if options.out is None:
        raise WrongOptionError("give a new folder for the session: --out FOLDER")
    if options.simulate and options.metres is None:
        options.metres = 1.0
    length_mm = float("inf") if options.metres is None else options.metres * 1000
    outside = [target for target in options.goto if not 0 <= target <= length_mm]
    if outside:
        raise WrongOptionError(
            f"--goto {outside[0]:g}: the gut is {length_mm:g} mm long; give a position within it"
        )
