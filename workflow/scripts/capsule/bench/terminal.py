"""The terminal: output that never blocks, lines redrawn in place, and the state of a recording."""

import atexit
import contextlib
import io
import os
import queue
import shutil
import sys
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TextIO

from capsule.words import BARS, PLAIN_BARS, trace

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


REDRAW_EVERY_S = 0.2
LINE_EVERY_S = 10.0  # if the output cannot redraw: a log file, a pipe
KEPT = 600


@dataclass
class Progress:
    """The state of a recording; the session writes it, terminal and window read it.

    Attributes
    ----------
    period_s : float
        Seconds between samples.
    end_s : float
        Time in seconds at which the recording ends by itself; 0 if it does not.
    samples : int
        Number of samples so far, missing samples included.
    missing, gaps, damaged : int
        Numbers of missing samples, of gaps, and of damaged frames.
    rate_hz : float
        Samples received per second of this computer's clock, over the last seconds.
    recent : deque of tuple of int, or None
        The last samples; None is a missing one.
    wave : str
        Position and speed of the wave; empty without a peristalsis board.
    verdicts : list of str
        Lines with the detectors' verdicts so far; empty without detectors.
    """

    period_s: float
    end_s: float = 0.0
    samples: int = 0
    missing: int = 0
    gaps: int = 0
    damaged: int = 0
    rate_hz: float = 0.0
    recent: deque[tuple[float, ...] | None] = field(default_factory=lambda: deque(maxlen=KEPT))
    wave: str = ""
    verdicts: list[str] = field(default_factory=list)

    def summary(self) -> str:
        """Return the state of the recording in one line."""
        now = _minutes(self.samples * self.period_s)
        parts = [
            f"{now} of {_minutes(self.end_s)}" if self.end_s else now,
            f"{self.samples} samples",
            f"{self.rate_hz:.1f} Hz",
            f"{self.gaps} gaps ({self.missing} samples missing)" if self.gaps else "no gap",
            f"{self.damaged} damaged frames" if self.damaged else "",
            self.wave,
        ]
        return " | ".join(part for part in parts if part)


def _minutes(seconds: float) -> str:
    return f"{int(seconds // 60):02d}:{seconds % 60:04.1f}"


class Terminal(LivePanel):
    """A terminal that shows notes and the recording's state, redrawn in place if possible.

    Parameters
    ----------
    stream : TextIO
        The output.
    full_scale : float
        The largest reading: the ADC's largest count, or for example 5 for readings in volts.
    """

    def __init__(self, stream: TextIO, full_scale: float) -> None:
        super().__init__(stream)
        # Noise of a few counts must not fill the height: a quiet sensor should look quiet.
        whole = isinstance(full_scale, int)
        self._least_span = max(full_scale // 100, 1) if whole else full_scale / 100
        self._bars = PLAIN_BARS if self.plain else BARS

    def show(self, progress: Progress) -> None:
        """Show the state, if the last display is old enough."""
        if not self.is_due(REDRAW_EVERY_S if self.redraws else LINE_EVERY_S):
            return
        if not self.redraws:
            self.note("\n".join([progress.summary(), *progress.verdicts]))
            return
        width = self.width
        verdicts = [line[:width] for line in progress.verdicts]
        self.draw([progress.summary()[:width], *self._sensor_lines(progress, width), *verdicts])

    def _sensor_lines(self, progress: Progress, width: int) -> list[str]:
        known = [sample for sample in progress.recent if sample is not None]
        if not known:
            return []
        lines = []
        for sensor in range(len(known[0])):
            last = known[-1][sensor]
            shown = f"{last:4d}" if isinstance(last, int) else f"{last:6.4g}"
            label = f"sensor {sensor + 1} {shown} "
            trace = list(progress.recent)[-max(width - len(label), 1) :]
            counts: list[float | None] = [
                None if sample is None else sample[sensor] for sample in trace
            ]
            lines.append((label + self.sparkline(counts))[:width])
        return lines

    def sparkline(self, counts: list[float | None]) -> str:
        """Return a trace as bars between its smallest and largest value.

        A missing sample is a space.
        """
        return trace(counts, self._bars, self._least_span)
