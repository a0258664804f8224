"""Work that is spread over forks of a process."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from capsule.engine.forks import Forks
from support.marks import needs_forks

SCRIPTS = Path(__file__).parents[3] / "workflow" / "scripts"
STARTER = f"""
import os, sys, time
sys.path.insert(0, {str(SCRIPTS)!r})
from capsule.engine.forks import Forks

def name(_):
    time.sleep(0.2)
    return os.getpid()

names = set()
for each in Forks(2)(name, range(40)):
    names.add(each)
    if len(names) == 2:
        print(*names, flush=True)
"""


@pytest.mark.parametrize("processes", [1, 2])
def test_the_results_come_in_the_order_of_the_parts(processes):
    shared = {"a": 3, "b": 1, "c": 2}
    assert list(Forks(processes)(lambda name: shared[name] ** 2, "abc")) == [9, 1, 4]


@needs_forks
def test_more_than_one_process_works_beside_this_one():
    assert set(Forks(1)(lambda _: os.getpid(), range(3))) == {os.getpid()}
    assert os.getpid() not in set(Forks(2)(lambda _: os.getpid(), range(3)))


@pytest.mark.parametrize("processes", [1, 2])
def test_each_process_computes_with_one_thread(processes):
    with threadpool_limits(limits=2):
        spread = Forks(processes)
        for pools in spread(lambda _: threadpool_info(), range(2)):
            assert {pool["num_threads"] for pool in pools} == {1}


def test_an_error_of_a_part_reaches_the_caller():
    with pytest.raises(ZeroDivisionError):
        list(Forks(2)(lambda number: 1 / number, [1, 0]))


@pytest.mark.takes(1.5)
@needs_forks
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
