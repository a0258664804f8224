"""Play a simulated run without a board, judge it live, and make its report."""

import argparse
import contextlib
import signal
import time
import webbrowser
from collections.abc import Iterator
from pathlib import Path

from capsule import words
from capsule.arguments import natural, number_within
from capsule.bench import demo_archive, output, run
from capsule.bench.bench_errors import AcquisitionError
from capsule.bench.played_board import played_board
from capsule.bench.record_command import options_of
from capsule.configuration import read_settings
from capsule.errors import CapsuleError
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import Run, simulate_run, simulated_header
from capsule.project import OWN_CONFIG
from capsule.workflow_call import INTERRUPTED, call_workflow

LEARNED = ("results/templates.npz", "results/detectors.json")
REPORT = "results/report.html"
SOURCE = "simulated phantom, played by the demo"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add = parser.add_argument
    out = "the demo's own folder, never your raw/ (default: demo)"
    add("--out", type=Path, default=Path("demo"), metavar="FOLDER", help=out)
    faster = "speed relative to a real run (default: 5)"
    add("--speed", type=number_within(0.5, 100), default=5.0, metavar="X", help=faster)
    nodule = "nodule size; 0: no nodule (default: 3)"
    add("--size", type=number_within(0, 5, "mm"), default=3.0, metavar="MM", help=nodule)
    run = "random seed; each seed is another run (default: the first not played yet)"
    add("--seed", type=natural, metavar="N", help=run)
    add("--plot", action="store_true", help="show the sensors in a window, if one can be opened")
    cores = "number of jobs that run at the same time for the report (default: all)"
    add("--cores", default="all", metavar="N", help=cores)
    add("--no-open", dest="open", action="store_false", help="do not open a browser at the end")


def main(arguments: argparse.Namespace) -> None:
    """Play the demo; a fault of the recorder has the recorder's exit status."""
    output.install()
    demo(arguments)


def demo(chosen: argparse.Namespace) -> None:
    """Play the demo.

    Parameters
    ----------
    chosen : argparse.Namespace
        The options of the command.

    Raises
    ------
    CapsuleError
        The folder was not made by a demo, or the workflow or the recorder failed.
    """
    begun_s = time.monotonic()
    settings = read_settings()
    phantom, sensors = read_phantom(DEFAULT_TABLE, []), settings["recording"]["sensors"]
    demo_archive.prepare(chosen.out, phantom, sensors)
    seed = chosen.seed or demo_archive.next_seed(chosen.out)
    name = demo_archive.run_name(seed)
    tell(
        f"Everything here is simulated and goes to {chosen.out}/. First the detectors learn from "
        f"{sum(demo_archive.LABELLED.values())} labelled recordings, unless an earlier demo did it."
    )
    _make(chosen, *LEARNED)
    played = simulate_run(phantom, chosen.size, seed, name, sensors=sensors)
    header = simulated_header(SOURCE, phantom, seed)
    origin = {key: header[key] for key in ("source", "simulator_version", "simulator_seed")}
    tell(
        f"Now a simulated board plays a run over an unknown place, {chosen.speed:g} times as "
        "fast as a real run. Ctrl-C ends the run early and keeps it."
    )
    with (
        _former_signals(),
        played_board(played.counts, phantom.electronics, chosen.speed) as port,
    ):
        path = run.record(_recorder_options(chosen, name, port), origin)
    _tell_truth(played)
    tell(f"The verdicts came {_since(begun_s)} after the start. Now the workflow makes the report.")
    _make(chosen, REPORT)
    report = chosen.out / REPORT
    tell(f"The report came {_since(begun_s)} after the start: {report}. To judge the run again:")
    tell(f"  cd {chosen.out} && capsule judge {path.relative_to(chosen.out).as_posix()}")
    if chosen.open and not webbrowser.open(report.resolve().as_uri()):
        tell("The demo cannot open a browser; open the report yourself.")


def tell(text: str) -> None:
    """Print a line at once."""
    print(text, flush=True)


def _since(begun_s: float) -> str:
    return words.duration(time.monotonic() - begun_s)


def _make(chosen: argparse.Namespace, *targets: str) -> None:
    """Run the workflow in the demo's folder."""
    if status := call_workflow(chosen.out, [f"--cores={chosen.cores}", *targets]):
        how = "was interrupted" if status == INTERRUPTED else f"ended with status {status}"
        raise CapsuleError(
            f"the workflow {how}; the recordings are kept in {chosen.out / 'raw'}. To continue, "
            "run the same command again"
        )


@contextlib.contextmanager
def _former_signals() -> Iterator[None]:
    """Restore the former signal handlers at the end, so that Ctrl-C reaches the workflow again."""
    former = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, former[0])
        signal.signal(signal.SIGTERM, former[1])


def _recorder_options(chosen: argparse.Namespace, name: str, port: str) -> argparse.Namespace:
    """Return the options with which `capsule record` would record this run."""
    places = {
        "--raw": chosen.out / "raw",
        "--logs": chosen.out / "logs",
        "--templates": chosen.out / LEARNED[0],
        "--config": chosen.out / OWN_CONFIG,
    }
    words_of_it = ["--unlabelled", "--detect", "--port", port, "--name", name]
    words_of_it += ["--site", name, "--session", "demo", "--setup", name]
    words_of_it += [str(word) for pair in places.items() for word in pair]
    if chosen.plot and _has_screen():
        words_of_it.append("--plot")
    return options_of(words_of_it)


def _has_screen() -> bool:
    """Return whether a window can be opened; print the reason if not."""
    from capsule.bench.window import check_screen  # matplotlib only if it is used

    try:
        check_screen()
    except AcquisitionError as reason:
        tell(f"note: {reason}; the terminal shows the run")
        return False
    return True


def _tell_truth(played: Run) -> None:
    if played.nodule_mm:
        at = words.number(played.nodule_at_mm, 1)
        tell(f"The truth: a nodule of {played.nodule_mm:g} mm, which sensor 1 passes at {at} mm.")
    else:
        tell("The truth: there is no nodule.")
