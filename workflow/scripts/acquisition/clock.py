"""The computer's clock that measures gaps."""

import time


def elapsed_s() -> float:
    """Give seconds that never jump, and go on while the computer sleeps where the system can."""
    boot_time = getattr(time, "CLOCK_BOOTTIME", None)
    return time.monotonic() if boot_time is None else time.clock_gettime(boot_time)
