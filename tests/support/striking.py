"""Kill a run, only Snakemake, or a single job at a random moment."""

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

# A run of few recordings starts its next job within this time, in s, or has no job left.
_PATIENCE_S = 2.0
_SCRIPT = re.compile(r"\S*workflow/scripts/\w+\.py")


def strike_at_random(
    process: subprocess.Popen[str],
    numbers: random.Random,
    strike: Callable[[], None],
    *,
    most_jobs: int = 2,
) -> None:
    """Read a run's log to its end, and call a function once during the run.

    The moment is a random time after a random number of jobs have begun. So the moments spread over
    the run, even on a busy computer. With 0 jobs, the moment is during the start of Snakemake. If
    the run ends before, the function is not called.

    Parameters
    ----------
    process : Popen
        Process from `Project.start`.
    numbers : Random
        Random numbers for the moment.
    strike : callable
        The function.
    most_jobs : int
        Largest number of jobs before the moment.
    """
    jobs = numbers.randint(0, most_jobs)
    timer = threading.Timer(numbers.uniform(0.0, 0.5 if jobs else 1.5), strike)
    begun = 0
    with process:
        if jobs == 0:
            timer.start()
        for line in process.stdout or []:
            begun += bool(re.match(r"\d+ of \d+: ", line))
            if jobs and begun == jobs:
                timer.start()
                jobs = 0
        # After the end, another process could have the same number.
        timer.cancel()
        if timer.ident is not None:
            timer.join()


def kill_run(process: subprocess.Popen[str]) -> None:
    """Kill Snakemake and all its jobs."""
    # The last process of the group may have ended just before.
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def kill_snakemake(process: subprocess.Popen[str]) -> None:
    """Kill only Snakemake; its jobs continue."""
    process.kill()


def kill_job(process: subprocess.Popen[str], numbers: random.Random) -> None:
    """Kill one of the running jobs, as soon as there is one."""
    deadline = time.monotonic() + _PATIENCE_S
    with contextlib.suppress(psutil.NoSuchProcess):
        while time.monotonic() < deadline:
            if at_work := running_jobs(process):
                numbers.choice(at_work).kill()
                return
            time.sleep(0.005)


def running_jobs(process: subprocess.Popen[str]) -> list[psutil.Process]:
    """Return the processes of the scripts that a Snakemake runs.

    Raises
    ------
    psutil.NoSuchProcess
        Snakemake has ended.
    """
    scripts = []
    for child in psutil.Process(process.pid).children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):
            # The shell that calls a script names it behind "-c", in the midst of a command.
            if any(_SCRIPT.fullmatch(argument) for argument in child.cmdline()):
                scripts.append(child)
    return scripts
