"""What survey.py does: lead a capsule along a gut, and keep everything that it felt."""

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from acquisition.bench_errors import CannotArriveError, SurveyFaultError
from acquisition.limits import StopRequest
from acquisition.pass_sizes import PassSizes, pass_sizes
from acquisition.session_folder import SessionFolder, read_about
from acquisition.simulated_bench import SOURCE, SimulatedBench, simulated_bench
from acquisition.survey_view import SurveyView
from capsule import words
from capsule.recording import Recording
from capsule.survey.pilot import Pilot
from capsule.survey.survey_log import UNFOLDED, Judgement, Readings
from capsule.survey.suspected_place import Place
from edges.config_files import read_config_file
from edges.phantom import CONFIG, read_phantom

# A recording of one pass is shorter than the paper's matrix. No two hold the same samples, and what
# is left of a pass must show the sensors' usual beats.
_LONGEST_PASS, _SHORTEST_PASS = 990, 300


def survey(options: argparse.Namespace) -> None:
    """Survey a gut, or go to targets in it.

    Raises
    ------
    CannotArriveError, SurveyFaultError
        The capsule did not come where it should, or the origami did not obey.
    """
    resumed = options.resume is not None
    folder = options.resume if resumed else options.out
    about = read_about(folder) if resumed else _about(options)
    settings = read_config_file(CONFIG / "config.yaml")
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
    raw = None if about["raw"] is None else Path(about["raw"])
    disk = SessionFolder(folder, about, sensors, resumed=resumed, raw=raw)
    sizes = pass_sizes(options.results, settings["diagonal"], rate_hz)
    view = SurveyView(sys.stdout, f"{folder.name}, simulated", 1000 * about["metres"])
    header = bench.header | {"session": folder.name}
    run = SurveyRun(pilot, bench, disk, sizes, view, header=header)
    stop = StopRequest()
    try:
        run.go_on(stop)
    except BaseException:
        disk.close()
        raise
    disk.finish()
    _tell_outcome(pilot, folder, stop)


def _about(options: argparse.Namespace) -> dict:
    return {
        "source": SOURCE,
        "metres": options.metres,
        "nodules": options.nodules,
        "seed": options.seed,
        "goto": options.goto,
        "raw": None if options.raw is None else str(options.raw),
        "parameters": str(options.parameters),
        "bench": options.bench,
        "changes": options.changes,
    }


class SurveyRun:
    """One survey, from its first sample to its last.

    Parameters
    ----------
    pilot : Pilot
        Who decides.
    bench : SimulatedBench
        Boards and capsule.
    disk : SessionFolder
        Where everything goes.
    sizes : PassSizes
        Sizes the passes.
    view : SurveyView
        Shows the survey to a person.
    header : mapping of str to str
        Of the recordings.
    """

    def __init__(
        self,
        pilot: Pilot,
        bench: SimulatedBench,
        disk: SessionFolder,
        sizes: PassSizes,
        view: SurveyView,
        header: Mapping[str, str],
    ) -> None:
        self._pilot, self._bench, self._disk, self._sizes = pilot, bench, disk, sizes
        self._header, self._view = header, view
        self._size_words: dict[int, str] = {}
        self._heard: list[Readings] = []
        self._told = self._kept = 0
        self._passes: dict[int, list[tuple[str, np.ndarray]]] = {}

    def go_on(self, stop: StopRequest) -> None:
        """Lead the capsule until the survey is over."""
        pilot, bench = self._pilot, self._bench
        while not pilot.cycle.over:
            if stop.reason:
                self._obey(pilot.tell("stopped", stop.reason))
            elif bench.at_end:
                self._obey(pilot.tell("gut_ended", "the end of the gut"))
            readings = bench.read(pilot.every)
            self._heard.append(readings)
            commands = pilot.tick(readings)
            self._disk.add_readings(readings, self._judgement())
            self._obey(commands)
            self._note_events()
            self._disk.keep()
            if self._disk.caught_up:
                self._view.show(float(readings.time_s[-1]), pilot, self._size_words)
        self._view.end(float(self._heard[-1].time_s[-1]), pilot, self._size_words)
        self._disk.write_places([self._row(place) for place in pilot.suspects.places])

    def _judgement(self) -> Judgement:
        """Return what the pilot made of the newest readings."""
        suspects = self._pilot.suspects
        return Judgement(
            self._pilot.sensing.head_mm, suspects.newest_score, suspects.threshold.threshold
        )

    def _obey(self, commands: tuple[str, ...]) -> None:
        for command in commands:
            self._bench.tell(command)

    def _note_events(self) -> None:
        """Write what has happened since, and keep the passes that are complete."""
        events = self._pilot.log[self._told :]
        self._told = len(self._pilot.log)
        self._disk.add_events(events)
        for event in events:
            if self._disk.caught_up:
                self._view.tell(event)
            if event.before == "finishing" and event.event == "passed":
                self._keep_pass()
            elif event.before == "passing" and event.event != "lost":
                self._keep_pass()
                places = self._pilot.suspects.places
                self._disk.write_places([self._row(place) for place in places])

    def _keep_pass(self) -> None:
        """Make a recording of the pass that has just ended."""
        place = self._pilot.suspects.present
        last = first = len(self._heard)
        least = max(self._kept, last - _LONGEST_PASS // self._pilot.every)
        while first > least and self._heard[first - 1].fold == UNFOLDED:
            first -= 1
        self._kept = last
        stretch = self._heard[first:last]
        if len(stretch) * self._pilot.every < _SHORTEST_PASS:
            return
        values = np.concatenate([readings.values for readings in stretch], axis=1)
        time_s = np.concatenate([readings.time_s for readings in stretch])
        passes = self._passes.setdefault(place.number, [])
        name = f"place-{place.number:02d}-pass-{len(passes) + 1}"
        header = {**self._header, "site": f"{self._header['session']}/place-{place.number:02d}"}
        recording = Recording(np.round(time_s - time_s[0], 6), values, header)
        passes.append((self._disk.add_recording(name, recording), values))

    def _row(self, place: Place) -> dict:
        passes = self._passes.get(place.number, [])
        size = [float("nan")] * 3
        if place.status == "confirmed":
            size = self._sizes.of([values for _, values in passes])
            names = ("estimate_mm", "estimate_low_mm", "estimate_high_mm")
            estimate = dict(zip(names, size, strict=True))
            if words.is_known(size[0]):
                self._size_words[place.number] = words.estimated_size(estimate)
        heights = [height for height in place.heights if not np.isnan(height)]
        return {
            "place": place.number,
            "status": place.status or "undecided",
            "place_mm": round(place.place_mm, 1),
            "passes": place.passes,
            **dict(zip(("size_mm", "size_low_mm", "size_high_mm"), size, strict=True)),
            "evidence": place.evidence[0] if place.evidence else float("nan"),
            "height": float(np.mean(heights)) if heights else float("nan"),
            "threshold": place.threshold,
            "recordings": " ".join(name for name, _ in passes),
        }


def _tell_outcome(pilot: Pilot, folder: Path, stop: StopRequest) -> None:
    places = pilot.suspects.places
    counts = {
        status: sum((place.status or "undecided") == status for place in places)
        for status in ("confirmed", "dismissed", "undecided")
    }
    said = ", ".join(f"{count} {status}" for status, count in counts.items())
    print(f"{folder}: {len(places)} places suspected ({said})")
    if pilot.cycle.no_return:
        print("the capsule cannot go back: folding does not bring it back", file=sys.stderr)
    happened = {event.event for event in pilot.log}
    if "cannot_arrive" in happened:
        raise CannotArriveError("the capsule cannot go back to the target")
    if "fault" in happened or any(
        event.event == "late" and event.after in ("closing", "ended") for event in pilot.log
    ):
        raise SurveyFaultError(f"the origami did not obey: {pilot.log[-1].reason}")
    if stop.reason:
        raise KeyboardInterrupt
