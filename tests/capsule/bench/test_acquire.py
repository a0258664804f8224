"""Parts of capsule record: its command line, ports and boards."""

import contextlib
import errno
import io
import time
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from capsule.bench import (
    bench_errors,
    identification,
    line,
    record_command,
    survey_command,
)
from capsule.bench.bench_errors import (
    AcquisitionError,
    BoardNotFoundError,
    NoPermissionError,
    PortBusyError,
    WrongBaudError,
    WrongBoardError,
)
from capsule.bench.line import UsbPort
from capsule.bench.protocol import Identity
from capsule.bench.record_command import options_of
from capsule.commands import cli
from capsule.errors import WrongOptionError
from capsule.recordings.names import Entry, classify, size_mm
from support.bench.scripted import ENTRIES


def test_every_fault_has_a_status_of_its_own():
    page = (Path(__file__).parents[3] / "docs/command.md").read_text(encoding="utf-8")
    # What goes wrong on the way back can happen to a survey alone.
    of_surveys = {bench_errors.CannotArriveError, bench_errors.SurveyFaultError}
    kinds = AcquisitionError.__subclasses__()
    statuses = [kind.status for kind in kinds]
    assert len(set(statuses)) == len(kinds) >= 9
    assert not {0, 1, 2} & set(statuses)
    for kind in kinds:
        command = survey_command if kind in of_surveys else record_command
        assert f" {kind.status} " in command.EXAMPLES
        assert f"\n| {kind.status} | " in page


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("--name r01", "exactly one of --size MM, --unlabelled and --recover"),
        ("--size 3 --unlabelled", "exactly one of --size MM, --unlabelled and --recover"),
        ("--size three", "not a size in mm"),
        ("--size 3 --duration 0", "not a number above 0"),
        ("--size 3 --name r01.csv", "leave out .csv"),
        ("--size 3 --name=--", "argument --name: '--' is not a value"),
        ("--size 3 --site \udcff", "printable characters (UTF-8)"),
        ("--size 3 --session \x1b[2J", "printable characters (UTF-8)"),
        ("--size 3 --setup " + "x" * 101, "1 to 100"),
        ("--size 3 --site=", "1 to 100"),
        ("--size 3 --site=\N{IDEOGRAPHIC SPACE}", "1 to 100"),
        ("--unlabelled --stream-in a'b", "not allowed as a stream's name"),
        ("--unlabelled --stream-in a --port /dev/x", "give one of the two"),
        ("--unlabelled --stream-channels 1,2,3,4", "--stream-in NAME, which is not given"),
        ("--unlabelled --stream-in a --stream-out a", "both name 'a'"),
    ],
)
def test_wrong_options_are_explained(words, complaint, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["record", *words.split(" ")])
    assert ended.value.code == 2
    assert complaint in capsys.readouterr().err


@given(st.decimals(0, 99, places=3), st.from_regex(r"[A-Za-z0-9_.+-]{1,12}", fullmatch=True))
def test_whatever_is_allowed_is_a_recording_for_the_workflow(size, name):
    words = ["--size", f"{size:f}", f"--name={name}"]
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            chosen = options_of(words)
    except (SystemExit, WrongOptionError):
        return
    entry = f"{chosen.size}/{chosen.name}"
    assert classify([Entry(f"{entry}.csv")]).recordings == (entry,)
    assert size_mm(entry) == float(size)


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
    ("key", "value", "complaint"),
    [
        ("adc_bits", None, "no adc_bits"),
        ("adc_bits", "9999", "adc_bits=9999"),
        ("rate_hz", "0", "rate_hz=0"),
        ("channels", "four", "channels=four"),
    ],
)
def test_a_logger_that_does_not_say_what_it_is_is_refused(key, value, complaint):
    entries = ENTRIES | {key: value}
    identity = Identity("logger", {name: text for name, text in entries.items() if text})
    talking = SimpleNamespace(port="A", receive=lambda timeout_s: [line.Arrival(identity, 0.0)])
    with pytest.raises(WrongBoardError, match=f"logger at A reports {complaint}; upload"):
        next(identification.identify(talking, "logger"))


MEGA, CH340 = (0x2341, 0x42), (0x1A86, 0x7523)


def usb_port(device, ids=MEGA):
    vid, pid = ids
    return SimpleNamespace(device=device, vid=vid, pid=pid, product=None, description=f"a {device}")


class Port:
    """A port with a device that says something by itself, and answers questions."""

    opened: ClassVar[dict[str, "Port"]] = {}
    devices: ClassVar[dict[str, object]] = {}

    def __init__(self, port, baud):
        self.port, self.baud, self.asked_s = port, baud, []
        self.says = self.devices[port]
        if isinstance(self.says, AcquisitionError):
            raise self.says
        self.opened_s = time.monotonic()
        self.bytes_read, self.first_bytes, self.closed = 0, b"", False
        self.opened[port] = self

    def receive(self, timeout_s):
        """Return an identity after the opening, or only to a question."""
        kind, at_once = self.says if isinstance(self.says, tuple) else ("", False)
        if isinstance(self.says, bytes):
            self.first_bytes, self.bytes_read = self.says, len(self.says)
        if kind and (at_once or self.asked_s):
            self.bytes_read = 100
            return [line.Arrival(Identity(kind, ENTRIES), 0.0)]
        return []

    def send(self, payload):
        """Note when something was written."""
        self.asked_s.append(time.monotonic() - self.opened_s)

    def put_back(self, arrivals):
        """Take what came beside the identity."""

    def close(self):
        """Note that it was closed."""
        self.closed = True


@pytest.fixture
def devices(monkeypatch):
    """Return a function that plugs in devices by port, and returns the ports as they are opened."""

    def plug(*ports, **behind):
        monkeypatch.setattr(identification.list_ports, "comports", lambda: ports)
        monkeypatch.setattr(Port, "opened", {})
        monkeypatch.setattr(Port, "devices", behind)
        monkeypatch.setattr(identification, "Line", Port)
        return Port.opened

    return plug


def find(skip=()):
    return identification.connect(None, 115200, "logger", skip)


def test_the_board_is_found_among_others_without_a_question(devices):
    ports = [usb_port("C"), usb_port("B"), usb_port("A", ids=(None, None)), usb_port("D")]
    opened = devices(*ports, B=("logger", True), C=("peristalsis", True))
    found, _ = find(skip=["D"])
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
    found, _ = find()
    assert found.port == "A"
    assert opened["A"].asked_s[0] >= 3.0
    # What sends other text than frames is no board of this bench.
    assert opened["B"].asked_s == []


# Kills: a wrong baud rate that is told as a port at which nothing answers.
def test_bytes_without_frames_are_a_wrong_baud_rate(devices):
    devices(A=bytes(range(128, 256)))
    with pytest.raises(WrongBaudError, match=r"wrong baud rate \(--baud is 57600, .* 115200"):
        identification.connect("A", 57600, "logger")


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


def plugged(device, serial_number, location=None):
    return SimpleNamespace(
        device=device, vid=0x2341, pid=0x42, serial_number=serial_number, location=location
    )


# Kills: a board known by its name alone; clones mixed up, which share a number or have none.
@pytest.mark.parametrize("number", ["85", None, "1"], ids=["its own", "none", "the same"])
def test_a_board_is_known_again_under_another_name(number):
    first = plugged("ttyACM0", number, "1-1.2")
    second = plugged("ttyACM1", "17" if number == "85" else number, "1-1.3")
    port = UsbPort("ttyACM0", [first, second])
    assert port.current_name([first, second]) == "ttyACM0"
    assert port.current_name([second]) == "ttyACM0"  # not there: wait for it
    # The number tells it again, or the socket that it is plugged into.
    assert port.current_name([plugged("ttyACM2", number, "1-1.2"), second]) == "ttyACM2"
    # Where the system does not tell the socket, the name is all that there is.
    first, second = plugged("ttyACM0", None), plugged("ttyACM1", None)
    assert UsbPort("ttyACM0", [first, second]).current_name([first, second]) == "ttyACM0"
    assert UsbPort("socket://there:1", [first]).current_name([first]) == "socket://there:1"
