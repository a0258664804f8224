"""Measure the commands of `capsule` from the key to the end: wall and CPU seconds.

    python tests/benchmarks/measure_command.py [--rounds 7] [--demo]

Judges a recording of raw/ by results/detectors.json, in words, as JSON and with a picture, in turn
with the command's help and with Python alone; medians of the rounds. With --demo also one demo in a
new folder, without a browser. Other programs at work make the wall's seconds longer, not those of
the CPU.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
COMMAND = str(ROOT / "workflow/scripts/capsule")
RECORDING = "raw/3mm/r07.csv"
# One thread, as in the workflow's jobs.
ENVIRONMENT = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def measure(words: Sequence[str]) -> tuple[float, float]:
    """Run Python with these words; give the seconds of the wall and of the CPU."""
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(
        [sys.executable, *words],
        cwd=ROOT,
        env=ENVIRONMENT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=True,
    )
    wall_s, after = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall_s, sum((after.ru_utime, after.ru_stime)) - sum((before.ru_utime, before.ru_stime))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=7, help="how often each (default: 7)")
    parser.add_argument(
        "--demo", action="store_true", help="a demo too, which takes most of a minute"
    )
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        calls = {
            "python alone": ["-c", ""],
            "capsule --help": [COMMAND, "--help"],
            "capsule judge FILE": [COMMAND, "judge", RECORDING],
            "capsule judge FILE --json": [COMMAND, "judge", RECORDING, "--json"],
        }
        for kind in ("svg", "png"):
            picture = ["--picture", f"{folder}/run.{kind}"]
            calls[f"capsule judge FILE --picture run.{kind}"] = [
                *calls["capsule judge FILE"],
                *picture,
            ]
        rounds = {call: [] for call in calls}
        for _ in range(arguments.rounds):
            for call, words in calls.items():
                rounds[call].append(measure(words))
        if arguments.demo:
            words = [COMMAND, "demo", "--no-open", "--out", f"{folder}/demo"]
            rounds["capsule demo, in a new folder"] = [measure(words)]
    print("| call | wall | CPU |\n|---|---:|---:|")
    for call, times in rounds.items():
        wall_s, cpu_s = (statistics.median(each) for each in zip(*times, strict=True))
        print(f"| `{call}` | {wall_s:.2f} s | {cpu_s:.2f} s |")


if __name__ == "__main__":
    main()
