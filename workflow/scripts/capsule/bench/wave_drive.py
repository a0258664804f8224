"""The peristalsis board of a survey: keep the wave running, and ask for its position."""

from collections.abc import Callable

import numpy as np

from capsule.bench.bench_errors import AcquisitionError, BoardLostError, LineLostError
from capsule.bench.board_link import BoardLink
from capsule.bench.boards import request
from capsule.bench.clock import AWAKE
from capsule.bench.drive import Wave
from capsule.bench.errands import Errands
from capsule.bench.frame_log import FrameLog
from capsule.bench.lease import LEASE_S, LeaseKeeper, take_lease
from capsule.bench.protocol import Damaged, Position
from capsule.bench.wave_phase import RUNNING, WavePhase

ASK_EVERY_S = 0.2
# A steep stop leaves the capsule where it is; docs/protocol.md states the limit.
STEEPEST_MM_S2 = 100


class WaveDrive:
    """The wave of a survey.

    Parameters
    ----------
    link : BoardLink
        The board's line.
    wave : Wave
        Speed, ramp and direction.
    index_mm : float or None
        Phase at the index, from the killed session that is resumed.
    resumed : bool
        Whether a killed session is resumed.
    log : FrameLog
        Log of damaged frames.
    tell : callable
        Function that shows a message to the user.
    """

    def __init__(
        self,
        link: BoardLink,
        wave: Wave,
        log: FrameLog,
        tell: Callable[[str], None],
        *,
        index_mm: float | None = None,
        resumed: bool = False,
    ) -> None:
        self._link, self._wave, self._log, self._tell = link, wave, log, tell
        self._settings = (*wave.commands, f"lease,{LEASE_S}")
        self._errands = Errands(link.send, self._note_refusal)
        self._connections = link.connections
        self._keeper = LeaseKeeper(lambda: link.line)
        self._wanted = True
        # Whether the program was stopped, and has not seen the wave since.
        self._unseen = False
        self._asked_s = 0.0
        self._heard_s = self._known_s = AWAKE.now_s()
        self._phase = WavePhase(
            float(link.identity.entries["wavelength_mm"]),
            forward=wave.direction == "forward",
            index_mm=index_mm,
        )
        if resumed:
            self._phase.begin_anew()

    @property
    def index_mm(self) -> float | None:
        """Phase at the cam shaft's index; None before the shaft has passed the index."""
        return self._phase.index_mm

    def start(self) -> None:
        """Start the wave.

        Raises
        ------
        AcquisitionError
            The board refuses, with its reason, or was disconnected.
        """
        try:
            for setting in self._wave.commands:
                request(self._link.line, setting)
            take_lease(self._link.line, self._tell)
            request(self._link.line, "start")
        except LineLostError as fault:
            raise AcquisitionError(
                f"the peristalsis board at {self._link.port} was disconnected: {fault}"
            ) from fault
        self._keeper.start()
        self._heard_s = self._known_s = AWAKE.now_s()

    def note_pause(self) -> None:
        """Note that the program was stopped for a moment: the wave may have stopped meanwhile."""
        self._unseen = True

    def serve(self) -> None:
        """Read the board's frames, and ask for the position of the wave.

        Raises
        ------
        AcquisitionError
            The program was stopped for a moment, and no wave runs any more.
        """
        for arrival in self._link.receive():
            self._errands.note(arrival.event)
            match arrival.event:
                case Position() as position:
                    self._note_position(position, arrival.moment_s)
                case Damaged() as piece:
                    self._log.damaged(piece)
        if self._link.connections > self._connections:
            self._connections = self._link.connections
            self._phase.begin_anew()
            self._check_seen()
            self._run_again()
        self._errands.serve()
        now_s = AWAKE.now_s()
        if now_s - self._asked_s >= ASK_EVERY_S:
            self._asked_s = now_s
            self._link.send("position")

    def wave_mm(self, moments_s: np.ndarray) -> np.ndarray:
        """Return the wave's position at moments of the computer's clock; NaN: unknown."""
        return self._phase.at(moments_s)

    def stop(self) -> None:
        """Command the board to stop the wave, and return at once."""
        if not self._wanted:
            return
        self._wanted = False
        self._keeper.end()
        self._errands.want(f"ramp,{STEEPEST_MM_S2}", "stop")

    def trouble(self, patience_s: float) -> AcquisitionError | None:
        """Return the error that ends the survey; None if it can continue."""
        now_s = AWAKE.now_s()
        if self._wanted and now_s - self._heard_s > patience_s:
            return BoardLostError(
                f"the peristalsis board at {self._link.port} has sent nothing for "
                f"{patience_s:.0f} s (--patience)"
            )
        if self._wanted and now_s - self._known_s > patience_s:
            return BoardLostError(
                f"the phase of the wave has not been known for {patience_s:.0f} s (--patience): "
                "the peristalsis board was reset and has no index switch, or its motor is blocked"
            )
        return None

    def leave_stopped(self) -> str:
        """Stop the wave, wait, and close the port; return a warning if the wave does not stop."""
        self._wanted = False
        self._keeper.end()
        try:
            if self._link.connected:
                request(self._link.line, "stop")
                return ""
            reason = "it is not connected"
        except (LineLostError, AcquisitionError) as fault:
            reason = str(fault)
        finally:
            self._link.close()
        return f"warning: the wave could not be stopped: {reason}; it stops when its lease ends"

    def _note_position(self, position: Position, arrived_s: float) -> None:
        self._heard_s = AWAKE.now_s()
        continues = self._phase.note(position, arrived_s)
        if self._phase.known:
            self._known_s = self._heard_s
        runs = position.state == RUNNING
        if not runs:
            self._check_seen()
        self._unseen = False
        if self._wanted and not self._errands.open and not runs:
            self._tell(
                "the peristalsis board "
                + ("had stopped the wave" if continues else "was reset")
                + ", so the survey starts it again"
            )
            self._run_again()

    def _check_seen(self) -> None:
        """Raise an error if the wave has stopped while nobody watched: a person must start it."""
        if self._wanted and self._unseen:
            raise AcquisitionError(
                "this program was stopped for a moment, and no wave runs any more; look at the "
                "bench, then continue the session: capsule survey --resume"
            )

    def _run_again(self) -> None:
        if self._wanted:
            self._errands.want(*self._settings, "start")

    def _note_refusal(self, command: str, reason: str) -> bool:
        self._log.note(f"the peristalsis board refuses {command!r}: {reason}")
        return False
