"""Standard output that never blocks a recording, even if its terminal is stopped or closed."""

import atexit
import contextlib
import io
import os
import queue
import sys
import threading

WAITING_TEXTS = 200  # further texts are dropped until the terminal accepts output again
LAST_WORDS_S = 1.0


class PatientOutput(io.TextIOBase):
    """A text stream that a second thread writes, so that the caller never waits.

    Parameters
    ----------
    descriptor : int or None
        File descriptor of the output; None if standard output is closed.
    encoding : str
        The terminal's encoding.
    """

    def __init__(self, descriptor: int | None, encoding: str) -> None:
        self._descriptor = descriptor
        self._encoding = encoding
        self._texts: queue.Queue[bytes | None] = queue.Queue(WAITING_TEXTS)
        # A daemon: a terminal that accepts no output must not keep the program alive.
        self._writer = threading.Thread(target=self._write_all, daemon=True)
        self._writer.start()

    # Typeshed declares a writable attribute, but Python's own streams have a read-only one.
    @property
    def encoding(self) -> str:  # type: ignore[override]
        """The terminal's encoding."""
        return self._encoding

    def isatty(self) -> bool:
        """Return whether this is a terminal."""
        return self._descriptor is not None and os.isatty(self._descriptor)

    def writable(self) -> bool:
        """Return True: text can be written."""
        return True

    def write(self, text: str) -> int:
        """Queue a text; drop it if the queue is full."""
        with contextlib.suppress(queue.Full):
            self._texts.put_nowait(text.encode(self._encoding, "backslashreplace"))
        return len(text)

    def finish(self) -> None:
        """Wait a short time for the queued texts to be written."""
        try:
            self._texts.put(None, timeout=LAST_WORDS_S)
        except queue.Full:
            return
        self._writer.join(LAST_WORDS_S)

    def _write_all(self) -> None:
        while (content := self._texts.get()) is not None:
            try:
                while content and self._descriptor is not None:
                    content = content[os.write(self._descriptor, content) :]
            except OSError:
                self._descriptor = None  # the output is closed, or its disk is full


def install() -> None:
    """Replace standard output by a `PatientOutput`, for the whole program."""
    try:
        descriptor = sys.stdout.fileno()
        encoding = sys.stdout.encoding
    except (AttributeError, OSError, ValueError):  # closed before the program began
        descriptor, encoding = None, "utf-8"
    output = PatientOutput(descriptor, encoding)
    atexit.register(output.finish)
    sys.stdout = output
