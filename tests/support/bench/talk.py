"""A conversation with an emulated board, whose firmware runs between the sentences."""

from collections.abc import Callable

from acquisition.protocol import Event, decode, encode
from acquisition.workbench import World
from support.bench.emulated import EmulatedBoard

STRETCH_US = 5000


class Talk:
    """Somebody who says something to a board now and then, and hears all it says.

    Parameters
    ----------
    board : tuple of str
        The board, as `EmulatedBoard` takes it.
    world : callable, optional
        Makes the world around the board.

    Attributes
    ----------
    greeting : list of Event
        What the board said when it started.
    now_us : int
        The bench's time.
    """

    def __init__(
        self, board: tuple[str, str], world: Callable[[EmulatedBoard], World] | None = None
    ) -> None:
        self.board = EmulatedBoard(board)
        self.world = world(self.board) if world else None
        self.now_us = 0
        self.greeting = self.wait(0.05)

    def wait(self, seconds: float) -> list[Event]:
        """Let time pass; gives what the board says meanwhile."""
        end_us = self.now_us + round(seconds * 1e6)
        while self.world and self.now_us < end_us:
            start_us = self.now_us
            self.now_us = min(start_us + STRETCH_US, end_us)
            self.world(start_us / 1e6, self.now_us / 1e6)
            self.board.advance(self.now_us)
        self.now_us = end_us
        self.board.advance(end_us)
        return [decode(line) for line in self.board.take_sent().splitlines()]

    def say(self, payload: str, seconds: float = 0.03) -> list[Event]:
        """Send a command; gives the answers."""
        self.board.deliver(encode(payload))
        return self.wait(seconds)
