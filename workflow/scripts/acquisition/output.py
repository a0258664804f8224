"""Standard output that never holds up a recording, whether its terminal is stopped or closed."""

import atexit
import contextlib
import io
import os
import queue
import sys
import threading

WAITING_TEXTS = 200  # more is thrown away, until the terminal takes output again
LAST_WORDS_S = 1.0


class PatientOutput(io.TextIOBase):
    """Text that another thread writes, as fast as it is taken.

    Parameters
    ----------
    descriptor : int or None
        Where to write; None where standard output is closed.
    encoding : str
        The terminal's.
    """

    def __init__(self, descriptor: int | None, encoding: str) -> None:
        self._descriptor = descriptor
        self._encoding = encoding
        self._texts: queue.Queue[bytes | None] = queue.Queue(WAITING_TEXTS)
        # A daemon: a terminal that never takes output again must not keep the program alive.
        self._writer = threading.Thread(target=self._write_all, daemon=True)
        self._writer.start()

    # The types have an attribute to be written; Python's own streams have one to be read.
    @property
    def encoding(self) -> str:  # type: ignore[override]
        """The terminal's encoding."""
        return self._encoding

    def isatty(self) -> bool:
        """Say whether this is a terminal."""
        return self._descriptor is not None and os.isatty(self._descriptor)

    def writable(self) -> bool:
        """Say that text may be written."""
        return True

    def write(self, text: str) -> int:
        """Hand on a text, or lose it where nobody takes what came before."""
        with contextlib.suppress(queue.Full):
            self._texts.put_nowait(text.encode(self._encoding, "backslashreplace"))
        return len(text)

    def finish(self) -> None:
        """Wait a moment until everything is written."""
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
                self._descriptor = None  # closed, or full: nobody will ever read it


def install() -> None:
    """Put it in place of standard output, for the whole program."""
    try:
        descriptor = sys.stdout.fileno()
        encoding = sys.stdout.encoding
    except (AttributeError, OSError, ValueError):  # closed before the program began
        descriptor, encoding = None, "utf-8"
    output = PatientOutput(descriptor, encoding)
    atexit.register(output.finish)
    sys.stdout = output
