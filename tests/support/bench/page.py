"""Run the test vectors of workflow/firmware/test_vectors.md."""

import re
from pathlib import Path

from support.bench.cable import Board
from support.bench.emulated import FOLD, LOGGER, PIN_2, EmulatedBoard

PAGE = (Path(__file__).parents[3] / "workflow/firmware/test_vectors.md").read_text(encoding="utf-8")
VOLTAGES_MV = [1000, 2500, 4000, 5000]  # at the logger's inputs, from the page


def board_of_the_page(board: tuple[str, str], image: Path | None = None) -> EmulatedBoard:
    """Start a board with the inputs that the page gives for its conversation, and return it."""
    started = EmulatedBoard(board, image)
    if board == LOGGER:
        started.set_voltages(VOLTAGES_MV, VOLTAGES_MV)
    if board == FOLD:
        started.set_switch(PIN_2, closed=True)
    return started


def conversation(board: str) -> list[tuple[int, str, str]]:
    """Read a conversation from the page: time in ms, direction, line."""
    block = re.search(rf"^```{board}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)[1]
    lines = re.findall(r"^ *(\d+) ms ([<>]) (.*)$", block, re.MULTILINE)
    assert len(lines) == block.count("\n")
    return [(int(ms), direction, line) for ms, direction, line in lines]


def hold(board: Board, lines: list[tuple[int, str, str]]) -> list[tuple[int, str, str]]:
    """Send the lines of a conversation to a board, and return its answers at the page's times."""
    held = []
    for ms, direction, line in lines:
        board.advance(ms * 1000)
        if direction == ">":
            board.deliver(line.encode() + b"\n")
            held.append((ms, ">", line))
        else:
            answered = board.take_sent().decode().splitlines()
            held += [(ms, "<", answer) for answer in answered]
    return held
