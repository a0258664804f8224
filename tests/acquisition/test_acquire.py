"""Parts of acquire.py: its command line, ports, boards and terminal display."""

import contextlib
import errno
import io
from pathlib import Path
from types import SimpleNamespace

import pytest
import serial
from hypothesis import given, settings
from hypothesis import strategies as st

import acquire
from acquisition import bench_errors, boards, line, options, survey_options
from acquisition.bench_errors import (
    AcquisitionError,
    BoardNotFoundError,
    NoAnswerError,
    NoPermissionError,
    PortBusyError,
    WrongBoardError,
)
from acquisition.protocol import Identity
from acquisition.terminal import Progress, Terminal
from acquisition.usb import UsbPort
from capsule.errors import CapsuleError
from capsule.naming import Entry, classify, size_mm
from support.bench.scripted import ENTRIES


def test_every_fault_has_a_status_of_its_own():
    docs = Path(__file__).parents[2] / "docs"
    # What goes wrong on the way back can happen to a survey alone.
    of_surveys = {bench_errors.CannotArriveError, bench_errors.SurveyFaultError}
    pages = {name: (docs / name).read_text(encoding="utf-8") for name in ("bench.md", "survey.md")}
    kinds = AcquisitionError.__subclasses__()
    statuses = [kind.status for kind in kinds]
    assert len(set(statuses)) == len(kinds) >= 9
    assert not {0, 1, 2} & set(statuses)
    for kind in kinds:
        page, command = (
            ("survey.md", survey_options) if kind in of_surveys else ("bench.md", options)
        )
        assert f" {kind.status} " in command.EXAMPLES
        assert f"\n| {kind.status} | " in pages[page]


def test_faults_end_the_program_plainly(monkeypatch, capsys):
    def fail(arguments):
        raise bench_errors.DiskFullError("the disk is full")

    monkeypatch.setattr(acquire.run, "record", fail)
    monkeypatch.setattr("sys.argv", ["acquire.py", "--size", "3"])
    with pytest.raises(SystemExit) as ended:
        acquire.main()
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
        options.parse(words.split())
    assert ended.value.code == 2
    assert complaint in capsys.readouterr().err


@pytest.mark.parametrize("site", ["", " ", "\N{IDEOGRAPHIC SPACE}"])
def test_an_empty_site_is_refused(site, capsys):
    with pytest.raises(SystemExit):
        options.parse(["--size", "3", "--site", site])
    assert "1 to 100" in capsys.readouterr().err


@settings(deadline=None)  # a busy machine is no fault
@given(st.decimals(0, 99, places=3), st.from_regex(r"[A-Za-z0-9_.+-]{1,12}", fullmatch=True))
def test_whatever_is_allowed_is_a_recording_for_the_workflow(size, name):
    words = ["--size", f"{size:f}", f"--name={name}"]
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            chosen = options.parse(words)
    except SystemExit:
        return
    entry = f"{chosen.size}/{chosen.name}"
    assert classify([Entry(f"{entry}.csv")]).recordings == (entry,)
    assert size_mm(entry) == float(size)


def test_options():
    assert options.parse(["--size", "3"]).size == "3mm"
    assert options.parse(["--size", "2.50"]).size == "2.5mm"
    assert options.parse(["--recover"]).recover == "all"
    chosen = options.parse(["--unlabelled", "--name", "r-07", "--detect"])
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
    assert boards.fault_of_logger(identity) == complaint
    assert boards.fault_of_logger(Identity("logger", ENTRIES)) == ""
    talking = SimpleNamespace(
        port="A",
        bytes_read=1,
        first_bytes=b"",
        receive=lambda: [line.Arrival(identity, 0.0)],
        send=lambda payload: None,
    )
    with pytest.raises(WrongBoardError, match=f"logger at A reports {complaint}; upload"):
        boards.identify(talking, "logger")


def usb_port(device, vid=0x2341):
    return SimpleNamespace(device=device, vid=vid)


@pytest.fixture
def bench_of_boards(monkeypatch):
    """Return a function that pretends to plug in boards and returns the list of opened ports."""
    opened = []

    def plug(**behind):
        def connect(port, baud, wanted):
            opened.append(port)
            answer = behind[port]
            if isinstance(answer, AcquisitionError):
                raise answer
            return SimpleNamespace(port=port, close=lambda: None), Identity(answer, {})

        monkeypatch.setattr(boards, "connect", connect)
        return opened

    return plug


def test_the_board_is_found_among_others(bench_of_boards):
    opened = bench_of_boards(B="logger", C=WrongBoardError("C is the peristalsis board"))
    ports = [usb_port("C"), usb_port("B"), usb_port("A", vid=None), usb_port("D")]
    found, _ = boards.find("logger", 115200, lambda text: None, ports, skip=["D"])
    assert found.port == "B"
    assert opened == ["B", "C"]  # neither the built-in port nor the one to be left alone


def test_two_boards_are_not_guessed_between(bench_of_boards):
    bench_of_boards(A="logger", B="logger")
    with pytest.raises(
        BoardNotFoundError, match=r"found 2 boards of the kind logger: A, B; .*--port"
    ):
        boards.find("logger", 115200, lambda text: None, [usb_port("A"), usb_port("B")])


def test_no_board_says_what_each_port_answered(bench_of_boards):
    bench_of_boards(A=NoAnswerError("A is silent"), B=PortBusyError("B is in use"))
    with pytest.raises(BoardNotFoundError) as reason:
        boards.find("logger", 115200, lambda text: None, [usb_port("A"), usb_port("B")])
    assert "A is silent" in str(reason.value)
    assert "B is in use" in str(reason.value)
    with pytest.raises(BoardNotFoundError, match="plug it in"):
        boards.find("logger", 115200, lambda text: None, [])


def plugged(device, serial_number, vid=0x2341):
    return SimpleNamespace(device=device, vid=vid, pid=0x42, serial_number=serial_number)


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


def test_a_broken_configuration_is_explained(tmp_path):
    config = tmp_path / "config.yaml"
    config.write_text("recording: [")
    chosen = options.parse(["--recover", "--raw", str(tmp_path), "--config", str(config)])
    with pytest.raises(CapsuleError, match=r"config\.yaml, line 1"):
        acquire.run.recover(chosen)
    config.write_text("recording: {sensors: 4}")
    with pytest.raises(CapsuleError, match=r"config\.yaml: evaluation"):
        acquire.run.recover(chosen)


class Screen(io.StringIO):
    """A terminal that can redraw."""

    encoding = "utf-8"

    def isatty(self):
        """Return True, as a terminal does."""
        return True


@pytest.fixture
def progress():
    shown = Progress(0.1, places=754, missing=12, gaps=2, damaged=3, rate_hz=9.98)
    shown.recent.extend([(10, 500, 512, 1000), None, (12, 510, 512, 20)])
    return shown


def test_summary(progress):
    progress.wave = "wave 80 mm"
    assert progress.summary() == (
        "01:15.4 | 754 samples | 10.0 Hz | 2 gaps (12 samples missing) | 3 damaged frames | "
        "wave 80 mm"
    )


def test_the_terminal_shows_the_four_sensors(progress):
    screen = Screen()
    terminal = Terminal(screen, 1023)
    terminal.show(progress)
    lines = screen.getvalue().splitlines()
    assert lines[0].startswith("01:15.4 | 754 samples")
    assert [text.split()[1:3] for text in lines[1:]] == [
        ["1", "12"],
        ["2", "510"],
        ["3", "512"],
        ["4", "20"],
    ]
    assert lines[4].endswith("█ ▁")
    terminal.show(progress)  # too soon for an eye
    assert len(screen.getvalue().splitlines()) == 5
    terminal.note("the board was unplugged")
    assert screen.getvalue().endswith("\x1b[5A\x1b[Jthe board was unplugged\n")


def test_the_terminal_shows_the_verdicts_below_the_sensors(progress):
    progress.verdicts = ["if the run ended now:", "template  nodule" + "." * 1000]
    screen = Screen()
    terminal = Terminal(screen, 1023)
    terminal.show(progress)
    *above, title, verdict = screen.getvalue().splitlines()
    assert (len(above), title) == (5, "if the run ended now:")
    # A longer line would break, and the terminal could not be drawn in its place again.
    assert verdict.startswith("template  nodule") and len(verdict) < 1000


def test_a_log_file_gets_plain_lines_now_and_then(progress):
    progress.verdicts = ["if the run ended now:", "template  nodule"]
    stream = io.StringIO()
    terminal = Terminal(stream, 1023)
    for _ in range(10):
        terminal.show(progress)
    assert stream.getvalue().splitlines() == [progress.summary(), *progress.verdicts]


def test_a_quiet_sensor_looks_quiet():
    terminal = Terminal(Screen(), 1023)
    assert terminal.sparkline([512, 513, 512, None]) == "▁▁▁ "
    assert terminal.sparkline([0, 512, 1023]) == "▁▄█"
    assert terminal.sparkline([]) == ""


def test_readings_in_volts_are_shown_too(progress):
    progress.recent.append((0.0, 2.4951, 2.5, 5.0))
    screen = Screen()
    terminal = Terminal(screen, 5.0)
    assert terminal.sparkline([2.5, 2.51, 2.5, None]) == "▁▂▁ "
    assert terminal.sparkline([0.0, 2.5, 5.0]) == "▁▄█"
    terminal.show(progress)
    assert screen.getvalue().splitlines()[2].split()[:3] == ["sensor", "2", "2.495"]
