"""Import files with bytes changed at random, and print what came of each format's files.

    python tests/benchmarks/fuzz_import.py --number 300

A traceback, more than 1 GB of memory or more than 5 s of a processor is a fault; the file is kept,
and the exit status is 1. A process of its own imports fifty files of a format, then fifty of the
next one follow. If a package crashes in it, or comes to no end, each of the fifty is imported once
more, as the command does it.
"""

import argparse
import contextlib
import io
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "workflow" / "scripts"), str(ROOT / "tests")]

from capsule.commands.cli import build_parser
from capsule.importing import reading_apart
from capsule.importing.command import Importer
from support.damaged_files import damaged, given_path, write_each_format

MOST_BYTES = 1_000_000_000
MOST_SECONDS = 5.0
# A process that exceeds the limits by far is ended.
_END_BYTES, _END_SECONDS = 4 * MOST_BYTES, 4 * int(MOST_SECONDS)
_BATCH = 50
_FAULTS = ("traceback", "too large", "too slow", "crash")


class _Here:
    """Takes the place of `Forks`, and calls in this process, which is a fork itself."""

    def __init__(self, _: int) -> None:
        pass

    def __call__(self, function: Callable, parts: Iterable) -> Iterator:
        return map(function, parts)


def import_apart(
    file: Path, whole: bytes, seed: list[int], numbers: range, *, here: bool
) -> tuple[list[str], float, int]:
    """Import damaged files in a process of its own.

    Parameters
    ----------
    file : Path
        The file to write and to import.
    whole : bytes
        Its content without damage.
    seed : list of int
        With its number, seeds the damage of each file.
    numbers : range
        Numbers of the files.
    here : bool
        Whether packages read the file in that process, and not in one more.

    Returns
    -------
    outcomes : list of str
        ``imported``, ``refused`` or a fault, for each file; the last one is a crash if the process
        ended there.
    longest : float
        Most seconds of a processor that a file took.
    most_bytes : int
        Largest memory of the process.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_AS, (_END_BYTES, _END_BYTES))
        if here:
            reading_apart.Forks = _Here
            # It would end this process, which reads fifty files.
            reading_apart.limit_process = lambda *_: None
        with os.fdopen(writing, "w", buffering=1) as told:
            _import_each(file, whole, seed, numbers, told)
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as told:
        lines = [line.split(maxsplit=1) for line in told.read().splitlines()]
    _, _, used = os.wait4(child, 0)
    outcomes = [outcome for _, outcome in lines]
    return (
        outcomes + ["crash"] * (len(outcomes) < len(numbers)),
        max((float(seconds) for seconds, _ in lines), default=0.0),
        used.ru_maxrss * 1024,
    )


def _processor_time_s() -> float:
    """Return the time that this process and those that it has started took of a processor."""
    return sum(os.times()[:4])


def _import_each(file: Path, whole: bytes, seed: list[int], numbers: range, told: io.TextIOBase):
    given = str(given_path(file))
    words = ["import", given, "--size", "3", "--dry-run", "--raw", str(file.parent / "raw")]
    importer = Importer(build_parser(["import"]).parse_args(words))
    for number in numbers:
        file.write_bytes(damaged(whole, np.random.default_rng([*seed, number])))
        before, start = importer.refused, _processor_time_s()
        signal.setitimer(signal.ITIMER_PROF, _END_SECONDS)
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            try:
                importer.run()
                outcome = "refused" if importer.refused > before else "imported"
            except BaseException:  # noqa: BLE001 (any traceback is a fault, and is shown)
                outcome = "traceback"
                (file.parent / "traceback.txt").write_text(traceback.format_exc())
        seconds = _processor_time_s() - start
        print(seconds, "too slow" if seconds > MOST_SECONDS else outcome, file=told)


def main() -> None:
    """Import the given number of damaged files of each format, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--number", type=int, default=100, help="damaged files of each format")
    parser.add_argument("--minutes", type=float, default=1e9, help="end after this time")
    parser.add_argument("--seed", type=int, default=1, help="seed of the random changes")
    parser.add_argument("--only", nargs="+", metavar="ENDING", help="formats, such as .h5")
    parser.add_argument("--keep", type=Path, default=Path("fuzzed"), help="folder of the faults")
    options = parser.parse_args()
    end = time.monotonic() + 60 * options.minutes
    with tempfile.TemporaryDirectory() as temporary:
        files = write_each_format(Path(temporary))
        chosen = {key: files[key] for key in files if key in (options.only or files)}
        whole = {key: file.read_bytes() for key, file in chosen.items()}
        counts = {key: Counter[str]() for key in chosen}
        longest, most = dict.fromkeys(chosen, 0.0), dict.fromkeys(chosen, 0)
        for first in range(0, options.number, _BATCH):
            for key, file in chosen.items():
                if time.monotonic() > end:
                    break
                seed = [options.seed, list(files).index(key)]
                numbers = range(first, min(first + _BATCH, options.number))
                outcomes, seconds, used = import_apart(file, whole[key], seed, numbers, here=True)
                if {"crash", "too slow"} & {*outcomes} or used > MOST_BYTES:
                    # Each file once more on its own, as the command reads it.
                    outcomes, seconds, used = _one_by_one(file, whole[key], seed, numbers)
                for number, outcome in zip(numbers, outcomes, strict=True):
                    if outcome in _FAULTS:
                        _keep(options.keep, file, whole[key], [*seed, number], outcome)
                counts[key].update(outcomes)
                longest[key], most[key] = max(longest[key], seconds), max(most[key], used)
    names = ("imported", "refused", *_FAULTS)
    print(f"{'format':9}", *(f"{name:>10}" for name in (*names, "most MB", "most s")))
    for key, counted in counts.items():
        cells = [f"{counted[name]:10}" for name in names]
        print(f"{key:9}", *cells, f"{most[key] / 1e6:10.0f}", f"{longest[key]:10.2f}")
    sys.exit(any(counted[name] for counted in counts.values() for name in _FAULTS))


def _one_by_one(
    file: Path, whole: bytes, seed: list[int], numbers: range
) -> tuple[list[str], float, int]:
    each = [
        import_apart(file, whole, seed, range(number, number + 1), here=False) for number in numbers
    ]
    outcomes = ["too large" if used > MOST_BYTES else outcome for (outcome,), _, used in each]
    return outcomes, max(seconds for _, seconds, _ in each), max(used for _, _, used in each)


def _keep(kept: Path, file: Path, whole: bytes, seed: list[int], outcome: str) -> None:
    kept.mkdir(exist_ok=True)
    name = f"{seed[-1]}-{outcome.replace(' ', '-')}-{file.name}"
    (kept / name).write_bytes(damaged(whole, np.random.default_rng(seed)))
    told = file.parent / "traceback.txt"
    if told.exists():
        told.rename(kept / f"{name}.txt")


if __name__ == "__main__":
    main()
