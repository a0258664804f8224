"""Ports and the boards behind them: found, identified, closed, and opened again."""

import errno
import itertools
import os
from types import SimpleNamespace
from typing import ClassVar

import pytest
import serial

from capsule.bench import board, line, recorder
from capsule.bench.bench_errors import (
    AcquisitionError,
    BoardNotFoundError,
    NoAnswerError,
    NoPermissionError,
    PortBusyError,
    WrongBaudError,
    WrongBoardError,
)
from capsule.bench.board import Board
from capsule.bench.line import Line, UsbPort
from capsule.bench.protocol import Damaged
from support.bench.scripted import FakeLine, board_on, identity_of
from support.command import parsers
from support.marks import needs_terminals


@pytest.mark.parametrize(
    ("fault", "kind", "word"),
    [
        (serial.SerialException(errno.ENOENT, "could not open"), BoardNotFoundError, "no port"),
        (serial.SerialException(errno.EACCES, "could not open"), NoPermissionError, "dialout"),
        (serial.SerialException(errno.EBUSY, "could not open"), PortBusyError, "in use"),
        (serial.SerialException(errno.EAGAIN, "not exclusively lock"), PortBusyError, "in use"),
        (serial.SerialException("FileNotFoundError(2, ...)"), BoardNotFoundError, "no port"),
        (serial.SerialException("something else"), AcquisitionError, "something else"),
        (serial.SerialException("PermissionError(13, 'denied')"), PortBusyError, "in use"),
    ],
)
def test_why_a_port_cannot_be_opened(fault, kind, word, monkeypatch):
    if "PermissionError" in str(fault):  # where only pyserial's text tells the kind of fault
        monkeypatch.setattr(line.os, "name", "nt")
    reason = line.explain_open_fault("COM5", fault)
    assert type(reason) is kind
    assert "COM5" in str(reason)
    assert word in str(reason)


@pytest.mark.parametrize(
    ("device", "key", "value", "complaint"),
    [
        ("fold", "protocol", "2", "protocol=2"),
        ("logger", "firmware", None, "no firmware"),
        ("logger", "adc_bits", None, "no adc_bits"),
        ("logger", "adc_bits", "9999", "adc_bits=9999"),
        ("logger", "rate_hz", "0", "rate_hz=0"),
        ("logger", "channels", "4.0", "channels=4.0"),
        ("peristalsis", "wavelength_mm", None, "no wavelength_mm"),
    ],
)
def test_a_board_that_does_not_say_what_it_is_is_refused(
    monkeypatch, device, key, value, complaint
):
    talking = FakeLine("A")
    talking.frames = [identity_of(device, **{key: value})]
    monkeypatch.setattr(board, "Line", lambda *_: talking)
    with pytest.raises(WrongBoardError, match=f"{device} at A reports {complaint}; upload"):
        Board("A", 115200, device, print)
    assert talking.closed


MEGA, CH340 = (0x2341, 0x42), (0x1A86, 0x7523)


def usb_port(device, serial_number=None, location=None, ids=MEGA):
    vid, pid = ids
    told = {"product": None, "description": f"a {device}"}
    return SimpleNamespace(
        device=device, vid=vid, pid=pid, serial_number=serial_number, location=location, **told
    )


@pytest.fixture
def clock(monkeypatch):
    """Return a clock that advances as the program sleeps."""
    now = SimpleNamespace(s=100.0)

    def sleep(seconds):
        now.s += seconds

    monkeypatch.setattr(board, "time", SimpleNamespace(monotonic=lambda: now.s, sleep=sleep))
    return now


class Port(FakeLine):
    """A port with a device that says something by itself, or answers questions."""

    opened: ClassVar[dict[str, "Port"]] = {}
    devices: ClassVar[dict[str, object]] = {}
    clock: ClassVar[SimpleNamespace]

    def __init__(self, port, baud):
        super().__init__(port, baud)
        self.says, self.opened_s, self.asked_s = self.devices[port], self.clock.s, []
        if isinstance(self.says, AcquisitionError):
            raise self.says
        self.opened[port] = self

    def receive(self, timeout_s):
        """Return an identity after the opening, or only to a question."""
        if isinstance(self.says, bytes):
            self.first_bytes = self.says
            return []
        kind, at_once = self.says
        self.frames = [identity_of(kind)] if at_once or self.asked_s else []
        return super().receive(timeout_s)

    def send(self, payload):
        """Note when something was written."""
        self.asked_s.append(self.clock.s - self.opened_s)


@pytest.fixture
def devices(monkeypatch, clock):
    """Return a function that plugs in devices by port, and returns the ports as they are opened."""

    def plug(*ports, **behind):
        monkeypatch.setattr(board.list_ports, "comports", lambda: ports)
        for name, value in {"opened": {}, "devices": behind, "clock": clock}.items():
            monkeypatch.setattr(Port, name, value, raising=False)
        monkeypatch.setattr(board, "Line", Port)
        return Port.opened

    return plug


def find(skip=()):
    return board.connect(None, 115200, "logger", print, skip)


def test_the_board_is_found_among_others_without_a_question(devices):
    ports = [usb_port("C"), usb_port("B"), usb_port("A", ids=(None, None)), usb_port("D")]
    opened = devices(*ports, B=("logger", True), C=("peristalsis", True))
    found = find(skip=["D"])
    assert found.port == "B"
    assert sorted(opened) == ["B", "C"]  # neither the built-in port nor the one to be left alone
    assert not any(port.asked_s for port in opened.values())
    assert opened["C"].closed


def test_a_lab_pump_is_not_even_opened_and_the_user_is_told_what_to_name(devices):
    opened = devices(usb_port("B"), usb_port("ttyUSB0", ids=CH340), B=("peristalsis", True))
    with pytest.raises(BoardNotFoundError) as reason:
        find()
    assert list(opened) == ["B"]
    assert "is the peristalsis board" in str(reason.value)
    assert "not opened" in str(reason.value) and "--port" in str(reason.value)
    assert "ttyUSB0 (a ttyUSB0, 1A86:7523)" in str(reason.value)


def test_the_search_listens_for_three_seconds_before_it_asks(devices):
    speaks = {"A": ("logger", False), "B": b"temperature: 21.5 degrees\r\n"}
    opened = devices(usb_port("A"), usb_port("B"), **speaks)
    found = find()
    assert found.port == "A"
    assert opened["A"].asked_s[0] >= 3.0
    # What sends other text than frames is no board of this bench.
    assert opened["B"].asked_s == []


# Kills: a wrong baud rate that is told as a port at which nothing answers.
def test_bytes_without_frames_are_a_wrong_baud_rate(devices):
    devices(A=bytes(range(128, 256)))
    with pytest.raises(WrongBaudError, match=r"wrong baud rate \(--baud is 57600, .* 115200"):
        Board("A", 57600, "logger", print)


def test_two_boards_are_not_guessed_between(devices):
    ports = usb_port("A"), usb_port("B")
    opened = devices(*ports, A=("logger", True), B=("logger", True))
    with pytest.raises(
        BoardNotFoundError, match=r"found 2 boards of the kind logger: A, B; .*--port"
    ):
        find()
    assert all(port.closed for port in opened.values())


def test_no_board_says_what_each_port_answered(devices):
    devices(usb_port("A"), usb_port("B"), A=b"", B=PortBusyError("B is in use"))
    with pytest.raises(BoardNotFoundError) as reason:
        find()
    assert "nothing answers at A" in str(reason.value)
    assert "B is in use" in str(reason.value)
    devices()
    with pytest.raises(BoardNotFoundError, match="plug it in"):
        find()


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


def test_a_board_that_is_unplugged_before_it_answers_leaves_no_open_port(monkeypatch):
    lost = FakeLine("lost", lost=True)
    monkeypatch.setattr(board, "Line", lambda *_: lost)
    with pytest.raises(NoAnswerError, match="the board at lost was disconnected before it"):
        Board("lost", 115200, "logger", print)
    assert lost.closed


def test_ctrl_c_while_a_board_says_nothing_leaves_no_open_port(monkeypatch):
    def pressed(_):
        raise KeyboardInterrupt

    silent = FakeLine("silent")
    monkeypatch.setattr(board, "Line", lambda *_: silent)
    monkeypatch.setattr(board.time, "sleep", pressed)
    with pytest.raises(KeyboardInterrupt):
        Board("silent", 115200, "logger", print)
    assert silent.closed


def test_a_wave_whose_board_is_unplugged_at_its_settings_leaves_no_open_port(monkeypatch, tmp_path):
    lost = FakeLine("lost")
    connected = board_on(lost)
    lost.lost = True
    monkeypatch.setattr(recorder, "Board", lambda *_: connected)
    words = f"--size 3 --drive lost --raw {tmp_path} --logs {tmp_path}"
    options = parsers()["record"].parse_args(words.split())
    with pytest.raises(AcquisitionError, match="the peristalsis board at lost was disconnected"):
        recorder.record(options)
    assert lost.closed


# Kills: samples lost that came before the identity; the begin of a frame that neither log nor count
# has, since a command met the lost line.
def test_what_came_before_an_identity_or_a_loss_is_kept(clock):
    line = FakeLine("A")
    line.frames = ["D,1,100,1,2,3,4,0"]
    away = board_on(line, "logger")
    assert [arrival.event.sequence for arrival in away.read()] == [1]
    line.lost, line.rest = True, b"$D,12,1200,5"
    away.send("identify")
    assert [arrival.event for arrival in away.read()] == [Damaged(line.rest, "cut off")]
    assert list(away.read()) == []


def test_a_board_that_does_not_identify_itself_is_reopened_every_10_s_at_most(monkeypatch, clock):
    opened_s = []

    def silent(port, baud):
        opened_s.append(clock.s)
        return FakeLine(port, baud)

    waiting = board_on(FakeLine("A"), "fold")
    waiting.close()
    monkeypatch.setattr(board, "Line", silent)
    while clock.s < 160:
        before_s = clock.s
        assert list(waiting.read(0.05)) == []
        assert clock.s - before_s < 0.1  # no step takes long: display and Ctrl-C go on
    gaps_s = [after - before for before, after in itertools.pairwise(opened_s)]
    assert len(gaps_s) >= 3
    assert min(gaps_s) >= 10
    assert opened_s[0] < 101  # a board that had said what it is can be back at once


# Kills: an error of pyserial whose words are no longer those that the program knows.
@needs_terminals
def test_a_port_that_another_program_has_is_in_use():
    ours, theirs = os.openpty()
    name = os.ttyname(theirs)
    with (
        serial.Serial(name, exclusive=True),
        pytest.raises(PortBusyError, match=f"{name} is in use by another program"),
    ):
        Line(name)
    os.close(ours)
    os.close(theirs)
    with pytest.raises(BoardNotFoundError, match="there is no port /dev/nothing"):
        Line("/dev/nothing")
