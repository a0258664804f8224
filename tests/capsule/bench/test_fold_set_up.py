"""capsule survey --fold-set-up: a person looks at the origami and confirms, on a terminal."""

from types import SimpleNamespace

import pytest

from capsule.bench import fold
from capsule.bench.bench_errors import AcquisitionError
from support.bench.scripted import FakeLine, board_on

DONE, DISAGREES = "A,setup,unfolded", "E,setup,the switch unfolded alone must be closed"


@pytest.mark.parametrize(
    ("typed", "answer", "known", "on_terminal", "told", "said"),
    [
        ("unfolded", DONE, "no", True, ["setup,unfolded"], "is set up"),
        ("", DONE, "yes", True, [], "nothing is to be done"),
        # Whoever has not looked changes nothing.
        ("", DONE, "no", True, [], "is not set up"),
        ("yes", DONE, "no", True, [], "is not set up"),
        ("unfolded", DONE, "no", False, [], "run it on a terminal"),
        ("unfolded", DISAGREES, "no", True, ["setup,unfolded"], "must be closed"),
    ],
)
def test_a_person_who_has_looked_sets_a_new_board_up(
    monkeypatch, capsys, typed, answer, known, on_terminal, told, said
):
    line = FakeLine()
    board = board_on(line, "fold", setup=known)
    line.frames = [answer]
    monkeypatch.setattr(fold, "Board", lambda *_: board)
    monkeypatch.setattr(fold.sys, "stdin", SimpleNamespace(isatty=lambda: on_terminal))
    try:
        fold.set_up_fold("/dev/board", 115200, lambda question: typed)
        output = capsys.readouterr().out
    except AcquisitionError as reason:
        output = str(reason)
    assert (line.sent, said in output) == (told, True)
