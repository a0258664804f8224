"""Limits of a recording, and the request to stop it (Ctrl-C)."""

import signal
from dataclasses import dataclass
from types import FrameType


@dataclass(frozen=True)
class Limits:
    """Limits of a recording.

    Attributes
    ----------
    samples : int or None
        Number of samples, missing ones included; None: no limit.
    patience_s : float
        Longest wait in seconds for the next sample.
    kept : int
        Number of samples that the running verdict can use.
    """

    samples: int | None
    patience_s: float
    kept: int


class StopRequest:
    """A request by Ctrl-C, SIGTERM or SIGHUP to end the recording; `reason` names it."""

    def __init__(self) -> None:
        self.reason = ""
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            if hasattr(signal, name):
                signal.signal(getattr(signal, name), self._note)

    def _note(self, number: int, frame: FrameType | None) -> None:
        del frame
        self.reason = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name
