"""The command line of survey.py."""

import argparse
from pathlib import Path

from edges.phantom import natural, phantom_arguments

EXAMPLES = """
examples:
  survey.py --simulate --metres 2 --nodules 1 3 --seed 7 --out sessions/demo
                                   a simulated gut of 2 m with a nodule of 1 and one of 3 mm
  survey.py --resume sessions/demo take up a session that was killed
  survey.py --simulate --metres 1 --goto 500 140 --out sessions/there
                                   go to 500 mm, then back to 140 mm, and stop

Nothing of the folding was measured: docs/survey.md.

exit status:
  0 the gut was surveyed, or the target reached     1 other fault        2 wrong option
  9 disk full      10 name exists     13 the capsule cannot go back to the target
 14 the origami did not obey          130 ended by Ctrl-C
"""
# Room for a pass before the first nodule and behind the last.
SHORTEST_M = 0.2


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line; ends the program with status 2 where it is wrong."""
    parser = argparse.ArgumentParser(
        prog="survey.py",
        description="Survey a gut: go back to what looks like a nodule, and look again.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        parents=[phantom_arguments()],
    )
    add = parser.add_argument
    add("--simulate", action="store_true", help="in a simulated gut; no boards can do it yet")
    add("--metres", type=_length, default=1.0, metavar="M", help="length of the gut (default: 1)")
    nodules = "diameters of nodules, which lie at places drawn from the seed"
    add("--nodules", type=_diameter, nargs="+", default=[], metavar="MM", help=nodules)
    add("--seed", type=natural, default=1, metavar="N", help="same seed, same session (default: 1)")
    add("--goto", type=float, nargs="+", default=[], metavar="MM", help="go there, one by one")
    add("--out", type=Path, metavar="FOLDER", help="the session's new folder")
    raw = "put each pass into FOLDER/unlabelled/ as well, for the workflow to judge"
    add("--raw", type=Path, metavar="FOLDER", help=raw)
    add("--resume", type=Path, metavar="FOLDER", help="take up a session that was killed")
    results = "where the workflow has put detectors.json, for sizes (default: results)"
    add("--results", type=Path, default=Path("results"), metavar="FOLDER", help=results)
    options = parser.parse_args(arguments)
    if options.resume is None:
        if not options.simulate:
            parser.error("say --simulate: the boards of a real survey are not built yet")
        if options.out is None:
            parser.error("say where the session goes: --out FOLDER")
        outside = [target for target in options.goto if not 0 <= target <= options.metres * 1000]
        if outside:
            parser.error(f"--goto {outside[0]:g}: the gut is {options.metres * 1000:g} mm long")
    return options


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
