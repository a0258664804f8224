"""Strike at a run at a random moment: at all of it, at Snakemake alone, or at a single job."""

import contextlib
import os
import random
import re
import signal
import subprocess
import threading
import time
from collections.abc import Callable

import psutil

from support.preloaded import ForkedCall

# A run of few recordings starts its next job within this time, or has none left.
_PATIENCE_S = 2.0


def strike_at_random(
    process: subprocess.Popen[str] | ForkedCall,
    numbers: random.Random,
    strike: Callable[[], None],
    *,
    most_jobs: int = 2,
    hear: Callable[[str], None] = lambda line: None,
) -> None:
    """Read a run's log to its end, and strike once.

    The moment is a random time after a random number of jobs have begun, so that moments spread
    over the run however busy the machine is; with no job, over the start of Snakemake. A run that
    ends before is left alone.

    Parameters
    ----------
    process : Popen
        From `Project.start`.
    numbers : Random
        Draws the moment.
    strike : callable
        What is done then.
    most_jobs : int
        After so many jobs at the latest.
    hear : callable
        Gets each line of the log.
    """
    jobs = numbers.randint(0, most_jobs)
    timer = threading.Timer(numbers.uniform(0.0, 0.5 if jobs else 1.5), strike)
    begun = 0
    with process:
        if jobs == 0:
            timer.start()
        for line in process.stdout or []:
            hear(line)
            begun += bool(re.match(r"(?:local)?rule \w+:$", line))
            if jobs and begun == jobs:
                timer.start()
                jobs = 0
        # Not at whatever may get the number of a process that has ended.
        timer.cancel()
        if timer.ident is not None:
            timer.join()


def kill_run(process: subprocess.Popen[str] | ForkedCall) -> None:
    """Kill Snakemake and all its jobs without warning."""
    # The group's last member may just have ended by itself.
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def kill_snakemake(process: subprocess.Popen[str] | ForkedCall) -> None:
    """Kill Snakemake alone; its jobs go on as orphans."""
    process.kill()


def kill_job(process: subprocess.Popen[str] | ForkedCall, numbers: random.Random) -> None:
    """Kill one of the jobs that are at work, as soon as there is one."""
    deadline = time.monotonic() + _PATIENCE_S
    with contextlib.suppress(psutil.NoSuchProcess):
        while time.monotonic() < deadline:
            if at_work := _jobs(psutil.Process(process.pid)):
                numbers.choice(at_work).kill()
                return
            time.sleep(0.005)


def _jobs(snakemake: psutil.Process) -> list[psutil.Process]:
    """List the scripts that work for a Snakemake."""
    scripts = []
    for child in snakemake.children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):
            if "--record" in child.cmdline():
                scripts.append(child)
    return scripts
