"""A job that is a fork of a preloaded process does what one does that Python starts anew."""

import os
import subprocess
import sys
import time

import pytest

from support.preloaded_jobs import PreloadedJobs

pytestmark = [
    pytest.mark.slow(0.5),
    pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks jobs in tests"),
]

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


@pytest.fixture(scope="module")
def preloaded():
    jobs = PreloadedJobs(os.environ)
    yield jobs
    jobs.close()


@pytest.mark.parametrize("what", SCRIPTS)
def test_streams_status_and_surroundings_are_the_same(preloaded, tmp_path, what):
    script = tmp_path / "script.py"
    script.write_text(SCRIPTS[what], encoding="utf-8")

    def call(python):
        command = [python, str(script), "--name", "3mm/r01"]
        environment = os.environ | {"OF_THIS_JOB": "yes"}
        return subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )

    forked, new = call(preloaded.python), call(sys.executable)
    assert (forked.returncode, forked.stdout) == (new.returncode, new.stdout)
    # A traceback begins with the lines of who runs the script.
    assert forked.stderr.splitlines()[-1:] == new.stderr.splitlines()[-1:]


def test_who_kills_what_was_called_kills_the_job(preloaded, tmp_path):
    script, begun, ended = (tmp_path / name for name in ("script.py", "begun", "ended"))
    script.write_text(
        "import pathlib, sys, time\n"
        "pathlib.Path(sys.argv[1]).touch()\n"
        "time.sleep(0.5)\n"
        "pathlib.Path(sys.argv[2]).touch()\n",
        encoding="utf-8",
    )
    called = subprocess.Popen([preloaded.python, script, begun, ended])
    while not begun.exists():
        time.sleep(0.01)
    called.kill()
    called.wait()
    time.sleep(1)
    assert not ended.exists()
