"""Lines on a terminal that are drawn anew in their place, and plain lines where it cannot."""

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
        Where to write.

    Attributes
    ----------
    redraws : bool
        Whether lines can be drawn anew in their place.
    plain : bool
        Whether the terminal knows no more than ASCII.
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
        """How many characters a line may have."""
        return shutil.get_terminal_size().columns - 1

    def is_due(self, every_s: float) -> bool:
        """Say whether it is time to draw again, and if so take note of the time."""
        now_s = time.monotonic()
        if now_s - self._shown_s < every_s:
            return False
        self._shown_s = now_s
        return True

    def note(self, text: str) -> None:
        """Say something that stays."""
        self.clear()
        print(text, file=self._stream, flush=True)

    def draw(self, lines: Sequence[str]) -> None:
        """Draw lines in the place of those before."""
        self.clear()
        print("\n".join(lines), file=self._stream, flush=True)
        self._drawn_lines = len(lines)

    def clear(self) -> None:
        """Take the lines away."""
        if self._drawn_lines:
            self._stream.write(f"\x1b[{self._drawn_lines}A\x1b[J")
            self._drawn_lines = 0

    def leave(self) -> None:
        """Let the lines stand: what follows comes below them."""
        self._drawn_lines = 0


def _can_redraw() -> bool:
    if sys.platform != "win32":
        return True
    import ctypes

    # Windows 10 and later understand escape sequences once they are switched on.
    kernel = ctypes.windll.kernel32
    return bool(kernel.SetConsoleMode(kernel.GetStdHandle(-11), 7))
