"""Survey a gut: go back to each suspected nodule, and test it again."""

import argparse
import contextlib
import sys
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from capsule.bench import terminal
from capsule.bench.bench_errors import AcquisitionError, CannotArriveError, SurveyFaultError
from capsule.bench.board import Board
from capsule.bench.clock import StopRequest
from capsule.bench.fold import set_up_fold
from capsule.bench.logger import check_fits, moment_text
from capsule.bench.loop import kept
from capsule.bench.record_command import add_board_options, add_wave_options, exit_statuses
from capsule.bench.survey_bench import BoardBench, open_boards
from capsule.bench.survey_folder import INDEX, check_new, read_about
from capsule.bench.survey_run import SurveyRun
from capsule.bench.wave import Wave
from capsule.commands.options import natural, number_within
from capsule.engine.configuration import read_settings
from capsule.engine.project import config_file
from capsule.errors import WrongOptionError
from capsule.kinds import Settings
from capsule.phantom.files import add_phantom_arguments, read_phantom
from capsule.phantom.simulated_bench import SOURCE, bench_with, nodules_of
from capsule.survey.cycle import STATUSES

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
    survey(arguments)


def check(options: argparse.Namespace) -> None:
    """Raise an error if options contradict each other, and set the default length.

    Raises
    ------
    WrongOptionError
        The message names the options.
    """
    if options.fold_set_up and not options.fold:
        raise WrongOptionError("--fold-set-up needs the port of the fold board: --fold PORT")
    if options.fold_set_up or options.resume:
        return
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


def survey(options: argparse.Namespace) -> None:
    """Survey a gut, go to targets in it, or set up the fold board.

    Raises
    ------
    CannotArriveError
        The capsule did not reach its target.
    SurveyFaultError
        The origami did not fold or unfold.
    AcquisitionError
        A board is missing, refuses or was lost.
    """
    if options.fold_set_up:
        set_up_fold(options.fold, options.baud)
        return
    resumed, options.out = options.resume is not None, options.resume or options.out
    if not resumed:
        check_new(options.out)
    about = read_about(options.out) if resumed else _about(options)
    settings = read_settings(config_file())
    survey_it = _on_boards if "boards" in about else _simulated
    try:
        run = survey_it(options, about, settings)
    except KeyboardInterrupt:
        print("ended by Ctrl-C before the first sample; nothing new is kept", file=sys.stderr)
        raise
    _tell_outcome(run, options.out, to_targets=bool(about["goto"]))


def _about(options: argparse.Namespace) -> dict[str, Any]:
    """Return what session.json keeps of a new survey's options."""
    kept = ["metres", "goto", "raw"]
    if options.simulate:
        kept += ["nodules", "seed", "parameters", "bench", "changes"]
    chosen = {name: getattr(options, name) for name in kept}
    about = {name: str(each) if isinstance(each, Path) else each for name, each in chosen.items()}
    if options.simulate:
        return about | {"source": SOURCE}
    wave = asdict(Wave(options.speed, options.ramp, options.direction))
    return about | {"boards": _ports(options), "wave": wave, INDEX: None}


def _ports(options: argparse.Namespace) -> dict[str, str | None]:
    return {"drive": options.drive, "fold": options.fold, "logger": options.port}


def _simulated(options: argparse.Namespace, about: dict[str, Any], settings: Settings) -> SurveyRun:
    """Survey a simulated gut."""
    phantom = read_phantom(Path(about["parameters"]), about["changes"], about["bench"])
    seed, length_mm = about["seed"], 1000 * float(about["metres"])
    nodules = nodules_of(seed, length_mm, about["nodules"])
    sensors = settings["recording"]["sensors"]
    bench = bench_with(phantom, seed=seed, length_mm=length_mm, nodules=nodules, sensors=sensors)
    run = SurveyRun(options, about, settings, bench.header | {"session": options.out.name})
    with kept(run.disk, lambda: run.state.samples > 0):
        run.go_on(bench, StopRequest())
    return run


def _on_boards(options: argparse.Namespace, about: dict[str, Any], settings: Settings) -> SurveyRun:
    """Survey on boards; a resumed survey decides again on what is stored, and goes on from there.

    Whatever ends it, the wave is stopped and the origami unfolded before the files are complete.
    """
    resumed = options.resume is not None
    # A board can have another port than in the killed session.
    given = {name: port for name, port in _ports(options).items() if port is not None}
    ports, wave = about["boards"] | given, Wave(**about["wave"])
    with contextlib.ExitStack() as at_end:
        boards = {} if resumed else open_boards(ports, options.baud, at_end)
        if not resumed:
            about |= _known_with(boards, settings, wave, options.out.name)
        run = SurveyRun(options, about, settings, about["header"])
        with kept(run.disk, lambda: resumed or run.state.samples > 0):
            if resumed:
                run.repeat()
            if not run.pilot.cycle.over:
                boards = boards or open_boards(ports, options.baud, at_end)
                # From here on Ctrl-C ends the survey in order: the origami is unfolded first.
                stop = StopRequest()
                bench = BoardBench(boards, wave, run.disk.log, stop, options.patience)
                if run.state.samples:
                    bench.resume(about[INDEX])
                try:
                    bench.start()
                    run.go_on(bench, stop, datetime.fromisoformat(about["begun"]))
                finally:
                    bench.leave()
    return run


def _known_with(
    boards: Mapping[str, Board], settings: Settings, wave: Wave, session: str
) -> dict[str, Any]:
    """Return the entries known only once the boards are connected: start time and header."""
    check_fits(boards["logger"].identity, settings["recording"])
    driven_mm = boards["peristalsis"].identity.entries["wavelength_mm"]
    expected_mm = settings["diagonal"]["wavelength_mm"]
    if float(driven_mm) != expected_mm:
        raise AcquisitionError(
            f"the peristalsis board drives waves of {driven_mm} mm, but the workflow is configured "
            f"for {expected_mm:g} mm; correct diagonal.wavelength_mm in config/config.yaml"
        )
    begun = datetime.now(UTC)
    told = {"started": moment_text(begun)} | wave.entries | {"session": session}
    header = boards["logger"].header | told
    return {"begun": begun.isoformat(timespec="milliseconds"), "header": header}


def _tell_outcome(run: SurveyRun, folder: Path, *, to_targets: bool) -> None:
    pilot = run.pilot
    places = pilot.suspects.places
    counts = Counter(place.status or "undecided" for place in places)
    listed = ", ".join(f"{counts[status]} {status}" for status in STATUSES)
    print(f"{folder}: {len(places)} places suspected ({listed})")
    if pilot.cycle.no_return:
        print("the capsule cannot go back: folding did not bring it back", file=sys.stderr)
    if run.trouble:
        raise run.trouble
    happened = {event.event for event in pilot.log}
    if "cannot_arrive" in happened:
        raise CannotArriveError("the capsule cannot go back to the target")
    if "fault" in happened or any(
        event.event == "late" and event.after in ("closing", "ended") for event in pilot.log
    ):
        raise SurveyFaultError(f"the origami did not obey: {pilot.log[-1].reason}")
    if "stopped" in happened:
        raise KeyboardInterrupt
    if to_targets and "arrived" not in happened:
        raise CannotArriveError("the survey ended before the capsule reached the target")
