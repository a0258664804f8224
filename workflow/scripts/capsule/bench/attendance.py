"""The control of a logger: start it until it sends, and ask for its identity when in doubt."""

from collections.abc import Callable, Iterable

from capsule.bench.boards import differences
from capsule.bench.clock import AWAKE
from capsule.bench.intake import Intake
from capsule.bench.line import Arrival
from capsule.bench.protocol import Damaged, Identity, Sample

START_AGAIN_S = 0.5
# A reset board waits in its boot loader, which must not get a byte (see boards.QUIET_S).
SILENT_AFTER_S = 2.5
ASK_AGAIN_S = 1.0


class Attendance:
    """The control of one logger: it passes on samples and chooses the next command.

    Parameters
    ----------
    identity : Identity
        The logger's description of itself at the start.
    intake : Intake
        The intake of the samples.
    tell : callable
        Function that shows a message to the user.

    Attributes
    ----------
    sampled_s : float
        Time of the last accepted sample, by `AWAKE`.
    """

    def __init__(self, identity: Identity, intake: Intake, tell: Callable[[str], None]) -> None:
        self._identity, self._intake, self._tell = identity, intake, tell
        self._foreign = ""
        self._running = self._granted = False
        self._asked_s = 0.0
        self._started_s = -START_AGAIN_S
        self._heard_s = self.sampled_s = AWAKE.now_s()

    def command(self, now_s: float) -> str:
        """Return the command that the board needs now; empty if it needs none."""
        if now_s - self._heard_s > SILENT_AFTER_S or self._intake.in_doubt or self._foreign:
            if now_s - self._asked_s > ASK_AGAIN_S:
                self._asked_s = now_s
                return "identify"
        elif not self._running and now_s - self._started_s > START_AGAIN_S:
            self._started_s = now_s
            return "start"
        return ""

    def take(self, arrivals: Iterable[Arrival], port: str) -> None:
        """Process the arrivals from a port."""
        arrivals = list(arrivals)
        if arrivals:
            self._heard_s = AWAKE.now_s()
        before = self._intake.received
        for arrival in arrivals:
            if self._intake.ended:
                break
            match arrival.event:
                case Damaged() as piece:
                    self._intake.note_damaged(piece)
                case Sample() as sample if self._foreign:
                    self._intake.refuse(sample, "sent by another board")
                case Sample() as sample:
                    self._intake.take(sample, arrival.moment_s)
                case Identity() as identity:
                    self.take_identity(identity, arrival.moment_s, port)
        if self._intake.received > before:
            self._running = True
            self.sampled_s = AWAKE.now_s()
            self._granted = False

    def take_identity(
        self, identity: Identity, moment_s: float, port: str, fresh: bool = False
    ) -> None:
        """Process the board's description of itself; `fresh` as in `Timeline.continues`."""
        if self.is_foreign(identity, port):
            return
        running = identity.entries.get("state") == "running"
        uptime = identity.entries.get("uptime_ms", "")
        if uptime.isdecimal() and not self._intake.take_identity(
            int(uptime), running, moment_s, fresh
        ):
            if self._running or (running and fresh):
                self._tell(
                    "the board was reset or exchanged: its clock started again. The recording "
                    "continues in the same file; this computer's clock gives the length of the gap"
                )
            self._running = False
            self._started_s = -START_AGAIN_S

    def is_foreign(self, identity: Identity, port: str) -> bool:
        """Return whether the board differs from the one in the recording's header."""
        before = self._foreign
        self._foreign = differences(self._identity, identity)
        if self._foreign and self._foreign != before:
            self._tell(
                f"the board at {port} is another one ({self._foreign}), so the "
                "recorder ignores its samples; plug the first board back in, or end the recording "
                "with Ctrl-C"
            )
        return bool(self._foreign)

    def went_away(self) -> None:
        """Decide on samples in doubt, because the line is lost and no more samples follow."""
        self._intake.settle()
        self._running = False

    def came_back(self) -> None:
        """Restart the wait for a sample, because the board is connected again."""
        self._heard_s = AWAKE.now_s()
        if not self._granted:  # only once, until a sample arrives
            self.sampled_s = self._heard_s
            self._granted = True
