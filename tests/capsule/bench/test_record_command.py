"""The command lines of capsule record and capsule survey, and the exit statuses of its faults."""

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from capsule.bench.bench_errors import AcquisitionError
from capsule.bench.record_command import exit_statuses
from capsule.commands import cli
from support.project import ROOT


def test_every_fault_has_a_status_of_its_own():
    page = (Path(__file__).parents[3] / "docs/command.md").read_text(encoding="utf-8")
    statuses = [kind.status for kind in AcquisitionError.__subclasses__()]
    assert len({0, 1, 2, *statuses}) == len(statuses) + 3 >= 12
    assert all(f"\n| {status} | " in page for status in statuses)
    told = re.findall(r"^ +(\d+) ", exit_statuses("done", of_survey=True), re.MULTILINE)
    assert {0, 1, 2, *statuses} <= set(map(int, told))
    # What goes wrong on the way back can happen to a survey alone.
    for of_survey in (True, False):
        assert ("   13 " in exit_statuses("done", of_survey=of_survey)) == of_survey


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("record --name r01", "one of the arguments --size --unlabelled --recover is required"),
        ("record --size three", "not a size in mm"),
        ("record --size 3 --duration 0", "not a number above 0"),
        ("record --size 3 --name r01.csv", "leave out .csv"),
        ("record --size 3 --name=--", "argument --name: '--' is not a value"),
        ("record --size 3 --site \udcff", "printable characters (UTF-8)"),
        ("record --size 3 --setup " + "x" * 101, "1 to 100"),
        ("record --size 3 --site=\N{IDEOGRAPHIC SPACE}", "1 to 100"),
        ("record --unlabelled --stream-in a'b", "not allowed as a stream's name"),
        ("record --unlabelled --stream-in a --port /dev/x", "give one of the two"),
        ("record --unlabelled --stream-channels 1,2,3,4", "--stream-in NAME, which is not given"),
        ("record --unlabelled --stream-in a --stream-out a", "both name 'a'"),
        ("survey --out x", "give either --simulate, or the ports of the boards"),
        ("survey --drive p --out x", "needs --fold PORT"),
        ("survey --simulate", "--out FOLDER"),
        ("survey --simulate --out x --goto 1500", "the gut is 1000 mm long"),
        ("survey --simulate --out x --metres 50", "'50' is not a number from 0.2 to 10 m"),
        ("survey --simulate --out x --nodules 9", "'9' is not a number from 0.1 to 5 mm"),
    ],
)
def test_wrong_options_are_explained(words, complaint, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(words.split(" "))
    assert ended.value.code == 2
    assert complaint in capsys.readouterr().err


# The main thread hangs in a call that never returns, so Python runs no handler.
HANGS = """
import ctypes, os, signal
from capsule.bench.clock import StopRequest

stop, libc, mutex = StopRequest(), ctypes.CDLL(None), ctypes.create_string_buffer(256)
os.kill(os.getpid(), signal.SIGINT)
print(stop.reason, flush=True)
for _ in range(2):
    libc.pthread_mutex_lock(mutex)
"""


def test_a_second_ctrl_c_ends_a_program_that_hangs():
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    words = [sys.executable, "-c", HANGS]
    with subprocess.Popen(words, cwd=ROOT / "workflow/scripts", **pipes) as program:
        assert program.stdout.readline() == "Ctrl-C\n"
        program.send_signal(signal.SIGINT)
        assert "ended at once by a second Ctrl-C" in program.stderr.read()
    assert program.returncode == 130
