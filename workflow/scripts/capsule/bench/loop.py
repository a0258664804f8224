"""What a recording and a survey share: the loop, what no fault of may end it, and their files."""

import contextlib
import math
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from functools import partial

from capsule.bench.growing_file import FrameLog, GrowingFile
from capsule.bench.live import SHOW_EVERY_S, LivePage
from capsule.bench.state import State
from capsule.bench.survey_folder import SessionFolder
from capsule.bench.terminal import Terminal


class Loop:
    """The loop of a `run`, by its name for warnings."""

    def __init__(self, run: str, state: State, log: FrameLog) -> None:
        self._run, self.state, self.log = run, state, log
        self._acts: dict[str, tuple[Callable[[], None], float]] = {}
        self._done_s: dict[str, float] = {}

    def add(self, what: str, act: Callable[[], None], every_s: float = 0.0) -> None:
        """Add what is done after each look, but no sooner than `every_s` after the last time."""
        self._acts[what] = act, every_s

    def show_on(self, terminal: Terminal, page: LivePage | None) -> None:
        """Show the state on the terminal and, if there is one, in the live page."""
        self.add("its display", partial(terminal.show, self.state), terminal.every_s)
        if page:
            self.add("its live page", partial(page.show, self.state), SHOW_EVERY_S)

    def go_on(self, look: Callable[[], str]) -> None:
        """Call `look`, which reads and writes, until it returns why the run has ended."""
        while not self.state.ended:
            ended = look()
            self.attempt_due()
            self.state.ended = ended

    def attempt_due(self) -> None:
        """Do what was not done for long enough; at the end, all of it."""
        now_s = time.monotonic()
        for what, (act, every_s) in list(self._acts.items()):
            if self.state.ended or now_s - self._done_s.get(what, -math.inf) >= every_s:
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
            self.log.note(f"{text}\n{traceback.format_exc()}")


@contextlib.contextmanager
def kept(files: GrowingFile | SessionFolder, begun: Callable[[], bool]) -> Iterator[None]:
    """Finish the files of a run at its end; after a fault, keep what it has begun, as it is."""
    try:
        yield
    except BaseException:
        if begun():
            files.close()
        else:
            files.discard()
        raise
    files.finish()
