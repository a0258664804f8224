"""The benchmarks find what they import. Nothing else would notice, since no test runs them."""

import os
import subprocess
import sys

import pytest

from support.project import ROOT

# Those in `peers` need packages of their own.
BENCHMARKS = sorted((ROOT / "tests" / "benchmarks").glob("*.py"))
# A module has another name than a script that runs, so this calls no benchmark's `main`.
IMPORT_ALL = """
import runpy, sys
for path in sys.argv[1:]:
    runpy.run_path(path, run_name="imported")
    print(path)
"""


@pytest.mark.slow
@pytest.mark.takes(4)
def test_every_benchmark_can_be_imported():
    assert len(BENCHMARKS) > 10
    folder = str(ROOT / "tests" / "benchmarks")
    done = subprocess.run(
        [sys.executable, "-c", IMPORT_ALL, *BENCHMARKS],
        env={**os.environ, "PYTHONPATH": folder},
        capture_output=True,
        text=True,
    )
    assert done.stdout.splitlines() == [str(path) for path in BENCHMARKS], done.stderr
