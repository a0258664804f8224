"""Lines that a terminal redraws in place; plain lines if it cannot."""

import shutil
import sys
import time
from collections.abc import Sequence
from typing import TextIO


class LivePanel:
    """The last lines of a terminal.

    Parameters
    ----------
    stream : TextIO
        The output.

    Attributes
    ----------
    redraws : bool
        Whether the terminal can redraw lines in place.
    plain : bool
        Whether the terminal shows ASCII only.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.redraws = stream.isatty() and _can_redraw()
        encoding = (getattr(stream, "encoding", None) or "ascii").lower()
        self.plain = not encoding.startswith("utf")
        self._drawn_lines = 0
        self._shown_s = 0.0

    @property
    def width(self) -> int:
        """Largest number of characters in a line."""
        return shutil.get_terminal_size().columns - 1

    def is_due(self, every_s: float) -> bool:
        """Return whether the last drawing is `every_s` seconds old; if so, restart the interval."""
        now_s = time.monotonic()
        if now_s - self._shown_s < every_s:
            return False
        self._shown_s = now_s
        return True

    def note(self, text: str) -> None:
        """Print a note, which stays on the terminal."""
        self.clear()
        print(text, file=self._stream, flush=True)

    def draw(self, lines: Sequence[str]) -> None:
        """Draw lines in place of the earlier ones."""
        self.clear()
        print("\n".join(lines), file=self._stream, flush=True)
        self._drawn_lines = len(lines)

    def clear(self) -> None:
        """Remove the lines."""
        if self._drawn_lines:
            self._stream.write(f"\x1b[{self._drawn_lines}A\x1b[J")
            self._drawn_lines = 0

    def leave(self) -> None:
        """Keep the lines on the terminal; later output comes below them."""
        self._drawn_lines = 0


def _can_redraw() -> bool:
    if sys.platform != "win32":
        return True
    import ctypes

    # Windows 10 and later understand escape sequences once they are switched on.
    kernel = ctypes.windll.kernel32
    return bool(kernel.SetConsoleMode(kernel.GetStdHandle(-11), 7))
