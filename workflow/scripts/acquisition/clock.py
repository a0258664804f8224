"""The computer's clocks: one measures gaps, one measures patience."""

import time

LONGEST_STEP_S = 0.25


def elapsed_s() -> float:
    """Give seconds that never jump, and go on while the computer sleeps where the system can."""
    boot_time = getattr(time, "CLOCK_BOOTTIME", None)
    return time.monotonic() if boot_time is None else time.clock_gettime(boot_time)


class AwakeClock:
    """Counts the seconds in which this program could act.

    It is asked many times a second. A longer silence between two questions means that the program
    was stopped (Ctrl-Z, a suspended machine), and counts as a quarter of a second.
    """

    def __init__(self) -> None:
        self._asked_s = time.monotonic()
        self._awake_s = 0.0

    def now_s(self) -> float:
        """Give the seconds so far."""
        now_s = time.monotonic()
        self._awake_s += min(now_s - self._asked_s, LONGEST_STEP_S)
        self._asked_s = now_s
        return self._awake_s


AWAKE = AwakeClock()
