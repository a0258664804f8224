"""A port is closed again if no board identifies itself behind it."""

import pytest

from acquisition import boards, drive
from acquisition.bench_errors import AcquisitionError, LineLostError, NoAnswerError
from acquisition.drive import Drive, Wave


class LostLine:
    """A line whose port disappears as soon as something is read or sent."""

    def __init__(self, port="lost", baud=0):
        self.port, self.closed = port, False

    def receive(self):
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
    monkeypatch.setattr(boards, "Line", lambda *_: line)
    with pytest.raises(NoAnswerError, match="the board at lost was disconnected before it"):
        boards.connect("lost", 115200, "logger")
    assert line.closed


def test_a_wave_whose_board_is_unplugged_at_its_settings_leaves_no_open_port(monkeypatch):
    line = LostLine()
    monkeypatch.setattr(drive, "connect", lambda *_: (line, None))
    with pytest.raises(AcquisitionError, match="the peristalsis board at lost was disconnected"):
        Drive("lost", Wave(20.0, 5.0, "forward"))
    assert line.closed
