"""The fold board of a survey: commands to fold and unfold, and the state of the origami."""

from collections.abc import Callable

from capsule.bench.bench_errors import AcquisitionError, BoardLostError, SurveyFaultError
from capsule.bench.board_link import BoardLink
from capsule.bench.clock import AWAKE
from capsule.bench.errands import Errands
from capsule.bench.frame_log import FrameLog
from capsule.bench.protocol import Damaged, FoldState, Refusal
from capsule.survey import cycle as cycles
from capsule.survey.survey_log import RESTING, UNFOLDED, UNKNOWN_FOLD

# The board sends its state once a second while nothing moves.
SILENT_AFTER_S = 1.5
ASK_EVERY_S = 1.0
# After so long, a fault ends the survey: the board has tried again and again to unfold.
FAULT_LASTS_S = 30.0
_FAULT = "fault"
# The start of the refusal by which the board protects its motor from heat; seconds follow.
HAS_TO_REST = "the motor has to rest"
# The fault of a board whose memory is new, emptied or damaged.
NOT_SET_UP = "not set up"
LOOK_EVERY_S = 0.02
# At the end of a survey, the origami should be unfolded within this time.
UNFOLDS_WITHIN_S = 12.0


class FoldBoard:
    """The origami, as its board reports it.

    Parameters
    ----------
    link : BoardLink
        The board's line.
    log : FrameLog
        Log of damaged frames, refusals and faults.
    tell : callable
        Function that shows a message to the user.

    Attributes
    ----------
    last : FoldState or None
        The newest state that the board sent.
    """

    def __init__(self, link: BoardLink, log: FrameLog, tell: Callable[[str], None]) -> None:
        self._link, self._log, self._tell = link, log, tell
        self._errands = Errands(link.send, self._note_refusal)
        self._told, self._rests = "", False
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
        waits = self._rests and self._errands.open == (cycles.FOLD,)
        return RESTING if waits and self.last.state == UNFOLDED else self.last.state

    def command(self, command: str) -> None:
        """Pass on a command of the pilot, and return at once."""
        if command == cycles.HOLD:
            # The pilot repeats it with the next judgement, so it needs no confirmation.
            if not self._errands.open:
                self._link.send(command)
        else:
            self._errands.want(command)
            if command == cycles.UNFOLD:
                self._rests = False

    def serve(self, timeout_s: float = 0.0) -> None:
        """Read the board's frames, wait for them up to the timeout, and send due commands."""
        for arrival in self._link.receive(timeout_s):
            self._errands.note(arrival.event)
            match arrival.event:
                case FoldState() as state:
                    self._note_state(state)
                case Damaged() as piece:
                    self._log.damaged(piece)
                case Refusal(command=command, reason=reason):
                    self._log.note(f"the fold board at {command!r}: {reason}")
                    if command == cycles.FOLD or reason == NOT_SET_UP:
                        self._note_reason(reason)
        self._errands.serve()
        now_s = AWAKE.now_s()
        if now_s - max(self._heard_s, self._asked_s) > ASK_EVERY_S + 0.2:
            self._asked_s = now_s
            self._link.send("state")

    def trouble(self, patience_s: float) -> AcquisitionError | None:
        """Return the error that ends the survey; None if it can continue."""
        now_s = AWAKE.now_s()
        if now_s - self._heard_s > patience_s:
            return BoardLostError(
                f"the fold board at {self._link.port} has sent nothing for {patience_s:.0f} s "
                "(--patience); it unfolds the origami by itself when its lease ends"
            )
        faulty = self.last is not None and self.last.state == _FAULT
        if faulty and self._told == NOT_SET_UP:
            return SurveyFaultError(
                f"the fold board at {self._link.port} is not set up: its memory is new, emptied or "
                "damaged, so it does not move; see that the origami is unfolded and its thread "
                "slack, then set it up with capsule survey --fold-set-up"
            )
        if faulty and now_s - self._sound_s > FAULT_LASTS_S:
            reason = f" ({self._told})" if self._told else ""
            return SurveyFaultError(
                f"the fold board at {self._link.port} has reported a fault for "
                f"{FAULT_LASTS_S:.0f} s{reason}; check its thread, motor and end switches"
            )
        return None

    def leave_unfolded(self) -> str:
        """Unfold the origami and wait; return a warning if the board does not confirm it."""
        self._errands.want(cycles.UNFOLD)
        deadline_s = AWAKE.now_s() + UNFOLDS_WITHIN_S
        while self._errands.open or self.state != UNFOLDED:
            if AWAKE.now_s() > deadline_s:
                return (
                    f"warning: the fold board at {self._link.port} does not confirm that the "
                    f"origami is unfolded: it is {self.state}; look before you pull the capsule out"
                )
            self.serve(LOOK_EVERY_S)
        return ""

    def close(self) -> None:
        """Close the port."""
        self._link.close()

    def _note_state(self, state: FoldState) -> None:
        self._heard_s = AWAKE.now_s()
        if state.state != _FAULT:
            self._sound_s = self._heard_s
        elif self.last is None or self.last.state != _FAULT:
            self._tell(f"the fold board reports a fault; its end switches: {state.switches}")
        self.last = state

    def _note_reason(self, reason: str) -> None:
        """Show the user once why the board does not fold: a refusal, or a fault while it moves."""
        rests = reason.startswith(HAS_TO_REST)
        # Each repeated refusal names fewer seconds, so the texts differ.
        if reason != self._told and not (rests and self._rests):
            self._tell(f"the fold board does not fold: {reason}")
        self._told, self._rests = reason, rests

    @staticmethod
    def _note_refusal(command: str, reason: str) -> bool:
        """Return True: the command is repeated until the pilot gives another one."""
        del command, reason
        return True
