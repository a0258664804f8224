"""A job that is a fork of a preloaded process does what one does that Python starts anew."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from edges.preloaded_jobs import PreloadedJobs

from support.marks import needs_forks

pytestmark = [pytest.mark.slow(0.5), needs_forks]

SCRIPTS_FOLDER = Path(__file__).parents[2] / "workflow" / "scripts"
SAYS_ALL = """
import json, os, sys
print(json.dumps([sys.argv, sys.path[0], os.getcwd(), os.environ["OF_THIS_JOB"], __name__]))
print("a warning", file=sys.stderr)
"""
SCRIPTS = {
    "says all": SAYS_ALL,
    "a status": "raise SystemExit(3)",
    "a reason": "raise SystemExit('no such file')",
    "an error": "1 / 0",
    "at the end": "import atexit; atexit.register(print, 'the end')",
}


def preload(*modules):
    return PreloadedJobs(modules, SCRIPTS_FOLDER, os.environ)


@pytest.fixture
def preloaded():
    jobs = preload("json")
    yield jobs
    jobs.close()


def called(python, script, *arguments):
    """Run a script and wait for its end."""
    return subprocess.run(
        [python, str(script), *map(str, arguments)],
        cwd=script.parent,
        env=os.environ | {"OF_THIS_JOB": "yes"},
        capture_output=True,
        text=True,
        check=False,
    )


def write_script(folder, text):
    path = folder / "script.py"
    path.write_text(text, encoding="utf-8")
    return path


def wait_until(condition):
    ends = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < ends
        time.sleep(0.01)


@pytest.mark.parametrize("what", SCRIPTS)
def test_streams_status_and_surroundings_are_the_same(preloaded, tmp_path, what):
    script = write_script(tmp_path, SCRIPTS[what])
    forked = called(preloaded.folder / "python", script, "--name", "3mm/r01")
    new = called(sys.executable, script, "--name", "3mm/r01")
    assert (forked.returncode, forked.stdout) == (new.returncode, new.stdout)
    # A traceback begins with the lines of who runs the script.
    assert forked.stderr.splitlines()[-1:] == new.stderr.splitlines()[-1:]


def test_a_job_begins_with_the_modules_that_are_loaded_meanwhile(tmp_path):
    jobs = preload("json", "wave", "csv")
    script = write_script(tmp_path, "import sys; print({'wave', 'csv'} <= sys.modules.keys())")
    try:
        wait_until(lambda: called(jobs.folder / "python", script).stdout == "True\n")
    finally:
        jobs.close()
    assert called(sys.executable, script).stdout == "False\n"


def test_what_is_no_script_goes_to_python(preloaded):
    ended = subprocess.run(
        [preloaded.folder / "python", "-c", "print(6 * 7)"], capture_output=True, check=True
    )
    assert ended.stdout.split() == [b"42"]


def test_who_kills_what_was_called_kills_the_job(preloaded, tmp_path):
    script = write_script(
        tmp_path,
        "import pathlib, sys, time\n"
        "pathlib.Path(sys.argv[1]).touch()\n"
        "time.sleep(0.5)\n"
        "pathlib.Path(sys.argv[2]).touch()\n",
    )
    begun, ended = tmp_path / "begun", tmp_path / "ended"
    caller = subprocess.Popen([preloaded.folder / "python", script, begun, ended])
    wait_until(begun.exists)
    caller.kill()
    caller.wait()
    time.sleep(1)
    assert not ended.exists()


def test_a_job_that_is_killed_says_so(preloaded, tmp_path):
    script = write_script(tmp_path, "import os; os.kill(os.getpid(), 9)")
    ended = called(preloaded.folder / "python", script)
    assert ended.returncode == 1
    assert ended.stderr == (
        "error: the process of this job was killed, perhaps because memory ran out\n"
    )


def test_without_the_process_python_itself_runs_the_script(tmp_path):
    script = write_script(tmp_path, SAYS_ALL)
    jobs = preload("json")
    program = (jobs.folder / "python").read_text(encoding="utf-8")
    jobs.close()
    assert not jobs.folder.exists()
    alone = tmp_path / "python"
    alone.write_text(program, encoding="utf-8")
    alone.chmod(0o700)
    assert json.loads(called(alone, script).stdout) == json.loads(
        called(sys.executable, script).stdout
    )


def test_the_process_ends_with_its_starter_and_leaves_no_folder(tmp_path):
    starter = write_script(
        tmp_path,
        f"import os, sys, time; sys.path.insert(0, {str(SCRIPTS_FOLDER)!r})\n"
        "from edges.preloaded_jobs import PreloadedJobs\n"
        "jobs = PreloadedJobs(['json'], sys.path[0], os.environ)\n"
        "print(jobs.folder, flush=True)\n"
        "time.sleep(60)\n",
    )
    with subprocess.Popen([sys.executable, starter], stdout=subprocess.PIPE, text=True) as process:
        folder = Path(process.stdout.readline().strip())
        assert (folder / "python").exists()
        process.send_signal(signal.SIGKILL)
        process.wait()
    wait_until(lambda: not folder.exists())
