"""The fold board: set it up, fold and unfold the origami, and tell its state."""

import contextlib
import sys
from collections.abc import Callable

from capsule.bench.bench_errors import AcquisitionError, SurveyFaultError
from capsule.bench.board import MOST_RESETS, Board
from capsule.bench.clock import AWAKE
from capsule.bench.growing_file import FrameLog
from capsule.bench.line import READ_TIMEOUT_S
from capsule.bench.protocol import Damaged, FoldState, Refusal
from capsule.survey import cycle as cycles
from capsule.survey.survey_log import RESTING, UNFOLDED, UNKNOWN_FOLD

# The board sends its state once a second while nothing moves.
SILENT_AFTER_S = 1.5
ASK_EVERY_S = 1.2
# After so long, a fault ends the survey: the board has tried again and again to unfold.
FAULT_LASTS_S = 30.0
_FAULT = "fault"
# The start of the refusal by which the board protects its motor from heat; seconds follow.
HAS_TO_REST = "the motor has to rest"
# The fault of a board whose memory is new, emptied or damaged.
NOT_SET_UP = "not set up"
# The refusal of a board that cannot keep how far its thread is wound.
MEMORY_FAILS = "the memory cannot be written"
# Refusals that end a survey, since only a person can help.
_FINAL = {
    NOT_SET_UP: (
        "is not set up: its memory is new, emptied or damaged, so it does not move; see that the "
        "origami is unfolded and its thread slack, then set it up with capsule survey --fold-set-up"
    ),
    MEMORY_FAILS: (
        "cannot write its memory, so it folds no more and does not move after a restart; replace "
        "the board, and set the new one up with capsule survey --fold-set-up"
    ),
}
# At the end of a survey, the origami should be unfolded within this time.
UNFOLDS_WITHIN_S = 12.0


class FoldBoard:
    """The origami, as its board reports it."""

    def __init__(self, board: Board, log: FrameLog) -> None:
        self._board, self._log = board, log
        board.insists = True
        self._told, self._rests, self._resets = "", False, 0
        self._heard_s = self._sound_s = self._asked_s = AWAKE.now_s()
        self.last: FoldState | None = None

    @property
    def state(self) -> str:
        """Return the fold state for the pilot.

        It is ``unknown`` if the board is silent or reports a fault: the origami may then be folded
        to any degree. The pilot answers an unknown state with the command to unfold.
        """
        silent = AWAKE.now_s() - self._heard_s > SILENT_AFTER_S
        if self.last is None or silent or self.last.state == _FAULT:
            return UNKNOWN_FOLD
        waits = self._rests and self._board.pending == (cycles.FOLD,)
        return RESTING if waits and self.last.state == UNFOLDED else self.last.state

    def summary(self) -> str:
        """Return the state of the origami, its thread and its motor in words."""
        if self.last is None:
            return ""
        rests = f"; {self._told}" if self._rests else ""
        thread = f"its thread wound by {self.last.half_steps} half-steps"
        return f"the origami is {self.state}, {thread}{rests}"

    def command(self, command: str) -> None:
        """Pass on a command of the pilot, and return at once."""
        if command == cycles.HOLD:
            # The pilot repeats it with the next judgement, so it needs no confirmation.
            if not self._board.pending:
                self._board.send(command)
        else:
            self._board.want(command)
            if command == cycles.UNFOLD:
                self._rests = False

    def serve(self, timeout_s: float = 0.0) -> None:
        """Read the board's frames, wait for them up to the timeout, and send due commands."""
        for arrival in self._board.read(timeout_s):
            match arrival.event:
                case FoldState() as state:
                    self._note_state(state)
                case Damaged() as piece:
                    self._log.damaged(piece)
                case Refusal(command=command, reason=reason):
                    self._log.note(f"the fold board at {command!r}: {reason}")
                    if command == cycles.FOLD or reason in _FINAL:
                        self._note_reason(reason)
        now_s = AWAKE.now_s()
        if now_s - max(self._heard_s, self._asked_s) > ASK_EVERY_S:
            self._asked_s = now_s
            self._board.send("state")

    def trouble(self, patience_s: float) -> AcquisitionError | None:
        """Return the error that ends the survey; None if it can continue."""
        if lost := self._board.loss(patience_s):
            return lost
        what = _FINAL.get(self._told, "")
        if self._resets > MOST_RESETS:
            what = f"was reset {self._resets} times; check its supply and its cable"
        elif not what and self._heard_s - self._sound_s > FAULT_LASTS_S:
            reason = f" ({self._told})" if self._told else ""
            lasts = f"has reported a fault for {FAULT_LASTS_S:.0f} s{reason}"
            what = f"{lasts}; check its thread, motor and end switches"
        return SurveyFaultError(f"{self._board.name} {what}") if what else None

    def leave_unfolded(self) -> str:
        """Unfold the origami and wait; return a warning if the board does not confirm it."""
        self._board.want(cycles.UNFOLD)
        deadline_s = AWAKE.now_s() + UNFOLDS_WITHIN_S
        while self._board.pending or self.state != UNFOLDED:
            if AWAKE.now_s() > deadline_s:
                return (
                    f"warning: {self._board.name} does not confirm that the origami is unfolded: "
                    f"it is {self.state}; look before you pull the capsule out"
                )
            self.serve(READ_TIMEOUT_S)
        return ""

    def _note_state(self, state: FoldState) -> None:
        self._heard_s = AWAKE.now_s()
        self._resets += self.last is not None and state.device_ms < self.last.device_ms
        if state.state != _FAULT:
            self._sound_s = self._heard_s
        elif self.last is None or self.last.state != _FAULT:
            self._log.tell(f"the fold board reports a fault; its end switches: {state.switches}")
        self.last = state

    def _note_reason(self, reason: str) -> None:
        """Show the user once why the board does not fold: a refusal, or a fault while it moves."""
        rests = reason.startswith(HAS_TO_REST)
        # Each repeated refusal names fewer seconds, so the texts differ.
        if reason != self._told and not (rests and self._rests):
            self._log.tell(f"the fold board does not fold: {reason}")
        self._told, self._rests = reason, rests


SET_UP = "setup,unfolded"
ANSWER = "unfolded"
_QUESTION = f"""\
The fold board keeps how far its thread is wound. A board that is new, or has lost this, does not
move until somebody has looked. Look at the origami now:

  - it is unfolded, so that the switch "unfolded" is closed,
  - its thread is slack, with at least three spare turns on the spool.

If both is so, type {ANSWER!r}: """


def set_up_fold(port: str, baud: int, ask: Callable[[str], str] = input) -> None:
    """Ask the user to look at the origami, and tell the fold board that it is unfolded.

    Raises
    ------
    AcquisitionError
        There is no terminal to ask at, the user does not confirm, the board is missing or another
        one, or it refuses, such as with a switch "unfolded" that is not closed.
    """
    if not sys.stdin.isatty():
        raise AcquisitionError(
            "--fold-set-up asks a person who looks at the origami; run it on a terminal"
        )
    with contextlib.closing(Board(port, baud, "fold", lambda text: None)) as board:
        if board.identity.entries.get("setup") == "yes":
            print(f"the fold board at {port} is set up; nothing is to be done", flush=True)
            return
        answer = ""
        with contextlib.suppress(EOFError):
            answer = ask(_QUESTION)
        if answer.strip().strip("'\"").lower() != ANSWER:
            raise AcquisitionError(
                f"{answer!r} is not {ANSWER!r}, so the fold board at {port} is not set up; wind or "
                "unwind the thread by hand, then run the same command again"
            )
        board.request(SET_UP)
    print(f"the fold board at {port} is set up", flush=True)
