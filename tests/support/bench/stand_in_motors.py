"""Imitate the two boards with motors in plain Python; docs/protocol.md describes both."""

from collections import deque

from support.bench.closed_loop import HALF_STEPS_PER_MM
from support.bench.folding import SWITCH_TRAVEL, TRAVEL
from support.bench.stand_in import StandIn

WAVELENGTH_MM = 80.0
FASTEST_MM_S = 47.107
FOLD_STEPS_S = 400.0
# A move has failed if its first switch has not opened after this many half-steps.
_RELEASE_STEPS = 500
_LEASE_S = 5.0
_LONGEST_MOVE_S = 10.0
_DUTY, _DUTY_S = 0.25, 60.0
_FOLD_AND_UNFOLD_S = 10.0
_STATE_EVERY_S = {True: 1.0, False: 0.2}


class StandInPeristalsis(StandIn):
    """A stand-in for the peristalsis board, which turns the cam shafts.

    Attributes
    ----------
    cam_mm : float
        True distance that the cams have carried the wave, in mm; resets do not change it.
    indexed : bool
        Whether there is an index switch.
    stalled : bool
        Whether the motor is stalled: half-steps are counted, but the cams do not move.
    """

    device = "peristalsis"
    commands = ("start", "stop", "speed", "ramp", "direction", "position", "lease")

    def __init__(self, *, indexed: bool = True, cam_mm: float = 30.0) -> None:
        self.indexed, self.cam_mm, self.stalled = indexed, cam_mm, False
        super().__init__()

    def begin(self) -> None:
        """Reset the board, as after power-on."""
        self._counted_mm = self._speed_mm_s = 0.0
        self._target_mm_s = self._ramp_mm_s2 = 25.0
        self._sign, self._running = 1.0, False
        self._lease_s, self._spoken_us = 0.0, self._now_us
        self._index_mm: float | None = None

    @property
    def state(self) -> str:
        """The state of the wave, as the board reports it."""
        if self._running:
            return "running"
        return "stopping" if self._speed_mm_s else "stopped"

    def entries(self) -> dict[str, object]:
        """Return the entries of the board's identity."""
        index = "none" if self._index_mm is None else self._half_steps(self._index_mm)
        return {
            "wavelength_mm": "80.000",
            "max_mm_s": FASTEST_MM_S,
            "state": self.state,
            "index": index,
        }

    def advance(self, until_us: int) -> None:
        """Run until a point in time."""
        passed_s = (until_us - self._now_us) / 1e6
        self._now_us = until_us
        if self._lease_s and until_us - self._spoken_us > self._lease_s * 1e6:
            self._running = False
        wanted_mm_s = self._sign * self._target_mm_s if self._running else 0.0
        most = self._ramp_mm_s2 * passed_s
        change = min(max(wanted_mm_s - self._speed_mm_s, -most), most)
        way_mm = (self._speed_mm_s + change / 2) * passed_s
        self._speed_mm_s += change
        before_mm = self.cam_mm
        self._counted_mm += way_mm
        self.cam_mm += 0.0 if self.stalled else way_mm
        turn = self.cam_mm // WAVELENGTH_MM
        if self.indexed and turn > before_mm // WAVELENGTH_MM:
            self._index_mm = self._counted_mm - (self.cam_mm - turn * WAVELENGTH_MM)

    def answer(self, command: str, argument: str) -> None:
        """Execute a known command, and send the answer."""
        self._spoken_us = self._now_us
        if command == "speed" and float(argument) > FASTEST_MM_S:
            needed = float(argument) * HALF_STEPS_PER_MM
            self.send(f"E,speed,{argument} mm/s needs {needed:.0f} half-steps/s")
            return
        match command:
            case "position":
                self._send_position()
                return
            case "start" | "stop":
                self._running = command == "start"
            case "speed":
                self._target_mm_s = float(argument)
            case "ramp":
                self._ramp_mm_s2 = float(argument)
            case "direction":
                self._sign = 1.0 if argument == "forward" else -1.0
            case "lease":
                self._lease_s = float(argument)
        self.send(f"A,{command}" + (f",{argument}" if argument else ""))

    def _send_position(self) -> None:
        index = "" if self._index_mm is None else self._half_steps(self._index_mm)
        counted_mm, speed_mm_s = self._counted_mm, self._speed_mm_s
        self.send(
            f"P,{self.uptime_ms},{self._half_steps(counted_mm)},{counted_mm:.3f},"
            f"{speed_mm_s:.3f},{self.state},{index}"
        )

    @staticmethod
    def _half_steps(way_mm: float) -> int:
        return round(way_mm * HALF_STEPS_PER_MM)


class StandInFold(StandIn):
    """A stand-in for the fold board, which folds and unfolds the origami.

    Attributes
    ----------
    wound : float
        True half-steps of wound thread; resets do not change them.
    stuck : dict of str to bool
        End switches that are stuck, and whether closed.
    stalled : bool
        Whether the motor is stalled, so that the thread does not move.
    said : list of str
        All states so far.
    """

    device = "fold"
    commands = ("fold", "hold", "unfold", "state")

    def __init__(self) -> None:
        self.wound = 0.0
        self.stuck: dict[str, bool] = {}
        self.stalled = False
        # Times at which the motor was on, and for how many seconds.
        self._on: deque[tuple[int, float]] = deque()
        self.said: list[str] = []
        super().__init__()

    @property
    def folded(self) -> float:
        """The folded share of the origami, 0..1."""
        way = (self.wound - SWITCH_TRAVEL) / (TRAVEL - 2 * SWITCH_TRAVEL)
        return min(max(way, 0.0), 1.0)

    @property
    def closed(self) -> set[str]:
        """The end switches that are closed."""
        truly = {"unfolded": self.wound <= SWITCH_TRAVEL}
        truly["folded"] = self.wound >= TRAVEL - SWITCH_TRAVEL
        return {name for name, closed in (truly | self.stuck).items() if closed}

    def has_run(self, seconds: float, ago_s: float) -> None:
        """Record that the motor ran for some seconds, some time ago."""
        self._on.append((self._now_us - round(ago_s * 1e6), seconds))

    def begin(self) -> None:
        """Reset the board, as after power-on; a folded origami unfolds."""
        self._lease_until_us = self._state_at_us = 0
        self._after_fault = False
        self._switches: set[str] = set()
        self._state = ""
        self._enter("unfolded" if self.closed == {"unfolded"} else "unfolding")

    def entries(self) -> dict[str, object]:
        """Return the entries of the board's identity."""
        return {
            "lease_ms": 5000,
            "longest_ms": 10000,
            "state": self._state,
            "setup": "yes",
        }

    def advance(self, until_us: int) -> None:
        """Run until a point in time."""
        passed_s = (until_us - self._now_us) / 1e6
        self._now_us = until_us
        moves = {"folding": 1.0, "unfolding": -1.0}.get(self._state, 0.0)
        if moves and not self.stalled:
            self.wound = min(max(self.wound + moves * FOLD_STEPS_S * passed_s, 0), TRAVEL)
        self._steps += abs(moves) * FOLD_STEPS_S * passed_s
        if moves:
            self._on.append((until_us, passed_s))
        self._decide()
        if until_us >= self._state_at_us or self.closed != self._switches:
            self._send_state()

    def answer(self, command: str, argument: str) -> None:
        """Execute a known command, and send the answer."""
        del argument
        if command == "state":
            self._send_state()
            return
        busy = self._state in ("folding", "folded")
        if command == "hold" and not busy:
            self.send(f"E,hold,the origami is {self._state}")
            return
        if command == "fold" and not busy:
            if wait_s := self._has_to_rest_s():
                self.send(f"E,fold,the motor has to rest for {wait_s:.0f} s")
                return
            if self.closed != {"unfolded"}:
                self.send("E,fold,the switch unfolded is not closed alone")
                return
            self._after_fault = False
            self._enter("folding")
        if command == "unfold" and self._state not in ("unfolded", "unfolding"):
            self._enter("unfolding")
        if command in ("fold", "hold"):
            self._lease_until_us = self._now_us + int(_LEASE_S * 1e6)
        self.send(f"A,{command}")

    def _has_to_rest_s(self) -> float:
        """Return the time, in s, that the motor has to rest before it may fold and unfold again."""
        while self._on and self._now_us - self._on[0][0] > _DUTY_S * 1e6:
            self._on.popleft()
        too_much_s = sum(on_s for _, on_s in self._on) + _FOLD_AND_UNFOLD_S - _DUTY * _DUTY_S
        for at_us, on_s in self._on:
            if too_much_s <= 0:
                return 0.0
            too_much_s -= on_s
            wait_s = _DUTY_S - (self._now_us - at_us) / 1e6
            if too_much_s <= 0:
                return max(wait_s, 1.0)
        return 0.0

    def _decide(self) -> None:
        """Change to the next state, if its time has come."""
        closed, moving_s = self.closed, (self._now_us - self._since_us) / 1e6
        goal, left = {
            "folding": ("folded", "unfolded"),
            "unfolding": ("unfolded", "folded"),
        }.get(self._state, ("", ""))
        if self._state in ("folding", "folded") and self._now_us > self._lease_until_us:
            self._enter("unfolding")
        elif not goal:
            return
        elif closed == {"unfolded", "folded"}:
            self._fail("both end switches are closed")
        elif goal in closed:
            self._enter(goal)
        elif moving_s > _LONGEST_MOVE_S:
            self._fail(f"the switch {goal} has not closed within 10 s")
        elif left in closed and self._steps > _RELEASE_STEPS:
            self._fail(f"the switch {left} has not opened")

    def _fail(self, reason: str) -> None:
        self.send(f"E,fold,{reason}")
        failed_in, self._after_fault = self._state, True
        self._enter("fault")
        if failed_in == "folding":
            self._enter("unfolding")

    def _enter(self, state: str) -> None:
        self._state, self._since_us, self._steps = state, self._now_us, 0.0
        self.said.append(state)
        self._send_state()

    def _send_state(self) -> None:
        self._switches = self.closed
        switches = "both" if len(self.closed) == 2 else "".join(self.closed) or "none"
        self._state_at_us = self._now_us + int(1e6 * _STATE_EVERY_S[self._state == "unfolded"])
        self.send(f"F,{self.uptime_ms},{round(self.wound)},{switches},{self._state}")
