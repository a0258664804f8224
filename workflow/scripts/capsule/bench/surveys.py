"""Begin or resume a survey, on boards or in a simulated gut."""

import argparse
import math
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from capsule.bench.bench_errors import AcquisitionError, CannotArriveError, SurveyFaultError
from capsule.bench.board_bench import Ports, board_bench, board_links
from capsule.bench.board_link import BoardLink
from capsule.bench.drive import Wave
from capsule.bench.fold_set_up import set_up_fold
from capsule.bench.frame_log import FrameLog
from capsule.bench.limits import StopRequest
from capsule.bench.logger_board import check_fits, header_of
from capsule.bench.pass_sizes import pass_sizes
from capsule.bench.session_folder import (
    BOARDS_LOG,
    EARLIER_ORIGIN,
    INDEX,
    SessionFolder,
    check_new,
    read_about,
    read_origin,
)
from capsule.bench.simulated_bench import SOURCE, simulated_bench
from capsule.bench.stored_survey import read_stored
from capsule.bench.survey_run import SurveyRun
from capsule.bench.survey_view import SurveyView
from capsule.configuration import read_settings
from capsule.phantom.files import read_phantom
from capsule.project import config_file
from capsule.survey.cycle import STATUSES
from capsule.survey.pilot import Pilot


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
    resumed = options.resume is not None
    folder = options.resume if resumed else options.out
    if resumed:
        about = read_about(folder)
    else:
        check_new(folder)
        about = _about(options)
    settings = read_settings(config_file())
    if not resumed and options.map:
        about[EARLIER_ORIGIN] = read_origin(options.map, settings["diagonal"]["wavelength_mm"])
    lead = _on_boards if "boards" in about else _simulated
    lead(options, folder, about, settings, resumed=resumed)


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
        "wave": {
            "speed_mm_s": options.speed,
            "ramp_mm_s2": options.ramp,
            "direction": options.direction,
        },
        INDEX: None,
    }


def _ports(options: argparse.Namespace) -> dict[str, Any]:
    return {
        "drive": options.drive,
        "fold": options.fold,
        "logger": options.port,
    }


def _simulated(
    options: argparse.Namespace,
    folder: Path,
    about: dict[str, Any],
    settings: dict[str, Any],
    *,
    resumed: bool,
) -> None:
    """Survey a simulated gut.

    A resumed survey repeats the simulation up to the point at which it was killed.
    """
    phantom = read_phantom(Path(about["parameters"]), about["changes"], about["bench"])
    sensors, rate_hz = settings["recording"]["sensors"], phantom.electronics.rate_hz
    bench = simulated_bench(
        phantom,
        seed=about["seed"],
        length_mm=1000 * about["metres"],
        nodules_mm=about["nodules"],
        sensors=sensors,
    )
    pilot = Pilot(settings["diagonal"], rate_hz, targets_mm=about["goto"])
    disk = SessionFolder(folder, about, sensors, resumed=resumed, raw=_raw(about))
    sizes = pass_sizes(options.results, settings["diagonal"], rate_hz)
    header = bench.header | {"session": folder.name}
    view = SurveyView(sys.stdout, f"{folder.name}, simulated", 1000 * about["metres"])
    earlier_mm = about.get(EARLIER_ORIGIN)
    run = SurveyRun(pilot, disk, sizes, view, header, rate_hz, earlier_mm=earlier_mm)
    stop = StopRequest()
    try:
        run.go_on(bench, stop)
    except BaseException:
        disk.close()
        raise
    disk.finish()
    _tell_outcome(pilot, folder, run, to_targets=bool(about["goto"]))


def _on_boards(
    options: argparse.Namespace,
    folder: Path,
    about: dict[str, Any],
    settings: dict[str, Any],
    *,
    resumed: bool,
) -> None:
    """Survey on boards.

    A resumed survey reads the stored samples and continues where the capsule is.
    """
    # From here on Ctrl-C no longer kills the program: the origami must be unfolded first.
    stop = StopRequest()
    wave = Wave(**about["wave"])
    # A board can have another port than in the killed session.
    given = {name: port for name, port in _ports(options).items() if port is not None}
    ports = Ports(**(about["boards"] | given), baud=options.baud)
    links = {} if resumed else board_links(ports, _tell, stop)
    try:
        if not resumed:
            about |= _begun(links, settings, wave, folder)
        # Odometer and beat detection need the speed of the wave that the board drives.
        detector = settings["diagonal"] | {"wave_speed_mm_s": wave.speed_mm_s}
        rate_hz, sensors = settings["recording"]["rate_hz"], settings["recording"]["sensors"]
        pilot = Pilot(detector, rate_hz, targets_mm=about["goto"])
        disk = SessionFolder(folder, about, sensors, resumed=resumed, raw=_raw(about))
        sizes = pass_sizes(options.results, settings["diagonal"], rate_hz)
        length_mm = math.inf if about["metres"] is None else 1000 * about["metres"]
        view = SurveyView(sys.stdout, folder.name, length_mm)
        run = SurveyRun(
            pilot,
            disk,
            sizes,
            view,
            about["header"],
            rate_hz,
            length_mm,
            earlier_mm=about.get(EARLIER_ORIGIN),
            index_mm=about[INDEX],
        )
        try:
            if resumed:
                run.repeat(read_stored(folder, sensors, rate_hz, pilot.every))
            if not pilot.cycle.over:
                links = links or board_links(ports, _tell, stop)
                _lead(run, links, wave, about, folder, options.patience, stop)
            disk.finish()
        except BaseException:
            if run.begun or resumed:
                disk.close()
            else:
                disk.discard()
            raise
    finally:
        for link in links.values():
            link.close()
    _tell_outcome(pilot, folder, run, to_targets=bool(about["goto"]))


def _lead(
    run: SurveyRun,
    links: Mapping[str, BoardLink],
    wave: Wave,
    about: dict[str, Any],
    folder: Path,
    patience_s: float,
    stop: StopRequest,
) -> None:
    """Run the survey; always stop the wave and unfold the origami at its end."""
    log = FrameLog(folder / BOARDS_LOG, _tell)
    bench = board_bench(
        links,
        wave,
        log,
        _tell,
        stop,
        patience_s=patience_s,
        begin_s=run.next_s,
        index_mm=about[INDEX],
    )
    try:
        bench.start()
        begun = datetime.fromisoformat(about["begun"]) if run.begun else None
        run.go_on(bench, stop, begun)
    except KeyboardInterrupt:
        print("ended by Ctrl-C before the first sample; nothing new is kept", file=sys.stderr)
        raise
    finally:
        for warning in bench.leave():
            print(warning, file=sys.stderr)
        log.close()


def _begun(
    links: Mapping[str, BoardLink], settings: dict[str, Any], wave: Wave, folder: Path
) -> dict[str, Any]:
    """Return the entries known only once the boards are connected: start time and header."""
    logger, peristalsis = links["logger"].identity, links["peristalsis"].identity
    check_fits(logger, settings["recording"])
    driven_mm, expected_mm = (
        peristalsis.entries["wavelength_mm"],
        settings["diagonal"]["wavelength_mm"],
    )
    if float(driven_mm) != expected_mm:
        raise AcquisitionError(
            f"the peristalsis board drives waves of {driven_mm} mm, but the workflow is configured "
            f"for {expected_mm:g} mm; correct diagonal.wavelength_mm in config/config.yaml"
        )
    begun = datetime.now(UTC)
    header = header_of(logger, begun, wave) | {"session": folder.name}
    return {"begun": begun.isoformat(timespec="milliseconds"), "header": header}


def _raw(about: dict[str, Any]) -> Path | None:
    return None if about["raw"] is None else Path(about["raw"])


def _tell(text: str) -> None:
    print(text, flush=True)


def _tell_outcome(pilot: Pilot, folder: Path, run: SurveyRun, *, to_targets: bool) -> None:
    places = pilot.suspects.places
    counts = {
        status: sum((place.status or "undecided") == status for place in places)
        for status in STATUSES
    }
    listed = ", ".join(f"{count} {status}" for status, count in counts.items())
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
