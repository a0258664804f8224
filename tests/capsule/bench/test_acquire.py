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
from hypothesis import given, settings
from hypothesis import strategies as st

from capsule.bench import (
    bench_errors,
    identification,
    line,
    record_command,
    recorder,
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
from capsule.errors import CapsuleError, WrongOptionError
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


def test_faults_end_the_program_plainly(monkeypatch, capsys):
    def fail(arguments):
        raise bench_errors.DiskFullError("the disk is full")

    monkeypatch.setattr(recorder, "record", fail)
    monkeypatch.setattr(record_command.terminal, "install", lambda: None)
    with pytest.raises(SystemExit) as ended:
        cli.main(["record", "--size", "3"])
    assert ended.value.code == 9
    assert capsys.readouterr().err == "error: the disk is full\n"


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("", "exactly one of --size MM, --unlabelled and --recover"),
        ("--size 3 --unlabelled", "exactly one of --size MM, --unlabelled and --recover"),
        ("--size three", "not a size in mm"),
        ("--size -1", "not a size in mm"),
        ("--size nan", "not a size in mm"),
        ("--size 3 --duration 0", "not a number above 0"),
        ("--size 3 --name ../r01", "not allowed as a name"),
        ("--size 3 --name .r01", "not allowed as a name"),
        ("--size 3 --name r01.csv", "leave out .csv"),
        ("--size 3 --direction up", "invalid choice"),
        ("--size 2.54321", "would ignore the folder 2.54321mm/; give at most four digits"),
        ("--size 12.34567", "would ignore the folder 12.3457mm/"),
        ("--size 99.99999", "too many digits"),
        ("--size 0.0000001", "too many digits"),
        ("--size=-0", "not a size in mm"),
        ("--size 3 --name=--", "argument --name: '--' is not a value"),
        ("--size 1_0", "not a size in mm"),
        ("--size 1e1", "not a size in mm"),
        ("--size \N{ARABIC-INDIC DIGIT THREE}", "not a size in mm"),
        ("--size 3 --name r" + "1" * 96, "at most 96"),
        ("--size 3 --name r" + "x" * 20, "twenty times or more; Snakemake"),
        ("--size 3 --name r" + "ab" * 20, "twenty times or more; Snakemake"),
        ("--size 3 --site \udcff", "printable characters (UTF-8)"),
        ("--size 3 --session \x1b[2J", "printable characters (UTF-8)"),
        ("--size 3 --site " + "x" * 101, "1 to 100"),
    ],
)
def test_wrong_options_are_explained(words, complaint, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["record", *words.split()])
    assert ended.value.code == 2
    assert complaint in capsys.readouterr().err


@pytest.mark.parametrize("site", ["", " ", "\N{IDEOGRAPHIC SPACE}"])
def test_an_empty_site_is_refused(site, capsys):
    with pytest.raises(SystemExit):
        options_of(["--size", "3", "--site", site])
    assert "1 to 100" in capsys.readouterr().err


@settings(deadline=None)  # a busy machine is no fault
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


def test_options():
    assert options_of(["--size", "3"]).size == "3mm"
    assert options_of(["--size", "2.50"]).size == "2.5mm"
    assert options_of(["--recover"]).recover == "all"
    chosen = options_of(["--unlabelled", "--name", "r-07", "--detect"])
    assert (chosen.name, chosen.detect, chosen.drive, chosen.speed) == ("r-07", True, None, 25.0)


@pytest.mark.parametrize(
    ("fault", "kind", "word"),
    [
        (serial.SerialException(errno.ENOENT, "could not open"), BoardNotFoundError, "no port"),
        (serial.SerialException(errno.EACCES, "could not open"), NoPermissionError, "dialout"),
        (serial.SerialException(errno.EBUSY, "could not open"), PortBusyError, "in use"),
        (serial.SerialException(errno.EAGAIN, "not exclusively lock"), PortBusyError, "in use"),
        (serial.SerialException("FileNotFoundError(2, ...)"), BoardNotFoundError, "no port"),
        (serial.SerialException("something else"), AcquisitionError, "something else"),
    ],
)
def test_why_a_port_cannot_be_opened(fault, kind, word):
    reason = line.explain_open_fault("COM5", fault)
    assert type(reason) is kind
    assert "COM5" in str(reason)
    assert word in str(reason)


def test_on_windows_denied_means_in_use(monkeypatch):
    monkeypatch.setattr(line.os, "name", "nt")
    fault = serial.SerialException("could not open port 'COM5': PermissionError(13, 'denied')")
    assert type(line.explain_open_fault("COM5", fault)) is PortBusyError


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
    assert identification.fault_of_logger(identity) == complaint
    assert identification.fault_of_logger(Identity("logger", ENTRIES)) == ""
    talking = SimpleNamespace(
        port="A",
        bytes_read=1,
        first_bytes=b"",
        receive=lambda timeout_s: [line.Arrival(identity, 0.0)],
        send=lambda payload: None,
    )
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


def plugged(device, serial_number, location=None, vid=0x2341):
    return SimpleNamespace(
        device=device, vid=vid, pid=0x42, serial_number=serial_number, location=location
    )


def test_a_board_is_known_again_under_another_name():
    mega, other = plugged("ttyACM0", "85"), plugged("ttyACM1", "17")
    port = UsbPort("ttyACM0", [mega, other])
    assert port.current_name([plugged("ttyACM0", "85"), other]) == "ttyACM0"
    assert port.current_name([other]) == "ttyACM0"  # not there: wait for it
    assert port.current_name([plugged("ttyACM2", "85"), other]) == "ttyACM2"


def test_boards_that_look_the_same_are_not_mixed_up():
    # Clones carry no serial number: only the name tells them apart.
    first, second = plugged("ttyUSB0", None), plugged("ttyUSB1", None)
    port = UsbPort("ttyUSB0", [first, second])
    assert port.current_name([first, second]) == "ttyUSB0"
    assert UsbPort("socket://there:1", [first]).current_name([first]) == "socket://there:1"


@pytest.mark.parametrize("serial_number", [None, "1"], ids=["no number", "the same number"])
def test_an_unplugged_clone_does_not_take_the_port_of_the_other(serial_number):
    first = plugged("ttyUSB0", serial_number, "1-1.2")
    second = plugged("ttyUSB1", serial_number, "1-1.3")
    port = UsbPort("ttyUSB0", [first, second])
    assert port.current_name([second]) == "ttyUSB0"
    assert port.current_name([first, second]) == "ttyUSB0"
    # The socket tells it again, under whatever name.
    assert port.current_name([plugged("ttyUSB2", serial_number, "1-1.2"), second]) == "ttyUSB2"


def test_a_broken_configuration_is_explained(tmp_path):
    config = tmp_path / "config.yaml"
    config.write_text("recording: [")
    chosen = options_of(["--recover", "--raw", str(tmp_path), "--config", str(config)])
    with pytest.raises(CapsuleError, match=r"config\.yaml, line 1"):
        recorder.recover(chosen)
    config.write_text("recording: {sensors: 4}")
    with pytest.raises(CapsuleError, match=r"config\.yaml: evaluation"):
        recorder.recover(chosen)
