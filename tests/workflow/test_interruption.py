"""After a kill or with a full disk, the same command continues the run."""

import contextlib
import itertools
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import pytest

import capsule
from capsule.engine.locks import hold_run_lock
from capsule.errors import CapsuleError
from capsule.store.files import UNFINISHED
from support.marks import needs_process_groups
from support.mishaps import (
    RECORDINGS,
    TABLES,
    FreshResults,
    create_project,
    deal,
    try_sequence,
)
from support.project import Project
from support.striking import kill_run, running_jobs, strike_at_random

pytestmark = [pytest.mark.slow, needs_process_groups]

# In the check; try_mishaps.py kills hundreds of runs by hand.
KILLS = 4


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Return a project after one run; tests copy it and do not change it."""
    return create_project(tmp_path_factory.mktemp("undisturbed") / "project")


@pytest.fixture(scope="module")
def new(undisturbed, tmp_path_factory):
    """Return the project without results."""
    project = undisturbed.copy(tmp_path_factory.mktemp("new") / "project")
    shutil.rmtree(project.results)
    shutil.rmtree(project.folder / ".snakemake")
    return project


@dataclass
class Progress:
    """The exit of a run, and the jobs that have started and finished, by their messages."""

    killed: bool = False
    started: list[str] = field(default_factory=list)
    finished: list[str] = field(default_factory=list)
    _by_number: dict[str, str] = field(default_factory=dict)

    def read(self, project: Project) -> None:
        """Read Snakemake's log of the last run, if it has begun one."""
        logs = sorted((project.folder / ".snakemake/log").glob("*.log"))
        for line in logs[-1].read_text(encoding="utf-8").splitlines() if logs else ():
            self._read(line)

    def _read(self, line: str) -> None:
        if match := re.match(r"Job (\d+): (.+)", line):
            self._by_number[match[1]] = match[2]
            self.started.append(match[2])
        elif (match := re.match(r"Finished jobid: (\d+)", line)) and match[1] in self._by_number:
            self.finished.append(self._by_number[match[1]])


def run_and_kill(project: Project, numbers: random.Random) -> Progress:
    """Start a run, and kill its whole process group at a random moment."""
    progress = Progress()
    process = project.start(*TABLES)
    strike_at_random(process, numbers, lambda: kill_run(process))
    progress.read(project)
    progress.killed = process.returncode == -signal.SIGKILL
    return progress


def half_written(project: Project, expected: dict[str, bytes]) -> list[str]:
    """Return the results that have their final name, but another content."""
    return [
        name
        for name, content in project.result_bytes().items()
        if not name.endswith(UNFINISHED) and content != expected[name]
    ]


def be_killed_again_and_again(
    new: Project, folder: Path, kills: int, expected: dict[str, bytes]
) -> int:
    """Kill a number of runs, and check the results after each; then run to the end."""
    numbers = random.Random(folder.name)
    killed = 0
    for attempt in itertools.count():
        project = new.copy(folder / f"attempt-{attempt}")
        finished: set[str] = set()
        ended = False
        while not ended:
            progress = run_and_kill(project, numbers) if killed < kills else run(project)
            killed += progress.killed
            ended = not progress.killed
            assert not finished & set(progress.started), "a finished job was done again"
            finished |= set(progress.finished)
            assert half_written(project, expected) == []
        assert project.result_bytes() == expected
        assert not list(project.results.rglob(f"*{UNFINISHED}"))
        if killed >= kills:
            assert project.snakemake(*TABLES).did_nothing
            return killed


def run(project: Project) -> Progress:
    """Run the workflow to its end."""
    done = project.snakemake(*TABLES, cores=1)
    assert done.status == 0, done.output
    progress = Progress()
    progress.read(project)
    return progress


@pytest.mark.workflow
@pytest.mark.takes(12)
def test_killed_at_random_moments_the_plain_command_goes_on(new, undisturbed, tmp_path):
    expected = undisturbed.result_bytes()
    with ThreadPoolExecutor() as pool:
        halves = [
            pool.submit(be_killed_again_and_again, new, tmp_path / name, KILLS // 2, expected)
            for name in ("one", "other")
        ]
        assert sum(half.result() for half in halves) == KILLS


@pytest.mark.workflow
@pytest.mark.takes(25)
def test_after_any_mishaps_the_results_are_those_of_a_fresh_run(undisturbed, tmp_path):
    """Each kind of mishap happens; `try_mishaps.py` tries hundreds of sequences by hand."""
    # Of a few states, since each costs a fresh run.
    fresh = FreshResults(undisturbed, editions=2, settings=2, sizes=[1, 100])
    for number, mishaps in enumerate(deal(seed=1, size=4)):
        told, fault = try_sequence(fresh, tmp_path / f"sequence-{number}", number, mishaps)
        assert not fault, (number, told, fault)


@pytest.mark.workflow
def test_two_runs_in_one_folder_exclude_each_other(new, tmp_path):
    project = new.copy(tmp_path / "project")
    # A fit that is still at work when the second run starts.
    project.configure(fit={"iterations": 1_000_000})
    with project.start("results/fits/3mm/r01.json") as first:
        try:
            assert any(re.match(r"\d+ of \d+: fit ", line) for line in first.stdout)
            second = project.snakemake(*TABLES)
            assert first.poll() is None
        finally:
            os.killpg(first.pid, signal.SIGKILL)
    assert second.status != 0
    assert not second.jobs["preprocess"]
    told = f"another run uses this folder (process {first.pid} on"
    assert told in second.output
    assert "wait until it has ended" in second.output
    assert project.snakemake("results/checks/3mm/r02.json").status == 0


@pytest.mark.workflow
def test_of_two_runs_started_together_one_does_all_and_the_other_is_told_why(
    new, undisturbed, tmp_path
):
    project = new.copy(tmp_path / "project")
    runs = [project.start(*TABLES), project.start(*TABLES), project.start("-n", *TABLES)]
    with ThreadPoolExecutor() as pool:
        outputs = list(pool.map(lambda run: run.communicate()[0], runs))
    assert runs[2].returncode == 0, outputs[2]
    (told,) = (output for run, output in zip(runs, outputs, strict=True) if run.returncode)
    assert "another run uses this folder" in told
    assert "Traceback" not in "".join(outputs)
    assert project.snakemake("-n", *TABLES).did_nothing
    made = project.result_bytes()
    expected = undisturbed.result_bytes()
    assert made == {name: expected[name] for name in made}


@pytest.mark.workflow
def test_a_job_of_a_killed_run_writes_nothing_once_the_next_has_begun(new, undisturbed, tmp_path):
    project = new.copy(tmp_path / "project")
    target = "fits/3mm/r01.json"
    # The fit is still at work when its run is killed.
    project.configure(fit={"iterations": 20_000})
    with project.start(f"results/{target}") as killed:
        assert any(re.match(r"\d+ of \d+: fit ", line) for line in killed.stdout)
        while not (jobs := running_jobs(killed)):
            time.sleep(0.01)
        (orphan,) = jobs
        orphan.suspend()
        killed.kill()
    project.configure(fit={"iterations": 10})
    # The next run deletes this log.
    with (project.results / "logs/fit/3mm/r01.log").open(encoding="utf-8") as log:
        assert project.snakemake(f"results/{target}").status == 0
        orphan.resume()
        orphan.wait()
        assert "was killed, and process" in log.read()
    assert (project.results / target).read_bytes() == (undisturbed.results / target).read_bytes()


@pytest.mark.workflow
def test_ctrl_c_ends_a_run_without_a_traceback_of_any_job(new, tmp_path):
    project = new.copy(tmp_path / "project")
    with project.start(*TABLES, cores=2) as process:
        lines = []
        for line in process.stdout:
            lines.append(line)
            # A job imports its modules right after this line.
            if line.startswith("2 of "):
                os.killpg(process.pid, signal.SIGINT)
        status = process.wait()
    assert status != 0
    # Snakemake itself may be interrupted where Python can only print that.
    assert not re.search(r'File ".*workflow/scripts', "".join(lines))
    assert project.snakemake(*TABLES).status == 0


@pytest.mark.workflow
def test_a_dry_run_is_possible_beside_a_run(new, tmp_path):
    project = new.copy(tmp_path / "project")
    with hold_run_lock(project.folder / ".snakemake/run.lock"):
        assert project.snakemake("-n").status == 0


def test_the_lock_ends_with_the_process_however_it_ends(tmp_path):
    lock = tmp_path / "run.lock"
    code = "import pathlib, time; from capsule.engine.locks import hold_run_lock"
    code += f"; kept = hold_run_lock(pathlib.Path({str(lock)!r}))"
    code += "; print('held', flush=True); time.sleep(60)"
    environment = {**os.environ, "PYTHONPATH": str(Path(capsule.__file__).parents[1])}
    with subprocess.Popen(
        [sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True
    ) as holder:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(CapsuleError, match=f"process {holder.pid} on"):
            hold_run_lock(lock)
        holder.kill()
    hold_run_lock(lock).close()


@contextlib.contextmanager
def small_disk(folder: Path, size: str):
    """Mount a disk of the given size at a folder."""
    folder.mkdir(exist_ok=True)
    command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    if os.name != "posix" or os.geteuid() != 0 or not shutil.which("mount"):
        pytest.skip("a small disk can be mounted by the administrator of Linux only")
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"mounting a small disk is not allowed here: {done.stderr.strip()}")
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def enlarge(folder: Path) -> None:
    """Enlarge the small disk."""
    subprocess.run(["mount", "-o", "remount,size=50m", str(folder)], check=True)


@pytest.mark.workflow
def test_a_full_disk_is_named_and_the_run_goes_on_when_there_is_room(new, tmp_path):
    plain = new.copy(tmp_path / "plain")
    # Wide matrices: with the usual ones, the logs would fill so small a disk first.
    plain.configure(preprocessing={"length": 15_000})
    project = plain.copy(tmp_path / "project")
    assert plain.snakemake(*TABLES).status == 0
    with small_disk(project.results, "1700k"):
        run = project.snakemake(*TABLES)
        assert run.status != 0
        assert re.search(
            r"error: results/[\w/.-]+: No space left on device; free some space and run again",
            run.output,
        )
        assert "run the same command again: finished results are kept" in run.output
        expected = plain.result_bytes()
        assert half_written(project, expected) == []
        (log,) = (project.folder / ".snakemake/log").glob("*.log")
        done_before = log.read_text(encoding="utf-8").count("Finished jobid")
        assert done_before
        enlarge(project.results)
        rest = project.snakemake(*TABLES)
        assert rest.status == 0, rest.output
        assert project.result_bytes() == expected
        # A job a recording, a nodule and a folder, two lists, and templates, evaluate and detect.
        assert rest.jobs.total() == len(RECORDINGS) + 2 + 3 + 2 + 3 - done_before


@pytest.mark.workflow
def test_on_a_disk_that_is_full_from_the_start_nothing_is_started(new, tmp_path):
    project = new.copy(tmp_path / "project")
    with small_disk(project.results, "900k"):
        run = project.snakemake()
        assert run.status != 0
        assert not run.jobs
        assert "no space left on device, nothing was started" in run.output
        assert "MB are free. Free some space" in run.output
        enlarge(project.results)
        assert project.snakemake("results/checks/3mm/r01.json").status == 0
