"""Exchange messages with an emulated board, whose firmware runs between them."""

from collections.abc import Callable

from capsule.bench.protocol import Event, decode, encode
from support.bench.emulated import EmulatedBoard
from support.bench.workbench import World

STRETCH_US = 5000


class Talk:
    """A conversation with a board, in a world if one is given, with options of `EmulatedBoard`."""

    def __init__(
        self,
        board: tuple[str, str],
        world: Callable[[EmulatedBoard], World] | None = None,
        **options: object,
    ) -> None:
        self.board = EmulatedBoard(board, **options)
        self.world = world(self.board) if world else None
        self.now_us = 0
        self.greeting = self.wait(0.05)

    def wait(self, seconds: float) -> list[Event]:
        """Advance the time, and return the board's messages."""
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
        """Send a command, and return the answers."""
        self.board.deliver(encode(payload))
        return self.wait(seconds)
