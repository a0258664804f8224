"""Commands that a board must confirm; the caller does not wait for the confirmation."""

import time
from collections import deque
from collections.abc import Callable

from capsule.bench.boards import CONFIRM_S
from capsule.bench.protocol import Acknowledgement, Event, Refusal

# Wait after a refusal before the command is sent again.
AGAIN_S = 1.0


class Errands:
    """A queue of commands to one board; each is repeated until the board confirms it.

    Parameters
    ----------
    send : callable
        Function that sends a command.
    refused : callable
        Function of a refused command and the reason; returns True to repeat the command.
    """

    def __init__(self, send: Callable[[str], None], refused: Callable[[str, str], bool]) -> None:
        self._send, self._refused = send, refused
        self._commands: deque[str] = deque()
        self._due_s = 0.0

    @property
    def open(self) -> tuple[str, ...]:
        """Commands that the board has not confirmed."""
        return tuple(self._commands)

    def want(self, *commands: str) -> None:
        """Send these commands instead of all unconfirmed ones."""
        if self.open != commands:
            self._commands = deque(commands)
            self._due_s = 0.0
        self.serve()

    def serve(self) -> None:
        """Send the first command, if it is due."""
        now_s = time.monotonic()
        if self._commands and now_s >= self._due_s:
            self._due_s = now_s + CONFIRM_S
            self._send(self._commands[0])

    def note(self, event: Event) -> None:
        """Process an answer of the board."""
        if not self._commands:
            return
        name = self._commands[0].partition(",")[0]
        match event:
            case Acknowledgement(command=answered) if answered == name:
                self._go_on()
            case Refusal(command=answered, reason=reason) if answered == name:
                if self._refused(self._commands[0], reason):
                    self._due_s = time.monotonic() + AGAIN_S
                else:
                    self._go_on()

    def _go_on(self) -> None:
        self._commands.popleft()
        self._due_s = 0.0
        self.serve()
