"""Commands that a board must confirm, while nobody waits for it."""

import time
from collections import deque
from collections.abc import Callable

from acquisition.boards import CONFIRM_S
from acquisition.protocol import Acknowledgement, Event, Refusal

# A board that has refused is asked again, but not at once.
AGAIN_S = 1.0


class Errands:
    """Commands to one board, one after the other; each is sent again until the board confirms it.

    Parameters
    ----------
    send : callable
        Sends a command.
    refused : callable
        Is given a command that the board refuses, and why; True if it should be tried again.
    """

    def __init__(self, send: Callable[[str], None], refused: Callable[[str, str], bool]) -> None:
        self._send, self._refused = send, refused
        self._commands: deque[str] = deque()
        self._due_s = 0.0

    @property
    def open(self) -> tuple[str, ...]:
        """What has not been confirmed."""
        return tuple(self._commands)

    def want(self, *commands: str) -> None:
        """Have these done, instead of whatever is open."""
        if self.open != commands:
            self._commands = deque(commands)
            self._due_s = 0.0
        self.serve()

    def serve(self) -> None:
        """Send what is due."""
        now_s = time.monotonic()
        if self._commands and now_s >= self._due_s:
            self._due_s = now_s + CONFIRM_S
            self._send(self._commands[0])

    def note(self, event: Event) -> None:
        """Take note of what the board answers."""
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
