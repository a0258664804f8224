"""Ports are closed if no board identifies itself, and boards are rarely reopened."""

import contextlib
import itertools
import os
from pathlib import Path
from types import SimpleNamespace

import pytest
import serial

from capsule.bench import board, identification, recorder
from capsule.bench.bench_errors import (
    AcquisitionError,
    BoardNotFoundError,
    LineLostError,
    NoAnswerError,
    PortBusyError,
)
from capsule.bench.board import Board
from capsule.bench.growing_file import FrameLog
from capsule.bench.line import Line
from capsule.bench.protocol import Identity
from capsule.bench.wave import Wave
from support.marks import needs_terminals


class LostLine:
    """A line whose port disappears as soon as something is read or sent."""

    def __init__(self, port="lost", baud=0):
        self.port, self.baud, self.closed = port, baud, False

    def receive(self, timeout_s):
        """Fail, as an unplugged port does."""
        raise LineLostError("unplugged")

    def send(self, _):
        """Fail, as an unplugged port does."""
        raise LineLostError("unplugged")

    def close(self):
        """Note that it was called."""
        self.closed = True
        return []


def test_a_board_that_is_unplugged_before_it_answers_leaves_no_open_port(monkeypatch):
    line = LostLine()
    monkeypatch.setattr(identification, "Line", lambda *_: line)
    with pytest.raises(NoAnswerError, match="the board at lost was disconnected before it"):
        identification.connect("lost", 115200, "logger")
    assert line.closed


def test_a_wave_whose_board_is_unplugged_at_its_settings_leaves_no_open_port(monkeypatch):
    line = LostLine()
    monkeypatch.setattr(
        recorder, "connect", lambda *_: (line, Identity("peristalsis", {"wavelength_mm": "80"}))
    )
    with pytest.raises(AcquisitionError, match="the peristalsis board at lost was disconnected"):
        recorder.connected_drive("lost", Wave(20.0, 5.0, "forward"), FrameLog(Path(os.devnull)))
    assert line.closed


def test_a_board_that_does_not_identify_itself_is_reopened_every_10_s_at_most(monkeypatch):
    now, opened_s = [100.0], []

    class SilentLine(LostLine):
        """A line at which nothing answers."""

        bytes_read = 0

        def __init__(self, port, baud):
            super().__init__(port, baud)
            opened_s.append(now[0])

        def receive(self, timeout_s):
            """Let time pass."""
            now[0] += timeout_s
            return []

        def send(self, _):
            """Take a question."""

    def sleep(seconds):
        now[0] += seconds

    clock = SimpleNamespace(monotonic=lambda: now[0], sleep=sleep)
    monkeypatch.setattr(identification, "time", clock)
    monkeypatch.setattr(board, "time", clock)
    monkeypatch.setattr(board, "Line", SilentLine)
    waiting = Board(LostLine("A"), Identity("fold", {}), lambda text: None)
    waiting.close()
    while now[0] < 160:
        before_s = now[0]
        with contextlib.suppress(NoAnswerError):
            assert waiting.come_back(0.05) is None
        assert now[0] - before_s < 0.1  # no step takes long: display and Ctrl-C go on
    gaps_s = [after - before for before, after in itertools.pairwise(opened_s)]
    assert len(gaps_s) >= 3
    assert min(gaps_s) >= 10


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
