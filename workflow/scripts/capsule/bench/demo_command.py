"""Play a simulated run without a board, judge it live, and make its report."""

import argparse
import contextlib
import signal
import subprocess
import time
import webbrowser
from collections.abc import Mapping, Sequence
from itertools import count
from pathlib import Path

from capsule import words
from capsule.arrays import FloatArray, IntArray
from capsule.bench import record_command, recorder, terminal
from capsule.bench.clock import elapsed_s
from capsule.bench.line import Arrival
from capsule.bench.live import opened_page
from capsule.bench.logger import Source
from capsule.bench.protocol import Sample
from capsule.commands.new import is_taken, own_configuration
from capsule.commands.options import natural, number_within
from capsule.commands.report import INTERRUPTED, call_workflow, check_workflow, snakemake_command
from capsule.engine.configuration import read_settings
from capsule.engine.project import OWN_CONFIG
from capsule.errors import CapsuleError
from capsule.judging.verdict import FinalVerdict, Judgement
from capsule.phantom.command import write_run
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import planned_runs, simulate_run, simulated_header
from capsule.recordings.names import UNLABELLED
from capsule.store import files
from capsule.store.results import OfArchive

LEARNED = tuple(f"results/{name}" for name in (OfArchive.TEMPLATES, OfArchive.DETECTORS))
REPORT = f"results/{OfArchive.REPORT}"
SOURCE = "simulated phantom, played by the demo"
# Seed of the labelled recordings; played runs have higher seeds.
LABELLED_SEED = 1
# Number of runs of each size in mm: enough to learn from, few enough for a report in seconds.
LABELLED = {0.0: 6, 1.0: 2, 2.0: 2, 3.0: 2, 4.0: 2, 5.0: 2}
# Where a run is recorded: raw/ must not change while the detectors learn from it.
PLAYED = "played"
_MARK = "SIMULATED.txt"
_TEXT = """Made by `capsule demo`. Everything in this folder is simulated. It shows how the system
works, and nothing about a real gut. Delete the folder whenever you like.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add = parser.add_argument
    out = "the demo's own folder, never your raw/ (default: demo)"
    add("--out", type=Path, default=Path("demo"), metavar="FOLDER", help=out)
    faster = "speed relative to a real run (default: 1)"
    add("--speed", type=number_within(0.5, 100), default=1.0, metavar="X", help=faster)
    nodule = "nodule size; 0: no nodule (default: 3)"
    add("--size", type=number_within(0, 5, "mm"), default=3.0, metavar="MM", help=nodule)
    run = "random seed; each seed is another run (default: the first not played yet)"
    add("--seed", type=natural, metavar="N", help=run)
    cores = "number of jobs that run at the same time for the report (default: all)"
    add("--cores", default="all", metavar="N", help=cores)
    live = "show the run in a page on this computer"
    add("--live", action=argparse.BooleanOptionalAction, default=True, help=live)
    add("--no-open", dest="open", action="store_false", help="open no browser")


def main(arguments: argparse.Namespace) -> None:
    """Play the demo; a fault of the recorder has the recorder's exit status."""
    terminal.install()
    demo(arguments)


def demo(chosen: argparse.Namespace) -> None:
    """Play the demo.

    Raises
    ------
    CapsuleError
        The folder was not made by a demo, or the workflow or the recorder failed.
    """
    live = opened_page(browser=chosen.open) if chosen.live else contextlib.nullcontext()
    with live as page:
        phantom, sensors = read_phantom(DEFAULT_TABLE, []), read_settings()["recording"]["sensors"]
        prepare(chosen.out, phantom, sensors)
        seed = chosen.seed or next_seed(chosen.out)
        name = run_name(seed)
        truth = simulate_run(phantom, chosen.size, seed, name, sensors=sensors)
        how = "in real time" if chosen.speed == 1 else f"{chosen.speed:g} times as fast"
        print(
            f"Everything here is simulated and goes to {chosen.out}/. A simulated board plays a "
            f"run over an unknown place, {how}. Ctrl-C ends the run early and "
            f"keeps it. Meanwhile the detectors learn from {sum(LABELLED.values())} labelled "
            "recordings, unless an earlier demo did it."
        )
        with contextlib.closing(Learning(chosen)) as learning:
            run = PlayedRun(truth.counts, phantom, seed, chosen.speed)
            recorded = recorder.record(_recorder_options(chosen, name), run, learning, page)
    path = chosen.out / "raw" / UNLABELLED / recorded.name
    path.parent.mkdir(parents=True, exist_ok=True)
    recorded.rename(path)
    if truth.nodule_mm:
        at = words.number(truth.nodule_at_mm, 1)
        print(f"The truth: a nodule of {truth.nodule_mm:g} mm, which sensor 1 passes at {at} mm.")
    else:
        print("The truth: there is no nodule.")
    print("Now the report is made.")
    _make(chosen, REPORT)
    report = chosen.out / REPORT
    print(f"The report: {report}. To judge the run again:")
    print(f"  cd {chosen.out} && capsule judge {path.relative_to(chosen.out).as_posix()}")
    if chosen.open and not webbrowser.open(report.resolve().as_uri()):
        print("The demo cannot open a browser; open the report yourself.")


class Learning(FinalVerdict):
    """Detectors that learn from the labelled recordings while the run is played."""

    def __init__(self, chosen: argparse.Namespace) -> None:
        self._chosen, self._has_learned = chosen, False
        self.settings = read_settings(chosen.out / OWN_CONFIG)
        check_workflow(chosen.out)
        command = snakemake_command(chosen.out, [f"--cores={chosen.cores}", *LEARNED])
        (chosen.out / "logs").mkdir(exist_ok=True)
        with (chosen.out / "logs" / "learning.log").open("wb") as log:
            self._snakemake = subprocess.Popen(command, cwd=chosen.out, stdout=log, stderr=log)

    def close(self) -> None:
        """End the learning, if it still goes on."""
        if self._snakemake.poll() is None:
            self._snakemake.send_signal(signal.SIGINT)
            self._snakemake.wait()

    def judge_so_far(
        self, samples: Sequence[Sequence[float] | None], header: Mapping[str, str]
    ) -> Judgement:
        """Judge a run in progress, once the detectors have learned."""
        if self._snakemake.poll() == 0:
            return super().judge_so_far(samples, header)
        return Judgement(self.settings, waits="the detectors still learn")

    def judge(self, values: FloatArray) -> Judgement:
        """Wait for the detectors, and judge; raise `CapsuleError` if they cannot learn."""
        if not self._has_learned:
            if self._snakemake.poll() is None:
                print("The detectors still learn; the verdicts come in a moment.")
            if self._snakemake.wait():
                _make(self._chosen, *LEARNED)  # Ctrl-C ended it too; or a fault, which this shows
            templates, learned = (self._chosen.out / name for name in LEARNED)
            super().__init__(templates, learned, self.settings)
            self._has_learned = True
        return super().judge(values)


def _make(chosen: argparse.Namespace, *targets: str) -> None:
    """Run the workflow in the demo's folder."""
    if status := call_workflow(chosen.out, [f"--cores={chosen.cores}", *targets]):
        how = "was interrupted" if status == INTERRUPTED else f"ended with status {status}"
        raise CapsuleError(
            f"the workflow {how}; the recordings are kept in {chosen.out / 'raw'}. To continue, "
            "run the same command again"
        )


def _recorder_options(chosen: argparse.Namespace, name: str) -> argparse.Namespace:
    """Return the options with which `capsule record` would record this run."""
    parser = argparse.ArgumentParser()
    record_command.add_arguments(parser)
    about = f"--unlabelled --detect --name {name} --site {name} --session demo --setup {name}"
    places = {"--raw": PLAYED, "--logs": "logs", "--config": OWN_CONFIG}
    where = [f"{option}={chosen.out / place}" for option, place in places.items()]
    return parser.parse_args([*about.split(), *where])


class PlayedRun(Source):
    """A simulated run in place of a logger board, played at a `speed` relative to a real one."""

    def __init__(self, counts: IntArray, phantom: Phantom, seed: int, speed: float) -> None:
        header = simulated_header(SOURCE, phantom, seed)
        super().__init__("a simulated board", header, channels=str(len(counts)))
        self._readings, self._rate_hz = counts.T.tolist(), phantom.electronics.rate_hz
        self._speed, self._begun_s, self._sent = speed, elapsed_s(), 0

    def read(self, timeout_s: float) -> list[Arrival]:
        """Wait, and return the samples that are due."""
        time.sleep(timeout_s)
        now_s = elapsed_s()
        due = int((now_s - self._begun_s) * self._rate_hz * self._speed)
        samples = []
        for number in range(self._sent, min(due, len(self._readings))):
            device_ms = round(1000 * number / self._rate_hz)
            at_end = number == len(self._readings) - 1
            samples.append(Sample(number, device_ms, tuple(self._readings[number]), at_end))
        self._sent += len(samples)
        return [Arrival(sample, now_s) for sample in samples]


def prepare(folder: Path, phantom: Phantom, sensors: int) -> None:
    """Write the missing files of the demo's folder.

    Raises
    ------
    CapsuleError
        The folder holds other files.
    """
    if not (folder / _MARK).exists() and is_taken(folder):
        raise CapsuleError(
            f"{folder} exists and was not made by a demo; nothing was written. Choose another "
            "folder: --out FOLDER"
        )
    for name, text in ((_MARK, _TEXT), (OWN_CONFIG, own_configuration())):
        if not (folder / name).exists():
            with files.write_whole(folder / name) as stream:
                stream.write(text)
    for run in planned_runs(list(LABELLED), list(LABELLED.values()), 1):
        path = folder / "raw" / f"{run.name}.csv"
        if not path.exists():
            write_run(path, run, phantom, LABELLED_SEED, sensors)


def next_seed(folder: Path) -> int:
    """Return the lowest seed whose run is not in the demo's folder."""
    played = [*folder.glob(f"raw/{UNLABELLED}/*"), *folder.glob(f"{PLAYED}/{UNLABELLED}/*")]
    taken = {path.name.partition(".")[0] for path in played}
    return next(seed for seed in count(LABELLED_SEED + 1) if run_name(seed) not in taken)


def run_name(seed: int) -> str:
    """Return the name of the recording of a played run."""
    return f"simulated-{seed}"
