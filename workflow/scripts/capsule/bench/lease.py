"""The lease of the wave: the peristalsis board stops it if the computer dies."""

import threading
import time
from collections.abc import Callable

from capsule.bench.bench_errors import LineLostError, RefusedError
from capsule.bench.boards import request
from capsule.bench.line import Line

# Without a command for so long, the board stops the wave.
LEASE_S = 5
# The board is asked so often even if the program does something else, such as a slow write.
RENEW_AFTER_S = 1.5
LOOK_EVERY_S = 0.25


def take_lease(line: Line, tell: Callable[[str], None]) -> None:
    """Send the peristalsis board its lease; warn if its firmware is too old to know leases.

    Raises
    ------
    AcquisitionError, LineLostError
        As in `capsule.bench.boards.request`, but for a refusal.
    """
    try:
        request(line, f"lease,{LEASE_S}")
    except RefusedError as reason:
        tell(f"warning: the wave will not stop if this computer fails: {reason}")


class LeaseKeeper:
    """A thread that renews the lease of the wave while the main thread is busy.

    It asks for the position only if nothing was sent for `RENEW_AFTER_S`. It never starts a wave:
    a wave whose lease has ended stays stopped. If the program is killed or stopped, the thread is
    too.

    Parameters
    ----------
    line_of : callable
        Function that returns the board's line, or raises `LineLostError`.
    """

    def __init__(self, line_of: Callable[[], Line]) -> None:
        self._line_of = line_of
        self._ended = threading.Event()
        # A daemon: the lease must end with the program.
        self._thread = threading.Thread(target=self._renew, name="lease", daemon=True)

    def start(self) -> None:
        """Begin to renew the lease."""
        self._thread.start()

    def end(self) -> None:
        """Renew the lease no longer; it can be called more than once."""
        self._ended.set()

    def _renew(self) -> None:
        while not self._ended.wait(LOOK_EVERY_S):
            try:
                line = self._line_of()
                if time.monotonic() - line.sent_s > RENEW_AFTER_S:
                    line.send("position")
            except LineLostError:
                continue  # the main thread notices it, and says so
