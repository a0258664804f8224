"""Ports are closed if no board identifies itself, and boards are reopened and kept running."""

import contextlib
import itertools
import time
from types import SimpleNamespace

import pytest

from capsule.bench import board, identification, recorder, wave
from capsule.bench.bench_errors import AcquisitionError, LineLostError, NoAnswerError
from capsule.bench.board import Board
from capsule.bench.protocol import Identity
from capsule.bench.wave import Drive, Wave


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


def test_a_board_that_is_unplugged_before_it_answers_leaves_no_open_port(monkeypatch):
    line = LostLine()
    monkeypatch.setattr(identification, "Line", lambda *_: line)
    with pytest.raises(NoAnswerError, match="the board at lost was disconnected before it"):
        identification.connect("lost", 115200, "logger")
    assert line.closed


def test_a_wave_whose_board_is_unplugged_at_its_settings_leaves_no_open_port(monkeypatch):
    line = LostLine()
    monkeypatch.setattr(recorder, "connect", lambda *_: (line, Identity("peristalsis", {})))
    with pytest.raises(AcquisitionError, match="the peristalsis board at lost was disconnected"):
        recorder.connected_drive("lost", Wave(20.0, 5.0, "forward"))
    assert line.closed


class NotedLine:
    """A line that notes what is sent, and when."""

    def __init__(self):
        self.sent, self.sent_s = [], time.monotonic()

    def send(self, payload):
        """Note a command."""
        self.sent.append(payload)
        self.sent_s = time.monotonic()


def test_the_lease_is_renewed_every_two_seconds_while_the_program_is_busy():
    line, gaps_s = NotedLine(), []
    drive = Drive(SimpleNamespace(line=line), Wave(20.0, 5.0, "forward"))
    drive.keep_lease()
    deadline_s = time.monotonic() + 4
    while time.monotonic() < deadline_s:  # busy, as in a long calculation
        gaps_s.append(time.monotonic() - line.sent_s)
    drive.drop_lease()
    assert set(line.sent) == {"position"}
    assert max(gaps_s) < 2.0
    so_far = len(line.sent)
    time.sleep(wave.RENEW_AFTER_S + 2 * wave.LOOK_EVERY_S)
    assert len(line.sent) == so_far


def test_the_lease_outlives_a_board_that_is_away_for_a_moment():
    line, away = NotedLine(), [True]

    class AwayBoard:
        """A board whose line is lost at first."""

        @property
        def line(self):
            """Return the line, or fail."""
            if away[0]:
                raise LineLostError("unplugged")
            return line

    line.sent_s -= 10
    drive = Drive(AwayBoard(), Wave(20.0, 5.0, "forward"))
    drive.keep_lease()
    time.sleep(2 * wave.LOOK_EVERY_S)
    away[0] = False
    time.sleep(2 * wave.LOOK_EVERY_S)
    drive.drop_lease()
    assert line.sent == ["position"]


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
    assert min(gaps_s) >= board.REOPEN_AFTER_S
