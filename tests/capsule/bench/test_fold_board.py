"""What a survey concludes from the frames of a fold board."""

from types import SimpleNamespace

import pytest

from capsule.bench.bench_errors import SurveyFaultError
from capsule.bench.board import Board
from capsule.bench.fold import FoldBoard
from capsule.bench.line import Arrival
from capsule.bench.protocol import FrameParser, Identity, encode


class Line:
    """A line on which a test sends frames; `sent` are the commands to the board."""

    port, baud = "/dev/fold", 0

    def __init__(self):
        self.frames, self.sent = [], []

    def receive(self, timeout_s):
        """Return what the board has sent."""
        received, self.frames = b"".join(map(encode, self.frames)), []
        return [Arrival(event, 0.0) for event in FrameParser().feed(received)]

    def send(self, payload):
        """Take a command."""
        self.sent.append(payload)


# Kills: a survey that goes on with a board whose refusals only a person can end.
@pytest.mark.parametrize(
    ("frames", "words"),
    [
        (["F,10,0,unfolded,fault", "E,fold,not set up"], "is not set up.*--fold-set-up"),
        (
            ["E,fold,the memory cannot be written", "F,10,1860,folded,unfolding"],
            "cannot write its memory.*replace the board",
        ),
    ],
)
def test_a_board_that_needs_a_person_ends_the_survey(frames, words):
    line, told = Line(), []
    log = SimpleNamespace(note=lambda text: None)
    fold = FoldBoard(Board(line, Identity("fold", {}), told.append, insists=True), log, told.append)
    line.frames = ["F,5,0,unfolded,unfolded"]
    fold.serve()
    assert fold.trouble(60) is None
    line.frames = frames
    fold.serve()
    with pytest.raises(SurveyFaultError, match=f"/dev/fold {words}"):
        raise fold.trouble(60)
    assert told
