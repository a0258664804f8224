"""The peristalsis board of --drive: set up, start, watch and stop the wave of a recording."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from capsule.bench.bench_errors import AcquisitionError, LineLostError
from capsule.bench.boards import connect, request
from capsule.bench.clock import AWAKE
from capsule.bench.lease import LeaseKeeper, take_lease
from capsule.bench.line import BAUD, Arrival, Line
from capsule.bench.protocol import Position

ASK_EVERY_S = 0.2
SILENT_AFTER_S = 5.0
# The wave runs on meanwhile.
LAST_LOOK_S = 0.2
RUNNING = "running"


@dataclass(frozen=True)
class Wave:
    """Speed, ramp and direction of the wave."""

    speed_mm_s: float
    ramp_mm_s2: float
    direction: str

    @property
    def commands(self) -> tuple[str, ...]:
        """Commands that set up the peristalsis board."""
        return (
            f"direction,{self.direction}",
            f"ramp,{self.ramp_mm_s2:g}",
            f"speed,{self.speed_mm_s:g}",
        )


class Drive:
    """The wave during one recording.

    The board has a lease: it stops the wave by itself if this program dies or is stopped. A wave
    that has stopped by itself is not started again, but it is watched on.

    Parameters
    ----------
    port : str
        The peristalsis board's port.
    wave : Wave
        Speed, ramp and direction.
    tell : callable
        Function that shows a message to the user.

    Raises
    ------
    AcquisitionError
        The board is missing, is another one, or refuses; the text gives its reason.
    """

    def __init__(self, port: str, wave: Wave, tell: Callable[[str], None] = print) -> None:
        self.port = port
        self.line, self.identity = connect(port, BAUD, "peristalsis")
        self.position: Position | None = None
        self._keeper = LeaseKeeper(self._open_line)
        self._unplugged = self._silent = self._stopped = self._left = False
        self._asked_s = 0.0
        self._heard_s = AWAKE.now_s()
        try:
            for setting in wave.commands:
                self._request(setting)
            self._take_lease(tell)
        except AcquisitionError:
            self.line.close()
            raise

    def start(self) -> None:
        """Start the wave."""
        self._request("start")
        self._keeper.start()
        self._heard_s = AWAKE.now_s()

    def _open_line(self) -> Line:
        return self.line

    def _take_lease(self, tell: Callable[[str], None]) -> None:
        try:
            take_lease(self.line, tell)
        except LineLostError as fault:
            raise self._disconnected(fault) from fault

    def _request(self, command: str) -> None:
        try:
            request(self.line, command)
        except LineLostError as fault:
            raise self._disconnected(fault) from fault

    def _disconnected(self, fault: LineLostError) -> AcquisitionError:
        return AcquisitionError(f"the peristalsis board at {self.port} was disconnected: {fault}")

    def watch(self) -> str:
        """Renew the lease by asking for the position; return a warning if the wave has stopped."""
        if self._unplugged:
            return ""
        now_s = time.monotonic()
        try:
            if now_s - self._asked_s >= ASK_EVERY_S:
                self.line.send("position")
                self._asked_s = now_s
            arrivals = self.line.receive(timeout_s=0)
        except LineLostError:
            self._unplugged = True
            self._keeper.end()
            return f"warning: the peristalsis board at {self.port} was unplugged, so no wave runs"
        for arrival in arrivals:
            self._note(arrival)
        return self._change()

    def _change(self) -> str:
        """Return what has changed since the last look: the board fell silent, or the wave stopped.

        The clock does not count the time in which this program was stopped (Ctrl-Z).
        """
        silent = AWAKE.now_s() - self._heard_s > SILENT_AFTER_S
        stopped = self.position is not None and self.position.state != RUNNING
        was_silent, self._silent = self._silent, silent
        was_stopped, self._stopped = self._stopped, stopped
        if silent and not was_silent:
            return (
                f"warning: the peristalsis board at {self.port} does not answer; check whether "
                "the wave still runs"
            )
        if stopped and not was_stopped:
            return (
                "warning: no wave runs: the peristalsis board was reset, or this program was "
                "stopped for longer than the wave's lease. The recorder does not start it again; "
                "end the recording with Ctrl-C, and record anew"
            )
        return ""

    def _look_once_more(self) -> None:
        """Ask for the last position of the wave."""
        self.position = None
        self.line.send("position")
        deadline = time.monotonic() + LAST_LOOK_S
        while self.position is None and time.monotonic() < deadline:
            for arrival in self.line.receive():
                self._note(arrival)

    def _note(self, arrival: Arrival) -> None:
        self._heard_s = AWAKE.now_s()
        if isinstance(arrival.event, Position):
            self.position = arrival.event

    def summary(self) -> str:
        """Return position and speed of the wave in words."""
        if self._unplugged or self._silent or self._stopped:
            return "no wave"
        if self.position is None:
            return ""
        return f"wave {self.position.position_mm:.0f} mm at {self.position.speed_mm_s:.1f} mm/s"

    def stop(self) -> str:
        """Stop the wave and close the port; return a warning if the board does not obey.

        It can be called more than once.
        """
        if self._left:
            return ""
        self._left = True
        self._keeper.end()
        try:
            self._look_once_more()
            request(self.line, "stop")
        except (LineLostError, AcquisitionError) as fault:
            return f"warning: the wave could not be stopped: {fault}; cut the motor's power"
        finally:
            self.line.close()
        return ""
