"""What a recording or a survey can do without: no fault of it ends the run."""

import math
import sys
import time
import traceback
from collections.abc import Callable


class Beside:
    """What is done after each look at the boards, such as the display."""

    def __init__(self, run: str, note: Callable[[str], None]) -> None:
        self._run, self._note = run, note
        self._acts: dict[str, tuple[Callable[[], None], float]] = {}
        self._done_s: dict[str, float] = {}

    def add(self, what: str, act: Callable[[], None], every_s: float = 0.0) -> None:
        """Add what is to be done, by its name for the warning, as often as `every_s` says."""
        self._acts[what] = act, every_s

    def attempt_due(self) -> None:
        """Do what was not done for long enough."""
        now_s = time.monotonic()
        for what, (act, every_s) in list(self._acts.items()):
            if now_s - self._done_s.get(what, -math.inf) >= every_s:
                self._done_s[what] = now_s
                self.attempt(what, act)

    def attempt(self, what: str, act: Callable[[], None]) -> None:
        """Do one thing; after a fault, warn, and do it no more."""
        try:
            act()
        # Whatever it is: a run of the capsule cannot be repeated, a verdict can.
        except Exception as fault:  # noqa: BLE001
            self._acts.pop(what, None)
            text = f"{self._run} goes on without {what}: {type(fault).__name__}: {fault}"
            print(f"warning: {text}", file=sys.stderr, flush=True)
            self._note(f"{text}\n{traceback.format_exc()}")
