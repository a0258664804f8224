"""The command lines of record and survey; ports and the boards behind them."""

import errno
import os
import re
import select
import signal
import subprocess
import sys
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
import serial

from capsule.bench import bench_errors, board, line, recorder
from capsule.bench.bench_errors import AcquisitionError, PortBusyError, WrongBoardError
from capsule.bench.board import Board
from capsule.bench.line import Line, UsbPort
from capsule.bench.protocol import Acknowledgement, Damaged, encode
from capsule.bench.record_command import exit_statuses
from capsule.commands import cli
from support.bench.scripted import FakeLine, board_on, identity_of
from support.command import parsers
from support.marks import needs_terminals
from support.project import ROOT


def test_why_a_port_cannot_be_opened(monkeypatch):
    for fault, kind, word in (
        (serial.SerialException(errno.EACCES, "denied"), bench_errors.NoPermissionError, "dialout"),
        (serial.SerialException("FileNotFoundError"), bench_errors.BoardNotFoundError, "no port"),
        (serial.SerialException("something else"), AcquisitionError, "something else"),
        (serial.SerialException("PermissionError(13, 'denied')"), PortBusyError, "in use"),
    ):
        if "PermissionError" in str(fault):  # where only pyserial's text tells the kind of fault
            monkeypatch.setattr(line.os, "name", "nt")
        reason = line.explain_open_fault("COM5", fault)
        assert type(reason) is kind
        assert "COM5" in str(reason) and word in str(reason)


# Kills: an error of pyserial whose words are no longer those that the program knows.
@needs_terminals
def test_a_port_that_another_program_has_is_in_use_and_one_that_disappears_is_lost():
    ours, theirs = os.openpty()
    name = os.ttyname(theirs)
    with serial.Serial(name, exclusive=True), pytest.raises(PortBusyError, match=f"{name} is in"):
        Line(name)
    opened = Line(name)
    os.close(theirs)
    told, arrived = encode("A,start") + b"$A", []
    os.write(ours, told)
    for _ in told:  # each call reads a byte at least
        arrived += opened.receive(5.0 if opened.first_bytes != told else 0.0)
    assert [arrival.event for arrival in arrived] == [Acknowledgement("start", "")]
    opened.send("stop")
    assert select.select([ours], [], [], 5.0)[0] and os.read(ours, 100) == encode("stop")
    os.close(ours)
    for act in (opened.receive, lambda: opened.send("stop")):
        with pytest.raises(bench_errors.LineLostError):
            act()
    assert [piece.content for piece in opened.close()] == [b"$A"]


def usb_port(device, serial_number=None, location=None, ids=(0x2341, 0x42)):
    told = {"vid": ids[0], "pid": ids[1], "serial_number": serial_number, "location": location}
    return SimpleNamespace(device=device, product=None, description=f"a {device}", **told)


# Kills: a board known by its name alone; clones mixed up, which share a number or have none.
@pytest.mark.parametrize("number", ["85", None, "1"], ids=["its own", "none", "the same"])
def test_a_board_is_known_again_under_another_name(monkeypatch, number):
    there = []
    monkeypatch.setattr(line.list_ports, "comports", lambda: there)
    second = usb_port("ttyACM1", "17" if number == "85" else number, "1-1.3")
    there += [usb_port("ttyACM0", number, "1-1.2"), second]
    port = UsbPort("ttyACM0")
    assert port.current_name() == "ttyACM0"
    there[:] = [second]
    assert port.current_name() == "ttyACM0"  # not there: wait for it
    # The number tells it again at any socket, or the socket that it is plugged into.
    there[:] = [usb_port("ttyACM2", number, "1-9" if number == "85" else "1-1.2"), second]
    assert port.current_name() == "ttyACM2"
    # Where the system does not tell the socket, the name is all that there is.
    there[:] = [usb_port("ttyACM0", None), usb_port("ttyACM1", None)]
    assert UsbPort("ttyACM0").current_name() == "ttyACM0"
    assert UsbPort("socket://there:1").current_name() == "socket://there:1"


@pytest.fixture
def clock(monkeypatch):
    """Return a clock that advances as the program sleeps."""
    now = SimpleNamespace(s=100.0)
    time = {"monotonic": lambda: now.s, "sleep": lambda s: vars(now).update(s=now.s + s)}
    monkeypatch.setattr(board, "time", SimpleNamespace(**time))
    return now


@pytest.fixture
def plug(monkeypatch, clock):
    """Return a function that plugs in devices, and returns the ports as they are opened."""

    def plug(*others, **behind):
        opened = {}

        def open_port(name, baud):
            if isinstance(behind[name], AcquisitionError):
                raise behind[name]
            is_board = isinstance(behind[name], str)
            frames, first = ([identity_of(behind[name])], b"") if is_board else ([], behind[name])
            opened[name] = FakeLine(name, baud, frames=frames, first_bytes=first)
            return opened[name]

        monkeypatch.setattr(board.list_ports, "comports", lambda: [*map(usb_port, behind), *others])
        monkeypatch.setattr(board, "Line", open_port)
        return opened

    return plug


def test_a_board_is_found_without_a_question_or_asked_after_three_seconds(plug, clock, monkeypatch):
    opened = plug(usb_port("A", ids=(None, None)), C="peristalsis", B="logger", D="logger")
    assert board.connect(None, 115200, "logger", print, skip=["D"]).port == "B"
    # Neither the built-in port nor the one to be left alone.
    told = {name: (port.closed, port.sent) for name, port in opened.items()}
    assert told == {"B": (False, []), "C": (True, [])}
    asked, begun_s = [], clock.s

    def answer(port, payload):
        asked.append((port.port, payload, clock.s >= begun_s + 3.0))
        port.frames.append(identity_of("logger"))

    monkeypatch.setattr(FakeLine, "send", answer)
    # What sends other text than frames is no board of this bench.
    plug(A=b"", B=b"temperature: 21.5 degrees\r\n")
    assert board.connect(None, 115200, "logger", print).port == "A"
    assert asked == [("A", "identify", True)]


# Kills: a search that opens a lab's pump, guesses between two boards, or leaves a port open.
@pytest.mark.parametrize(
    ("behind", "opened", "told"),
    [
        ({"B": "peristalsis"}, "B", "B is the peristalsis board.*not opened.*1A86:7523"),
        ({"A": "logger", "B": "logger"}, "AB", "2 boards of the kind logger: A, B; .*--port"),
        ({"A": b"", "B": PortBusyError("B is busy")}, "A", "nothing answers at A.*B is busy"),
        ({}, "", "plug it in"),
    ],
)
def test_a_search_without_one_board_says_what_each_port_answered(plug, behind, opened, told):
    ports = plug(usb_port("ttyUSB0", ids=(0x1A86, 0x7523)), **behind)
    with pytest.raises(bench_errors.BoardNotFoundError, match=f"(?s){told}"):
        board.connect(None, 115200, "logger", print)
    assert "".join(ports) == opened
    assert all(port.closed for port in ports.values())


@pytest.mark.parametrize(
    ("found", "kind", "said"),
    [
        ({"lost": True}, bench_errors.NoAnswerError, "at A was disconnected before it identified"),
        ({"receive": Mock(side_effect=KeyboardInterrupt)}, KeyboardInterrupt, ""),
        ({"first_bytes": bytes(range(128, 256))}, bench_errors.WrongBaudError, "--baud is 57600"),
        ({"first_bytes": b"1 2 3 4 5\r\n" * 3}, WrongBoardError, "another program"),
        ({"frames": ["D,1,100,1,2,3,4,0"]}, bench_errors.NoAnswerError, "answer 'identify'"),
        ({"frames": [identity_of("logger", protocol="2")]}, WrongBoardError, "reports protocol=2"),
        ({"frames": [identity_of("logger", adc_bits=None)]}, WrongBoardError, "no adc_bits"),
        ({"frames": [identity_of("logger", rate_hz="0")]}, WrongBoardError, "rate_hz=0"),
        ({"frames": [identity_of("logger", channels="4.0")]}, WrongBoardError, "channels=4.0"),
    ],
)
def test_a_port_without_its_board_is_refused_and_closed(monkeypatch, clock, found, kind, said):
    talking = FakeLine("A", 57600, **found)
    monkeypatch.setattr(board, "Line", lambda *_: talking)
    with pytest.raises(kind) as reason:
        Board("A", 57600, "logger", print)
    assert said in str(reason.value)
    assert talking.closed


def test_a_wave_whose_board_is_unplugged_at_its_settings_leaves_no_open_port(monkeypatch, tmp_path):
    connected = board_on(lost := FakeLine("lost"))
    lost.lost = True
    monkeypatch.setattr(recorder, "Board", lambda *_: connected)
    words = f"--size 3 --drive lost --raw {tmp_path} --logs {tmp_path}"
    with pytest.raises(AcquisitionError, match="the peristalsis board at lost was disconnected"):
        recorder.record(parsers()["record"].parse_args(words.split()))
    assert lost.closed


# Kills: samples lost that came before the identity; the begin of a frame that neither log nor count
# has, since a command met the lost line.
def test_what_came_before_an_identity_or_a_loss_is_kept(clock):
    line = FakeLine("A", frames=["D,1,100,1,2,3,4,0"])
    away = board_on(line, "logger")
    assert [arrival.event.sequence for arrival in away.read()] == [1]
    line.lost, line.rest = True, b"$D,12,1200,5"
    away.send("identify")
    assert [arrival.event for arrival in away.read()] == [Damaged(line.rest, "cut off")]
    assert list(away.read()) == []


def test_a_board_that_does_not_identify_itself_is_reopened_every_10_s_at_most(monkeypatch, clock):
    opened_s, waiting = [], board_on(FakeLine("A"), "fold")
    waiting.close()
    monkeypatch.setattr(board, "Line", lambda *of: opened_s.append(clock.s) or FakeLine(*of))
    while clock.s < 160:
        before_s = clock.s
        assert list(waiting.read(0.05)) == []
        assert clock.s - before_s < 0.1  # no step takes long: display and Ctrl-C go on
    assert len(opened_s) >= 4 and min(np.diff(opened_s)) >= 10
    assert opened_s[0] < 101  # a board that had said what it is can be back at once


def test_every_fault_has_a_status_of_its_own():
    page = (ROOT / "docs/command.md").read_text(encoding="utf-8")
    statuses = [kind.status for kind in AcquisitionError.__subclasses__()]
    assert len({0, 1, 2, *statuses}) == len(statuses) + 3 >= 12
    assert all(f"\n| {status} | " in page for status in statuses)
    told = re.findall(r"^ +(\d+) ", exit_statuses("done", of_survey=True), re.MULTILINE)
    assert {0, 1, 2, *statuses} <= set(map(int, told))


def test_wrong_options_are_explained(capsys):
    for words, complaint in (
        ("record --name r01", "one of the arguments --size --unlabelled --recover is required"),
        ("record --size three", "not a size in mm"),
        ("record --size 3 --name r01.csv", "leave out .csv"),
        ("record --size 3 --site \udcff", "printable characters (UTF-8)"),
        ("record --size 3 --setup " + "x" * 101, "1 to 100"),
        ("record --unlabelled --stream-in a'b", "not allowed as a stream's name"),
        ("record --unlabelled --stream-in a --port /dev/x", "give one of the two"),
        ("record --unlabelled --stream-channels 1,2,3,4", "--stream-in NAME, which is not given"),
        ("record --unlabelled --stream-in a --stream-out a", "both name 'a'"),
        ("survey --drive p --out x", "needs --fold PORT"),
        ("survey --simulate", "--out FOLDER"),
        ("survey --simulate --out x --goto 1500", "the gut is 1000 mm long"),
        ("survey --simulate --out x --nodules 9", "'9' is not a number from 0.1 to 5 mm"),
    ):
        with pytest.raises(SystemExit) as ended:
            cli.main(words.split(" "))
        assert ended.value.code == 2
        assert complaint in capsys.readouterr().err


# The main thread hangs in a call that never returns, so Python runs no handler.
HANGS = """
import ctypes, os, signal, threading
from capsule.bench.clock import StopRequest

stop, libc, mutex = StopRequest(), ctypes.CDLL(None), ctypes.create_string_buffer(256)
os.kill(os.getpid(), signal.SIGINT)
threading.enumerate()[-1].join(0.5)  # what ends at the first one, ends here
print(stop.reason, flush=True)
signal.alarm(30)  # ends it if nothing else does
for _ in range(2):
    libc.pthread_mutex_lock(mutex)
"""


def test_a_second_ctrl_c_ends_a_program_that_hangs():
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    scripts = ROOT / "workflow/scripts"
    with subprocess.Popen([sys.executable, "-c", HANGS], cwd=scripts, **pipes) as program:
        assert program.stdout.readline() == "Ctrl-C\n"
        program.send_signal(signal.SIGINT)
        assert "ended at once by a second Ctrl-C" in program.stderr.read()
    assert program.returncode == 130
