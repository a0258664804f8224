"""The serial protocol: docs/protocol.md, the computer's program and the firmware agree."""

import re
from pathlib import Path
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.bench import protocol
from capsule.bench.protocol import Damaged, FrameParser, Sample, checksum, decode, encode
from support.bench import emulated
from support.command import output_of
from support.marks import missing_program, needs

PAGE = (emulated.FIRMWARE / "test_vectors.md").read_text(encoding="utf-8")
CHECKSUMS = re.findall(r"^\| `([^`]+)` \| `([0-9A-F]{4})` \| `([^`]+)` \|$", PAGE, re.MULTILINE)
ARDUINO = Path("/usr/share/arduino/hardware")
no_boards = "" if ARDUINO.exists() else "no boards of Arduino (Debian: arduino-core-avr)"
missing = missing_program("arduino-builder", packages="arduino-builder") or no_boards
arduino = (pytest.mark.boards, needs(missing))
U32, COUNT = st.integers(0, 2**32 - 1), st.integers(0, 1023)
samples = st.builds(Sample, U32, U32, st.tuples(*[COUNT] * 4), st.booleans())


def conversation(board):
    """Read a conversation from the page: time in ms, direction, line."""
    block = re.search(rf"^```{board[0]}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)[1]
    lines = re.findall(r"^ *(\d+) ms ([<>]) (.*)$", block, re.MULTILINE)
    assert len(lines) == block.count("\n")
    return [(int(ms), direction, line) for ms, direction, line in lines]


def test_host_has_the_checksums_and_understands_every_answer_of_the_page():
    assert len(CHECKSUMS) > 10
    for payload, crc, frame in CHECKSUMS:
        assert f"{checksum(payload.encode()):04X}" == crc
        assert encode(payload) == frame.encode() + b"\n"
        wrong = b"$%s*%04X" % (payload.encode(), int(crc, 16) ^ 1)
        assert decode(wrong) == Damaged(wrong, "failed its check")
    answers = [line for board in emulated.BOARDS for line in conversation(board)]
    kinds = {type(decode(line.encode())) for _, direction, line in answers if direction == "<"}
    assert kinds == set(get_args(protocol.Event)) - {Damaged}


def built_by_the_arduino_ide(board, folder):
    name, kind = board[0], "mega:cpu=atmega2560" if board == emulated.LOGGER else "uno"
    command = ["arduino-builder", "-compile", "-fqbn", f"arduino:avr:{kind}", "-tools", "/usr/bin"]
    command += ["-hardware", ARDUINO, "-hardware", ARDUINO.parents[1] / "arduino-builder"]
    command += ["-prefs=runtime.tools.avr-gcc.path=/usr"]
    command += ["-prefs=tools.ctags.cmd.path=/usr/bin/arduino-ctags"]
    # Debian's compiler lacks this constant, which the Arduino core's String uses.
    command += ["-prefs=compiler.cpp.extra_flags=-DDECIMAL_DIG=17"]
    command += ["-libraries", emulated.FIRMWARE / "libraries", "-build-path", folder]
    output_of(*command, emulated.FIRMWARE / name / f"{name}.ino")
    return folder / f"{name}.ino.elf"


@emulated.needed
@pytest.mark.parametrize("board", emulated.BOARDS, ids=lambda board: board[0])
@pytest.mark.parametrize("build", [None, pytest.param(built_by_the_arduino_ide, marks=arduino)])
def test_firmware_holds_the_conversation_of_the_page(board, build, tmp_path):
    firmware = emulated.EmulatedBoard(board, build and build(board, tmp_path))
    if board == emulated.LOGGER:
        firmware.set_voltages(1000, 2500, 4000, 5000)  # from the page
    if board == emulated.FOLD:
        firmware.set_switch(emulated.PIN_2, closed=True)
    lines, held = conversation(board), []
    for ms, direction, line in lines:
        firmware.advance(ms * 1000)
        if direction == ">":
            firmware.deliver(line.encode() + b"\n")
            held.append((ms, ">", line))
        else:
            held += [(ms, "<", each) for each in firmware.take_sent().decode().splitlines()]
    assert held == lines


def test_events():
    for payload, event in (
        ("D,7,800,1,2,3,4,1", Sample(7, 800, (1, 2, 3, 4), at_end=True)),
        ("E,speed,too fast, sorry", protocol.Refusal("speed", "too fast, sorry")),
        ("P,402,-2,-0.117,-3.87,running", protocol.Position(402, -2, -0.117, -3.87, "running")),
        ("P,402,-2,-0.117,-3.87,running,", protocol.Position(402, -2, -0.117, -3.87, "running")),
        ("P,402,-2,-0.117,25,running,-19", protocol.Position(402, -2, -0.117, 25, "running", -19)),
        ("F,5310,-4,none,unfolding", protocol.FoldState(5310, -4, "none", "unfolding")),
        ("I,logger,protocol=1,a=", protocol.Identity("logger", {"protocol": "1", "a": ""})),
    ):
        assert decode(encode(payload)[:-1]) == event


def test_a_checked_frame_of_unknown_form_is_not_used():
    for payload in (
        *("", "X", "D", "D,1,2", "D,1,2,3,-4,0", "D,1,2,3,4.5,0", "D,1,2,3,4,2", "D,1,2,0x1,4,0"),
        *("D,1,2,99999999999,4,0", "P,1,2,3,4", "P,1.5,2,3,4,x", "I", "I,logger,running", "A"),
        *("E,x", "P,1,2,3,4,x,5.5", "P,1,2,3,4,x,5,6", "F,1,2,none", "F,1,2,none,folded,0"),
        *("F,-1,2,none,folded", "F,1,2.5,none,folded", "F,1,2,open,folded", "F,1,2,none,lost"),
    ):
        frame = b"$%s*%04X" % (payload.encode(), checksum(payload.encode()))
        assert isinstance(decode(frame), Damaged), payload


def test_what_cannot_be_sent_is_refused_and_what_is_longer_than_a_frame_given_up():
    for payload in ("", "a$b", "a\nb", "é"):
        with pytest.raises(ValueError, match="cannot be sent"):
            encode(payload)
    parser = FrameParser()
    assert parser.feed(b"x" * 256) == []
    assert parser.feed(b"x") == [Damaged(b"x" * 257, "longer than any frame")]


def frame_of(sample: Sample) -> bytes:
    cells = [sample.sequence, sample.device_ms, *sample.counts, int(sample.at_end)]
    return encode("D," + ",".join(map(str, cells)))


# Any bytes but a line feed; or a frame that a reset cut off.
noises = st.one_of(
    st.binary(max_size=30).filter(lambda noise: b"\n" not in noise),
    st.builds(lambda sample, length: frame_of(sample)[:length], samples, st.integers(0, 15)),
)


@given(st.lists(st.tuples(noises, samples)), st.binary(), st.lists(st.integers(1, 50), min_size=1))
def test_whole_frames_survive_any_noise_and_cutting_and_no_byte_goes_missing(sent, rest, lengths):
    whole = stream = b"".join(noise + frame_of(sample) for noise, sample in sent) + rest
    parser, events = FrameParser(), []
    while stream:
        length = lengths[len(stream) % len(lengths)]
        events += parser.feed(stream[:length])
        stream = stream[length:]
    events += parser.drop_pending()
    # Nothing valid comes of noise, and the log could rebuild it all, apart from the line feeds.
    assert [event for event in events if isinstance(event, Sample)] == [each for _, each in sent]
    kept = [event.content if isinstance(event, Damaged) else frame_of(event) for event in events]
    assert b"".join(kept).replace(b"\n", b"") == whole.replace(b"\n", b"")
