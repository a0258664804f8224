"""The processes that draw figures."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[2] / "workflow" / "scripts"
STARTER = f"""
import os, sys, time
sys.path.insert(0, {str(SCRIPTS)!r})
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from edges.figure_files import end_with_starter

def name(_):
    time.sleep(0.2)
    return os.getpid()

with ProcessPoolExecutor(2, get_context("fork"), initializer=end_with_starter) as pool:
    print(*set(pool.map(name, range(4))), flush=True)
    time.sleep(60)
"""


@pytest.mark.slow(1.5)
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux draws in forks")
def test_the_processes_end_with_a_killed_starter():
    with subprocess.Popen(
        [sys.executable, "-c", STARTER], stdout=subprocess.PIPE, text=True
    ) as starter:
        processes = [Path("/proc") / name for name in starter.stdout.readline().split()]
        assert len(processes) == 2
        assert all(process.exists() for process in processes)
        starter.send_signal(signal.SIGKILL)
    ends = time.monotonic() + 10
    while any(process.exists() for process in processes):
        assert time.monotonic() < ends
        time.sleep(0.01)
