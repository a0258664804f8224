"""A survey from its options to its outcome: simulated or on boards, new or resumed."""

import argparse
import contextlib
import sys
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from capsule.bench.bench_errors import AcquisitionError, CannotArriveError, SurveyFaultError
from capsule.bench.board import Board
from capsule.bench.clock import StopRequest
from capsule.bench.fold import set_up_fold
from capsule.bench.live import LivePage, opened_page
from capsule.bench.logger import check_fits, moment_text
from capsule.bench.loop import kept
from capsule.bench.survey_bench import BoardBench, open_boards
from capsule.bench.survey_folder import INDEX, check_new, read_about
from capsule.bench.survey_run import SurveyRun, length_mm_of
from capsule.bench.wave import Wave
from capsule.engine.configuration import read_settings
from capsule.engine.project import config_file
from capsule.kinds import Settings
from capsule.phantom.files import read_phantom
from capsule.phantom.simulated_bench import SOURCE, bench_with, nodules_of
from capsule.survey.cycle import STATUSES


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
    # From here on Ctrl-C no longer kills the program: the origami must be unfolded first.
    stop = StopRequest()
    survey_it = _on_boards if "boards" in about else _simulated
    try:
        with opened_page() if options.live else contextlib.nullcontext() as page:
            run = survey_it(options, about, settings, stop, page)
    except KeyboardInterrupt:
        print("ended by Ctrl-C before the first sample; nothing new is kept", file=sys.stderr)
        raise
    _tell_outcome(run, options.out, to_targets=bool(about["goto"]))


def _about(options: argparse.Namespace) -> dict[str, Any]:
    about = {
        "metres": options.metres,
        "goto": options.goto,
        "raw": None if options.raw is None else str(options.raw),
    }
    if options.simulate:
        return about | {
            "source": SOURCE,
            "nodules": options.nodules,
            "seed": options.seed,
            "parameters": str(options.parameters),
            "bench": options.bench,
            "changes": options.changes,
        }
    return about | {
        "boards": _ports(options),
        "wave": asdict(Wave(options.speed, options.ramp, options.direction)),
        INDEX: None,
    }


def _ports(options: argparse.Namespace) -> dict[str, str | None]:
    return {"drive": options.drive, "fold": options.fold, "logger": options.port}


def _simulated(
    options: argparse.Namespace,
    about: dict[str, Any],
    settings: Settings,
    stop: StopRequest,
    page: LivePage | None,
) -> SurveyRun:
    """Survey a simulated gut."""
    phantom = read_phantom(Path(about["parameters"]), about["changes"], about["bench"])
    seed, length_mm = about["seed"], length_mm_of(about)
    bench = bench_with(
        phantom,
        seed=seed,
        length_mm=length_mm,
        nodules=nodules_of(seed, length_mm, about["nodules"]),
        sensors=settings["recording"]["sensors"],
    )
    run = SurveyRun(options, about, settings, bench.header | {"session": options.out.name}, page)
    with kept(run.disk, lambda: run.state.samples > 0):
        run.go_on(bench, stop)
    return run


def _on_boards(
    options: argparse.Namespace,
    about: dict[str, Any],
    settings: Settings,
    stop: StopRequest,
    page: LivePage | None,
) -> SurveyRun:
    """Survey on boards; a resumed survey decides again on what is stored, and goes on from there.

    Whatever ends it, the wave is stopped and the origami unfolded before the files are complete.
    """
    resumed = options.resume is not None
    # A board can have another port than in the killed session.
    given = {name: port for name, port in _ports(options).items() if port is not None}
    ports, wave = about["boards"] | given, Wave(**about["wave"])
    with contextlib.ExitStack() as at_end:
        boards = {} if resumed else open_boards(ports, options.baud, stop, at_end)
        if not resumed:
            about |= _known_with(boards, settings, wave, options.out.name)
        run = SurveyRun(options, about, settings, about["header"], page)
        with kept(run.disk, lambda: resumed or run.state.samples > 0):
            if resumed:
                run.repeat()
            if not run.pilot.cycle.over:
                boards = boards or open_boards(ports, options.baud, stop, at_end)
                bench = BoardBench(
                    boards,
                    wave,
                    run.disk.log,
                    stop,
                    patience_s=options.patience,
                    resumed=run.state.samples > 0,
                    index_mm=about[INDEX],
                )
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
    header = boards["logger"].header | {"started": moment_text(begun)} | wave.entries
    header |= {"session": session}
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
