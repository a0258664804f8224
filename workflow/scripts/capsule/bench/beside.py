"""What a recording or a survey can do without: no fault of it ends the run."""

import sys
import traceback
from collections.abc import Callable


class Beside:
    """What is done after each look at the boards, such as the display.

    Parameters
    ----------
    run : str
        What goes on without it: ``the recording`` or ``the survey``.
    note : callable
        Function that writes a fault and where it happened into a log.

    Attributes
    ----------
    acts : dict of str to callable
        What is done, by its name for the warning.
    """

    def __init__(self, run: str, note: Callable[[str], None]) -> None:
        self._run, self._note = run, note
        self.acts: dict[str, Callable[[], None]] = {}

    def attempt_all(self) -> None:
        """Do all of it once."""
        for what, act in list(self.acts.items()):
            self.attempt(what, act)

    def attempt(self, what: str, act: Callable[[], None]) -> None:
        """Do one thing; after a fault, warn, and do it no more."""
        try:
            act()
        # Whatever it is: a run of the capsule cannot be repeated, a verdict can.
        except Exception as fault:  # noqa: BLE001
            self.acts.pop(what, None)
            text = f"{self._run} goes on without {what}: {type(fault).__name__}: {fault}"
            print(f"warning: {text}", file=sys.stderr, flush=True)
            self._note(f"{text}\n{traceback.format_exc()}")
