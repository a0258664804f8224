"""The peristalsis board of --drive: set up, start, watch and stop the wave of a recording."""

import time
from dataclasses import dataclass

from acquisition.bench_errors import AcquisitionError, LineLostError
from acquisition.boards import connect, request
from acquisition.line import BAUD, Arrival
from acquisition.protocol import Position

ASK_EVERY_S = 1.0
SILENT_AFTER_S = 5.0
LAST_LOOK_S = 0.5


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

    Parameters
    ----------
    port : str
        The peristalsis board's port.
    wave : Wave
        Speed, ramp and direction.

    Raises
    ------
    AcquisitionError
        The board is missing, is another one, or refuses; the text gives its reason.
    """

    def __init__(self, port: str, wave: Wave) -> None:
        self.port = port
        self.line, self.identity = connect(port, BAUD, "peristalsis")
        self.position: Position | None = None
        self._lost = False
        self._asked_s = 0.0
        self._heard_s = 0.0
        try:
            for setting in wave.commands:
                self._request(setting)
        except AcquisitionError:
            self.line.close()
            raise

    def start(self) -> None:
        """Start the wave."""
        self._request("start")
        self._heard_s = time.monotonic()

    def _request(self, command: str) -> None:
        try:
            request(self.line, command)
        except LineLostError as fault:
            raise AcquisitionError(
                f"the peristalsis board at {self.port} was disconnected: {fault}"
            ) from fault

    def watch(self) -> str:
        """Ask for the position once a second; return a warning if the wave stopped by itself."""
        if self._lost:
            return ""
        now_s = time.monotonic()
        try:
            if now_s - self._asked_s >= ASK_EVERY_S:
                self.line.send("position")
                self._asked_s = now_s
            arrivals = self.line.receive(timeout_s=0)
        except LineLostError:
            self._lost = True
            return f"warning: the peristalsis board at {self.port} was unplugged, so no wave runs"
        for arrival in arrivals:
            self._note(arrival)
        if now_s - self._heard_s > SILENT_AFTER_S:
            self._lost = True
            return (
                f"warning: the peristalsis board at {self.port} does not answer; check whether "
                "the wave still runs"
            )
        if self.position and self.position.state != "running":
            self._lost = True
            return "warning: the peristalsis board was reset, so no wave runs"
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
        self._heard_s = time.monotonic()
        if isinstance(arrival.event, Position):
            self.position = arrival.event

    def summary(self) -> str:
        """Return position and speed of the wave in words."""
        if self._lost:
            return "no wave"
        if self.position is None:
            return ""
        return f"wave {self.position.position_mm:.0f} mm at {self.position.speed_mm_s:.1f} mm/s"

    def stop(self) -> str:
        """Stop the wave and close the port; return a warning if the board does not obey."""
        try:
            self._look_once_more()
            request(self.line, "stop")
        except (LineLostError, AcquisitionError) as fault:
            return f"warning: the wave could not be stopped: {fault}; cut the motor's power"
        finally:
            self.line.close()
        return ""
