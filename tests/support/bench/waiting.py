"""Wait for a condition, with a time limit and a plain error."""

import time
from collections.abc import Callable

_LONGEST_S = 30.0
_ASK_EVERY_S = 0.02


def wait_until(happened: Callable[[], bool], what: str) -> None:
    """Wait for a condition; raise `TimeoutError` if it does not hold in time."""
    until_s = time.monotonic() + _LONGEST_S
    while not happened():
        if time.monotonic() > until_s:
            raise TimeoutError(f"in {_LONGEST_S:g} s there were no {what}")
        time.sleep(_ASK_EVERY_S)
