"""Measure the imports of the jobs of one recording, and their cost.

    python tests/benchmarks/measure_imports.py raw/3mm/r07.csv

Runs preprocess.py and fit.py on the recording, as the workflow does, in turn with a process that
does nothing but import numpy; medians of the rounds. A job's own work is what it takes longer than
the same script with --help. For every single module of a job:
python -X importtime workflow/scripts/fit.py --help
"""

import argparse
import hashlib
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
SCRIPTS = ROOT / "workflow" / "scripts"
IMPORT = re.compile(r"import time: +(\d+) \| +(\d+) \|( +)(\S+)")
# One thread, as in the workflow's jobs.
ENVIRONMENT = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def job_commands(recording: Path, folder: Path) -> dict[str, list[str]]:
    """Return the commands of the recording's jobs; they write to the folder."""
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
    name = f"{recording.parent.name}/{recording.stem}"
    checksum = hashlib.sha256(recording.read_bytes()).hexdigest()
    written = ("signal.npy", "matrix.npy", "check.json", "fit.json")
    signal, matrix, check, fit = (str(folder / file) for file in written)
    common = ["--batch", name, "--settings", json.dumps(config)]
    common += ["--signals", signal, "--matrices", matrix]
    told = ["--contents", f"{recording}={checksum}", "--checks", check]
    return {
        "preprocess": [str(SCRIPTS / "preprocess.py"), name, *common, *told],
        "fit": [str(SCRIPTS / "fit.py"), name, *common, "--output", fit],
    }


def imports(log: str) -> tuple[float, float]:
    """Return the milliseconds that numpy's import took, and those of all others since the start."""
    found = IMPORT.findall(log)
    total = sum(int(itself) for itself, *_ in found)
    (numpy,) = (int(cumulative) for _, cumulative, _, name in found if name == "numpy")
    return numpy / 1e3, (total - numpy) / 1e3


def run(command: list[str], *options: str) -> tuple[float, subprocess.CompletedProcess]:
    """Run Python; give the milliseconds from start to finish, and what it wrote."""
    start = time.perf_counter()
    ended = subprocess.run(
        [sys.executable, *options, *command],
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        check=True,
    )
    return 1e3 * (time.perf_counter() - start), ended


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", type=Path, help="a recording, such as raw/3mm/r07.csv")
    parser.add_argument("--rounds", type=int, default=15, help="rounds to take medians of")
    arguments = parser.parse_args()
    rows: dict[str, list[tuple[float, ...]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(arguments.rounds):
            for name, command in job_commands(arguments.recording, Path(folder)).items():
                bare, _ = run(["-c", "import numpy"])
                idle, _ = run([command[0], "--help"])
                whole, _ = run(command)
                own = whole - idle
                _, traced = run(command, "-X", "importtime")
                row = (*imports(traced.stderr), whole, bare, own, whole / (bare + own))
                rows.setdefault(name, []).append(row)
    print("| job | imports of numpy | all other imports | start to finish |", end="")
    print(" `import numpy` alone | own work | job / (numpy + work) |")
    print("|---|---:|---:|---:|---:|---:|---:|")
    for name, measured in rows.items():
        *times, ratio = (statistics.median(column) for column in zip(*measured, strict=True))
        print(f"| {name} | {' | '.join(f'{value:.0f} ms' for value in times)} | {ratio:.2f} |")


if __name__ == "__main__":
    main()
