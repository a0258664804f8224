"""capsule survey --fold-set-up: a person looks at the origami and confirms, on a terminal."""

import os
import subprocess

import pytest

from support.bench import emulated
from support.bench.cable import TerminalCable
from support.bench.stand_in_motors import StandInFold
from support.bench.workbench import Workbench
from support.command import CAPSULE
from support.marks import needs_terminals

pytestmark = [pytest.mark.boards, needs_terminals]


class LeftCable(TerminalCable):
    """A cable that is unplugged after its program has ended: nobody reads the last bytes."""

    def wait_until_read(self, limit_s=5.0):
        """Do not wait."""


class NewFold(StandInFold):
    """A fold board that does not know its thread, as docs/protocol.md describes it."""

    commands = (*StandInFold.commands, "setup")

    def __init__(self):
        self.set_up = False
        super().__init__()

    def entries(self):
        """Return the entries of the board's identity."""
        return super().entries() | {"setup": "yes" if self.set_up else "no"}

    def answer(self, command, argument):
        """Execute a known command, and send the answer."""
        if command != "setup":
            super().answer(command, argument)
        elif self.closed != {"unfolded"}:
            self.send("E,setup,the switch unfolded is not closed alone")
        else:
            self.set_up = argument == "unfolded"
            self.send(f"A,setup,{argument}")


@pytest.fixture
def board():
    return NewFold()


@pytest.fixture
def set_up(tmp_path, board):
    """Return a function that runs the command, types an answer, and returns status and output."""

    def run(answer, board=board, *, on_terminal=True):
        cable = LeftCable(board, tmp_path / "ttyACM0", sticks=False)
        command = [*CAPSULE, "survey", "--fold", cable.port, "--fold-set-up"]
        keyboard, screen = os.openpty()
        process = subprocess.Popen(
            [str(word) for word in command],
            stdin=screen if on_terminal else subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        os.write(keyboard, answer.encode() + b"\n")
        try:
            Workbench(cable, speed=1).run(lambda: process.poll() is not None)
        finally:
            process.kill()
            os.close(keyboard)
            os.close(screen)
            cable.unplug()
        return process.returncode, process.communicate()[0]

    return run


def test_a_person_who_has_looked_sets_the_board_up(set_up, board):
    status, output = set_up("unfolded")
    assert status == 0, output
    assert "its thread is slack" in output
    assert board.set_up


@pytest.mark.parametrize("answer", ["", "yes", "y"])
def test_whoever_does_not_confirm_changes_nothing(set_up, board, answer):
    status, output = set_up(answer)
    assert status == 1, output
    assert "is not set up" in output
    assert not board.set_up


def test_without_a_terminal_nobody_has_looked(set_up, board):
    status, output = set_up("unfolded", on_terminal=False)
    assert status == 1
    assert "run it on a terminal" in output
    assert not board.set_up


def test_a_board_whose_switch_disagrees_refuses(set_up, board):
    board.stuck["unfolded"] = False
    status, output = set_up("unfolded")
    assert status == 12, output
    assert "the switch unfolded is not closed alone" in output
    assert not board.set_up


def test_a_board_that_is_set_up_is_not_asked_about(set_up, board):
    board.set_up = True
    status, output = set_up("")
    assert status == 0
    assert "nothing is to be done" in output


@emulated.needed
def test_the_firmware_itself_is_set_up_and_remembers_it(set_up):
    board = emulated.EmulatedBoard(emulated.FOLD, set_up=False)
    board.set_switch(emulated.PIN_2, True)
    assert set_up("unfolded", board)[0] == 0
    status, output = set_up("", board)
    assert status == 0
    assert "nothing is to be done" in output
