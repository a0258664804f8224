"""capsule survey --fold-set-up: a person looks at the origami and confirms, on a terminal."""

from types import SimpleNamespace

import pytest

from capsule.bench import fold
from capsule.bench.bench_errors import AcquisitionError, RefusedError
from capsule.bench.line import Arrival
from capsule.bench.protocol import Acknowledgement, Identity, Refusal

DONE = Acknowledgement("setup", "unfolded")
DISAGREES = Refusal("setup", "the switch unfolded alone must be closed")


@pytest.fixture
def set_up(monkeypatch):
    """Return a function that answers the question, and returns what the board was told."""

    def run(typed, answer=DONE, *, known="no", on_terminal=True):
        sent = []
        line = SimpleNamespace(port="/dev/board", send=sent.append, close=lambda: [])
        line.receive = lambda timeout_s=0.05: [Arrival(answer, 0.0)]
        identity = Identity("fold", {"setup": known})
        monkeypatch.setattr(fold, "connect", lambda *_: (line, identity))
        monkeypatch.setattr(fold.sys, "stdin", SimpleNamespace(isatty=lambda: on_terminal))
        try:
            fold.set_up_fold("/dev/board", 115200, lambda question: typed)
        except AcquisitionError as reason:
            return sent, reason
        return sent, None

    return run


def test_a_person_who_has_looked_sets_the_board_up(set_up):
    assert set_up("unfolded") == (["setup,unfolded"], None)


@pytest.mark.parametrize(
    ("typed", "on_terminal", "said"),
    [
        ("", True, "is not set up"),
        ("yes", True, "is not set up"),
        ("unfolded", False, "run it on a terminal"),
    ],
)
def test_whoever_has_not_looked_changes_nothing(set_up, typed, on_terminal, said):
    sent, reason = set_up(typed, on_terminal=on_terminal)
    assert not sent
    assert said in str(reason)


def test_a_board_whose_switch_disagrees_refuses(set_up):
    _, reason = set_up("unfolded", DISAGREES)
    assert isinstance(reason, RefusedError)
    assert "the switch unfolded alone must be closed" in str(reason)


def test_a_board_that_is_set_up_is_not_asked_about(set_up, capsys):
    assert set_up("", known="yes") == ([], None)
    assert "nothing is to be done" in capsys.readouterr().out
