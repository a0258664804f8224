"""The peristalsis board: start the wave, renew its lease, watch it, know its place, and stop it."""

import contextlib
import math
import threading
import time
from collections import deque
from dataclasses import dataclass

import numpy as np

from capsule.bench.bench_errors import AcquisitionError, BoardLostError, LineLostError, RefusedError
from capsule.bench.board import Board
from capsule.bench.clock import AWAKE
from capsule.bench.growing_file import FrameLog
from capsule.bench.line import READ_TIMEOUT_S, Arrival
from capsule.bench.protocol import Damaged, Identity, Position, Refusal
from capsule.bench.timeline import BoardClock
from capsule.recordings.recording import TO_THE_END

# Without a command for so long, the board stops the wave.
LEASE_S = 5
# The board is asked so often even if the program does something else, such as a slow write.
RENEW_AFTER_S = 1.5
LOOK_EVERY_S = 0.25
# A main thread that has not served the wave for so long hangs, as in a write to a dead disk.
HANGS_AFTER_S = 4.0
# A program that was stopped for no longer (Ctrl-Z) finds its wave still running.
LONGEST_PAUSE_S = LEASE_S - RENEW_AFTER_S - LOOK_EVERY_S
ASK_EVERY_S = 0.2
SILENT_AFTER_S = 5.0
# The wave runs on meanwhile.
LAST_LOOKS = 4
# A steep stop leaves the capsule where it is; docs/protocol.md states the limit.
STEEPEST_MM_S2 = 100
RUNNING = "running"
# Between two frames further apart than this, the position is unknown.
FARTHEST_APART_S = 1.5
# For so long after the newest frame, the position is extrapolated at the wave's speed.
AHEAD_S = 1.0
# After so many turns without an index, the cam shaft does not follow the motor.
LONGEST_TURN = 1.3
_KEPT = 60


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

    @property
    def entries(self) -> dict[str, str]:
        """A header's lines on the wave that this program drives."""
        return {"wave_speed_mm_s": f"{self.speed_mm_s:g}", "wave_direction": self.direction}


class Drive:
    """The wave, which a peristalsis board drives.

    The board has a lease: it stops the wave by itself if this program dies or is stopped. A thread
    renews the lease while the main thread is busy, but stops the wave if the main thread hangs. It
    asks for the position only if nothing was sent for `RENEW_AFTER_S`, and never starts a wave: a
    wave whose lease has ended stays stopped. If the program is killed or stopped, so is the thread.
    """

    def __init__(self, board: Board, wave: Wave, log: FrameLog, restarts: int = 0) -> None:
        self._board, self._wave, self._log = board, wave, log
        # Set once no wave is wanted any more.
        self._over = threading.Event()
        # Looks of the thread since the main thread last served the wave; no clock: a program that
        # was stopped (Ctrl-Z) does not hang.
        self._looks = 0
        self._asked_s = 0.0
        self._known_s = AWAKE.now_s()
        self._left = False
        self._most_restarts, self._restarts = restarts, 0
        self._position: Position | None = None
        # Why no wave runs, as far as `serve` knows; empty if it runs.
        self.fault = ""
        self._asked_at = self._ran_until = 0.0
        wavelength_mm = float(board.identity.entries["wavelength_mm"])
        self.phase = WavePhase(wavelength_mm, forward=wave.direction == "forward")

    @property
    def until(self) -> str:
        """Time of the recording, in s, from which on no wave is known to run; `TO_THE_END`."""
        return f"{self._ran_until:.1f}" if self.fault else TO_THE_END

    def summary(self) -> str:
        """Return position and speed of the wave in words."""
        if self.fault or self._position is None:
            return "no wave" if self.fault else ""
        return f"wave {self._position.position_mm:.0f} mm at {self._position.speed_mm_s:.1f} mm/s"

    def set_up(self) -> None:
        """Send the board its settings and its lease.

        Raises
        ------
        AcquisitionError
            The board refuses, with its reason, or was disconnected.
        """
        for setting in self._wave.commands:
            self._board.request(setting)
        try:
            self._board.request(f"lease,{LEASE_S}")
        except RefusedError as reason:  # of a firmware that is too old to know leases
            self._log.tell(f"warning: the wave will not stop if this computer fails: {reason}")

    def start(self) -> None:
        """Start the wave; errors as in `set_up`."""
        self._board.request("start")
        # A daemon: the lease must end with the program.
        threading.Thread(target=self._renew, name="lease", daemon=True).start()
        self._known_s = AWAKE.now_s()

    def _renew(self) -> None:
        while not self._over.wait(LOOK_EVERY_S):
            self.look()

    def look(self) -> None:
        """Renew the lease if nothing else did; stop the wave if the main thread hangs."""
        self._looks += 1
        if line := self._board.line:
            # The main thread notices a lost line, and says so.
            with contextlib.suppress(LineLostError):
                if self._looks * LOOK_EVERY_S > HANGS_AFTER_S:
                    line.send("stop")
                elif time.monotonic() - line.sent_s > RENEW_AFTER_S:
                    line.send("position")

    def serve(self, recorded_s: float = 0.0) -> None:
        """Read the board's frames, and ask for the wave's position, which renews the lease."""
        self._looks = 0
        for arrival in self._board.read():
            self._take(arrival)
        now_s = AWAKE.now_s()
        if now_s - self._asked_s >= ASK_EVERY_S:
            self._asked_s, self._asked_at = now_s, recorded_s
            self._board.send("position")
        self.fault = self._fault()

    def stop(self) -> None:
        """Command the board to stop the wave, and return at once."""
        if not self._over.is_set():
            self._over.set()
            self._board.want(f"ramp,{STEEPEST_MM_S2}", "stop")

    def trouble(self, patience_s: float) -> AcquisitionError | None:
        """Return the error that ends the survey; None if it can continue."""
        if self._restarts > self._most_restarts:
            return AcquisitionError(
                f"{self._board.name} was reset or unplugged again and again, and the wave stopped "
                f"{self._restarts} times; check its supply and its cable"
            )
        if self._over.is_set():
            return None
        if lost := self._board.loss(patience_s):
            return lost
        if AWAKE.now_s() - self._known_s > patience_s:
            return BoardLostError(
                f"the phase of the wave has not been known for {patience_s:.0f} s (--patience): "
                "the peristalsis board was reset and has no index switch, or its motor is blocked"
            )
        return None

    def leave(self) -> str:
        """Stop the wave, wait, and close the port; return a warning if the board does not obey.

        It is never started again. It can be called more than once.
        """
        if self._left:
            return ""
        self._left = True
        self._over.set()
        try:
            self._look_once_more()
            self._board.request("stop")
        except AcquisitionError as fault:
            return (
                f"warning: the wave could not be stopped: {fault}; it stops when its lease ends. "
                "If it does not, cut the motor's power"
            )
        finally:
            self._board.close()
        return ""

    def _take(self, arrival: Arrival) -> None:
        match arrival.event:
            case Position() as position:
                self._note_position(position, arrival.moment_s)
            case Identity() if arrival.fresh:
                self.phase.begin_anew()
                self._run_again("is back")
            case Damaged() as piece:
                self._log.damaged(piece)
            case Refusal(command=command, reason=reason):
                self._log.note(f"the peristalsis board refuses {command!r}: {reason}")

    def _note_position(self, position: Position, arrived_s: float) -> None:
        self._position = position
        continues = self.phase.note(position, arrived_s)
        if self.phase.known:
            self._known_s = AWAKE.now_s()
        runs = position.state == RUNNING
        if runs:
            # The answer may have lain in the port; when it was asked for, the wave ran.
            self._ran_until = self._asked_at
        if not continues:
            self._run_again("was reset")
        elif not runs and not self._board.pending:
            self._run_again("had stopped the wave")

    def _run_again(self, because: str) -> None:
        """Start the wave again, but not for ever."""
        if self._over.is_set() or self._restarts > self._most_restarts:
            return
        self._restarts += 1
        if self._restarts <= self._most_restarts:
            self._log.tell(f"the peristalsis board {because}, so the survey starts the wave again")
            self._board.want(*self._wave.commands, f"lease,{LEASE_S}", "start")

    def _fault(self) -> str:
        """Return why no wave runs, or that the board says nothing; empty if the wave runs.

        The clock does not count the time in which this program was stopped (Ctrl-Z).
        """
        if not self._board.connected:
            return f"{self._board.name} was unplugged, so no wave runs"
        if self._board.silent_s > SILENT_AFTER_S:
            return f"{self._board.name} does not answer; check whether the wave still runs"
        if self._position is not None and self._position.state != RUNNING:
            return (
                "no wave runs: the peristalsis board was reset, or this program was stopped or "
                "hung for longer than the wave's lease. The recorder does not start it again; end "
                "the recording with Ctrl-C, and record anew"
            )
        return ""

    def _look_once_more(self) -> None:
        """Learn what the user should know of the wave before it stops."""
        self._board.send("position")
        for _ in range(LAST_LOOKS):
            for arrival in self._board.read(READ_TIMEOUT_S):
                self._take(arrival)
        self.fault = self._fault() or self.fault


class WavePhase:
    """The position of the wave over time, from the frames of the peristalsis board.

    The board counts half-steps from its start. With an index switch, the count at the last passage
    of the index tells the phase, even after a reset of the board or lost steps of the motor.
    Without one only the count tells the phase, and a reset loses it.
    """

    def __init__(self, wavelength_mm: float, *, forward: bool) -> None:
        self._wavelength_mm = wavelength_mm
        self._sign = 1.0 if forward else -1.0
        # Of each frame its time, the wave's position (NaN: unknown) and its speed.
        self._knots: deque[tuple[float, float, float]] = deque(maxlen=_KEPT)
        self.begin_anew()
        # Added to the board's count, it gives the wave's position; None after a reset.
        self._offset_mm: float | None = 0.0
        self._wave_mm = 0.0
        self._mm_per_half_step = (0, 0.0)
        # Phase at the index, also of an earlier session; None until the cam shaft has passed it.
        self.index_mm: float | None = None

    def begin_anew(self) -> None:
        """Forget all frames, because a reset set the board's count and clock to zero."""
        self._clock = BoardClock()
        self._knots.clear()
        self._offset_mm = None
        self.known = False

    def note(self, position: Position, arrived_s: float) -> bool:
        """Store a frame; return False if it shows that the board was reset."""
        continues = self._clock.continues(position.device_ms)
        if not continues:
            self.begin_anew()
        moment_s = self._clock.moment_s(position.device_ms, arrived_s)
        wave_mm = self._wave(position)
        self.known = not math.isnan(wave_mm)
        if self.known:
            self._wave_mm = wave_mm
        if not self._knots or moment_s > self._knots[-1][0]:
            self._knots.append((moment_s, wave_mm, self._sign * position.speed_mm_s))
        return continues

    def at(self, moments_s: np.ndarray) -> np.ndarray:
        """Return the wave's position at moments of the computer's clock; NaN: unknown."""
        if not self._knots:
            return np.full(moments_s.shape, np.nan)
        knots_s, way_mm, speeds_mm_s = np.array(self._knots).T
        wave_mm: np.ndarray = np.interp(moments_s, knots_s, way_mm)
        after = np.searchsorted(knots_s, moments_s, side="right")
        apart_s = np.diff(knots_s, prepend=-np.inf, append=np.inf)[after]
        wave_mm[apart_s > FARTHEST_APART_S] = np.nan
        beyond_s = moments_s - knots_s[-1]
        ahead = (after == knots_s.size) & (beyond_s <= AHEAD_S)
        wave_mm[ahead] = way_mm[-1] + speeds_mm_s[-1] * beyond_s[ahead]
        return wave_mm

    def _wave(self, position: Position) -> float:
        """Return the wave's position at a frame; NaN if its phase is unknown or no wave runs."""
        steps, counted_mm = position.half_steps, self._sign * position.position_mm
        # More half-steps give a more exact length of one half-step.
        if abs(steps) > self._mm_per_half_step[0]:
            self._mm_per_half_step = abs(steps), counted_mm / steps
        if position.index_half_steps is not None:
            turned_mm = counted_mm - position.index_half_steps * self._mm_per_half_step[1]
            if abs(turned_mm) > LONGEST_TURN * self._wavelength_mm:
                return math.nan
            self._fit(counted_mm, turned_mm)
        if self._offset_mm is None or position.state != RUNNING:
            return math.nan
        return counted_mm + self._offset_mm

    def _fit(self, counted_mm: float, turned_mm: float) -> None:
        """Correct the offset of the board's count by the index, passed `turned_mm` ago."""
        since_mm = self._offset_mm
        expected_mm = self._wave_mm if since_mm is None else counted_mm + since_mm
        if self.index_mm is None:
            if since_mm is None:
                return  # the board was reset before its first index
            self.index_mm = (expected_mm - turned_mm) % self._wavelength_mm
        # The index tells the phase only; the number of waves is the one nearest to expectation.
        phase_mm = turned_mm + self.index_mm
        turns = round((expected_mm - phase_mm) / self._wavelength_mm)
        self._offset_mm = phase_mm + turns * self._wavelength_mm - counted_mm
