"""The computer's clocks, for gaps in recordings and for waiting times, and requests to stop."""

import os
import signal
import socket
import sys
import threading
import time
from types import FrameType

LONGEST_STEP_S = 0.25
# A longer pause than this is no slow disk: the program was stopped.
LONGEST_STOP_S = 1.0


def elapsed_s() -> float:
    """Return the seconds of a clock that never jumps.

    If the system has such a clock, it also counts the time in which the computer sleeps.
    """
    boot_time = getattr(time, "CLOCK_BOOTTIME", None)
    return time.monotonic() if boot_time is None else time.clock_gettime(boot_time)


class AwakeClock:
    """A clock that counts only the seconds in which this program was running.

    The program reads it many times a second. A longer pause between two readings means that the
    program was stopped (Ctrl-Z, a suspended computer). Such a pause counts as a quarter of a
    second.
    """

    def __init__(self) -> None:
        self._asked_s = elapsed_s()
        self._awake_s = self._away_s = 0.0

    def now_s(self) -> float:
        """Return the seconds counted so far."""
        now_s = elapsed_s()
        passed_s, self._asked_s = now_s - self._asked_s, now_s
        self._awake_s += min(passed_s, LONGEST_STEP_S)
        self._away_s += passed_s if passed_s > LONGEST_STOP_S else 0.0
        return self._awake_s

    def pause_s(self) -> float:
        """Return the seconds for which the program was stopped since this was last asked."""
        self.now_s()
        paused_s, self._away_s = self._away_s, 0.0
        return paused_s


AWAKE = AwakeClock()


_LAST_WORDS = (
    b"\nerror: ended at once by a second Ctrl-C: the boards stop by themselves within seconds; for "
    b"the samples on the disk, run: capsule record --recover, or capsule survey --resume\n"
)


class StopRequest:
    """A request by Ctrl-C, SIGTERM or SIGHUP to end the recording; `reason` names it.

    The second Ctrl-C ends the program at once, even if its main thread hangs in a call of the
    system: a thread of its own counts them.
    """

    def __init__(self) -> None:
        self.reason = ""
        heard, told = socket.socketpair()
        told.setblocking(False)
        # Python writes the number of each signal, whatever the main thread does.
        signal.set_wakeup_fd(told.fileno(), warn_on_full_buffer=False)
        self._told = told
        threading.Thread(target=_end_at_the_second, args=(heard,), daemon=True).start()
        known = [name for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
        numbers = [signal.Signals[name] for name in known]
        self._former = {number: signal.signal(number, self._note) for number in numbers}

    def close(self) -> None:
        """Count no more, because the recording is over: each signal does what it did before."""
        for number, handler in self._former.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(-1)
        self._told.close()

    def _note(self, number: int, frame: FrameType | None) -> None:
        del frame
        self.reason = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name


def _end_at_the_second(heard: socket.socket) -> None:
    pressed = 0
    with heard:
        while pressed < 2:
            number = heard.recv(1)
            if not number:
                return
            pressed += number == bytes([signal.SIGINT])
    os.write(sys.stderr.fileno(), _LAST_WORDS)
    os._exit(128 + signal.SIGINT)
