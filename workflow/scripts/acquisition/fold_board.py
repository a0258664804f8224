"""The fold board of a survey: told to fold and unfold, and asked what it says of the origami."""

from collections.abc import Callable

from acquisition.bench_errors import AcquisitionError, BoardLostError, SurveyFaultError
from acquisition.board_link import BoardLink
from acquisition.clock import AWAKE
from acquisition.errands import Errands
from acquisition.frame_log import FrameLog
from acquisition.protocol import Damaged, FoldState, Refusal
from capsule.survey import cycle as cycles
from capsule.survey.survey_log import RESTING, UNFOLDED, UNKNOWN_FOLD

# The board speaks once a second when nothing moves.
SILENT_AFTER_S = 1.5
ASK_EVERY_S = 1.0
# A fault lasts: the board has tried to unfold, and was told to try again, for so long.
FAULT_LASTS_S = 30.0
_FAULT = "fault"
# How the board begins to say that its motor would grow too warm; then follow the seconds.
HAS_TO_REST = "the motor has to rest"
LOOK_EVERY_S = 0.02
# An origami that is told to unfold at the very end should have done so by then.
UNFOLDS_WITHIN_S = 12.0


class FoldBoard:
    """The origami, as its board tells of it.

    Parameters
    ----------
    link : BoardLink
        The board's line.
    log : FrameLog
        Where damaged frames, refusals and faults go.
    tell : callable
        Is told what people should know.

    Attributes
    ----------
    last : FoldState or None
        What the board said last.
    """

    def __init__(self, link: BoardLink, log: FrameLog, tell: Callable[[str], None]) -> None:
        self._link, self._log, self._tell = link, log, tell
        self._errands = Errands(link.send, self._note_refusal)
        self._told, self._rests = "", False
        self._heard_s = self._sound_s = self._asked_s = AWAKE.now_s()
        self.last: FoldState | None = None

    @property
    def state(self) -> str:
        """What a pilot is told: ``unknown`` where the board is silent or reports a fault.

        After a fault nobody knows how far the origami is folded, and a pilot that does not know
        has the board unfold.
        """
        silent = AWAKE.now_s() - self._heard_s > SILENT_AFTER_S
        if self.last is None or silent or self.last.state == _FAULT:
            return UNKNOWN_FOLD
        waits = self._rests and self._errands.open == (cycles.FOLD,)
        return RESTING if waits and self.last.state == UNFOLDED else self.last.state

    def command(self, command: str) -> None:
        """Pass a pilot's command on; returns at once."""
        if command == cycles.HOLD:
            # It comes again with the next judgement, and so needs no confirmation.
            if not self._errands.open:
                self._link.send(command)
        else:
            self._errands.want(command)
            if command == cycles.UNFOLD:
                self._rests = False

    def serve(self, timeout_s: float = 0.0) -> None:
        """Take what the board has said, waiting up to the timeout, and send what is due."""
        for arrival in self._link.receive(timeout_s):
            self._errands.note(arrival.event)
            match arrival.event:
                case FoldState() as state:
                    self._note_state(state)
                case Damaged() as piece:
                    self._log.damaged(piece)
                case Refusal(command=command, reason=reason):
                    self._log.note(f"the fold board at {command!r}: {reason}")
                    if command == cycles.FOLD:
                        self._note_reason(reason)
        self._errands.serve()
        now_s = AWAKE.now_s()
        if now_s - max(self._heard_s, self._asked_s) > ASK_EVERY_S + 0.2:
            self._asked_s = now_s
            self._link.send("state")

    def trouble(self, patience_s: float) -> AcquisitionError | None:
        """Say why the survey cannot go on; None if it can."""
        now_s = AWAKE.now_s()
        if now_s - self._heard_s > patience_s:
            return BoardLostError(
                f"the fold board at {self._link.port} has said nothing for {patience_s:.0f} s "
                "(--patience); it unfolds the origami by itself when its lease is over"
            )
        faulty = self.last is not None and self.last.state == _FAULT
        if faulty and now_s - self._sound_s > FAULT_LASTS_S:
            return SurveyFaultError(
                f"the fold board at {self._link.port} reports a fault that does not pass"
                + (f": {self._told}" if self._told else "")
            )
        return None

    def leave_unfolded(self) -> str:
        """Unfold, and wait for it; gives a warning where the board does not say that it did."""
        self._errands.want(cycles.UNFOLD)
        deadline_s = AWAKE.now_s() + UNFOLDS_WITHIN_S
        while self._errands.open or self.state != UNFOLDED:
            if AWAKE.now_s() > deadline_s:
                return (
                    f"warning: the fold board at {self._link.port} does not say that the origami "
                    f"is unfolded: it is {self.state}; look before you pull the capsule out"
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
        """Tell, once, why the board does not fold: refused, or a fault in mid-move."""
        rests = reason.startswith(HAS_TO_REST)
        # The seconds that it has to rest become fewer.
        if reason != self._told and not (rests and self._rests):
            self._tell(f"the fold board does not fold: {reason}")
        self._told, self._rests = reason, rests

    @staticmethod
    def _note_refusal(command: str, reason: str) -> bool:
        """Have a command tried again until the pilot thinks of something else."""
        del command, reason
        return True
