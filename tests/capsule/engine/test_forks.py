"""Work that is spread over forks of a process."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from capsule.engine.forks import forked
from support.marks import needs_forks
from support.project import ROOT

STARTER = """
import os, time
from capsule.engine.forks import forked
list(forked(lambda _: os.write(1, b"%d\\n" % os.getpid()) and time.sleep(20), "ab", 2))
"""


@pytest.mark.parametrize("processes", [1, pytest.param(2, marks=needs_forks)])
def test_the_results_come_in_order_from_processes_of_one_thread_each(processes):
    def work(number):
        threads = {pool["num_threads"] for pool in threadpool_info()}
        return number**2, os.getpid() == starter, threads

    starter = os.getpid()
    with threadpool_limits(limits=2):
        made = list(forked(work, [3, 1, 2], processes))
    assert made == [(square, processes == 1, {1}) for square in (9, 1, 4)]


@pytest.mark.takes(1.5)
@needs_forks
def test_the_processes_end_with_a_killed_starter():
    words = [sys.executable, "-c", STARTER]
    scripts = ROOT / "workflow/scripts"
    with subprocess.Popen(words, cwd=scripts, stdout=subprocess.PIPE, text=True) as starter:
        one, other = (Path("/proc", starter.stdout.readline().strip()) for _ in range(2))
        assert one.exists() and other.exists()
        starter.kill()
    ends = time.monotonic() + 10
    while one.exists() or other.exists():
        assert time.monotonic() < ends
        time.sleep(0.01)
