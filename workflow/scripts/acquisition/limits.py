"""What ends a recording."""

import signal
from dataclasses import dataclass
from types import FrameType


@dataclass(frozen=True)
class Limits:
    """What ends a recording.

    Attributes
    ----------
    samples : int or None
        Number of places of the recording, the missing ones included.
    patience_s : float
        How long to wait for the next sample of a board that went away or sends nonsense.
    kept : int
        How many samples the running verdict can use.
    """

    samples: int | None
    patience_s: float
    kept: int


class StopRequest:
    """Ctrl-C, or a polite kill: ends the recording at the next pause for breath."""

    def __init__(self) -> None:
        self.reason = ""
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            if hasattr(signal, name):
                signal.signal(getattr(signal, name), self._note)

    def _note(self, number: int, frame: FrameType | None) -> None:
        del frame
        self.reason = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name
