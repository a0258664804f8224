"""The terminal: output that never blocks, and the display of a recording or survey."""

import atexit
import contextlib
import io
import math
import os
import queue
import shutil
import sys
import threading
from typing import TYPE_CHECKING, TextIO

from capsule import words
from capsule.bench.state import FLAT_SHARE, State
from capsule.detectors.verdicts import OF_SURVEY
from capsule.words import BARS, PLAIN_BARS, trace

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

REDRAW_EVERY_S = 0.2
LINE_EVERY_S = 10.0  # if the output cannot redraw: a log file, a pipe
MOST_PLACES = 6  # the last ones that are listed
WAITING_TEXTS = 200  # further texts are dropped until the terminal accepts output again
LAST_WORDS_S = 1.0
_PLAIN = str.maketrans(f"{BARS}{words.MINUS}", f"{PLAIN_BARS}-")


class PatientOutput(io.RawIOBase):
    """A file that a second thread writes, so that the caller never waits."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._texts: queue.Queue[bytes | None] = queue.Queue(WAITING_TEXTS)
        # A daemon: a terminal that accepts no output must not keep the program alive.
        self._writer = threading.Thread(target=self._write_all, daemon=True)
        self._writer.start()

    def isatty(self) -> bool:
        """Return whether this is a terminal."""
        return os.isatty(self._descriptor)

    def writable(self) -> bool:
        """Return True: text can be written."""
        return True

    def write(self, content: "ReadableBuffer", /) -> int:
        """Queue some bytes; drop them if the queue is full."""
        taken = bytes(content)
        with contextlib.suppress(queue.Full):
            self._texts.put_nowait(taken)
        return len(taken)

    def finish(self) -> None:
        """Wait a short time for the queued texts to be written."""
        with contextlib.suppress(queue.Full):
            self._texts.put(None, timeout=LAST_WORDS_S)
            self._writer.join(LAST_WORDS_S)

    def _write_all(self) -> None:
        while (content := self._texts.get()) is not None:
            # The output may be closed, or its disk full.
            with contextlib.suppress(OSError):
                while content:
                    content = content[os.write(self._descriptor, content) :]


def install() -> None:
    """Replace standard output by a `PatientOutput`, for the whole program."""
    try:
        descriptor, encoding = sys.stdout.fileno(), sys.stdout.encoding
    except (AttributeError, OSError, ValueError):  # closed before the program began
        descriptor, encoding = os.open(os.devnull, os.O_WRONLY), "utf-8"
    output = PatientOutput(descriptor)
    atexit.register(output.finish)
    sys.stdout = io.TextIOWrapper(output, encoding, "backslashreplace", write_through=True)


class Terminal:
    """A terminal that shows notes and, below them, the state of a recording or a survey."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.redraws = stream.isatty() and _can_redraw()
        self.every_s = REDRAW_EVERY_S if self.redraws else LINE_EVERY_S
        encoding = (getattr(stream, "encoding", None) or "ascii").lower()
        self._plain = not encoding.startswith("utf")
        self._drawn_lines = 0

    def note(self, text: str) -> None:
        """Print a note, which stays on the terminal."""
        self.clear()
        print(text.translate(_PLAIN) if self._plain else text, file=self._stream, flush=True)

    def show(self, state: State) -> None:
        """Show the state in place of the former one.

        If the terminal cannot redraw, a line shows a recording that goes on, and nothing a survey.
        """
        if self.redraws:
            lines = state_lines(state, shutil.get_terminal_size().columns - 1)
            self.note("\n".join(lines))
            self._drawn_lines = len(lines)
        elif not (state.doing or state.ended):
            self.note("\n".join([state.summary(), *_verdicts(state)]))

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


def state_lines(state: State, width: int) -> list[str]:
    """Return the lines that show the state, none of them longer than `width`."""
    of_recording = [state.summary(), *_sensor_lines(state, width), *_verdicts(state)]
    return [line[:width] for line in (_survey_lines(state) if state.doing else of_recording)]


def _verdicts(state: State) -> list[str]:
    return state.judgement.lines_so_far() if state.judgement else []


def _sensor_lines(state: State, width: int) -> list[str]:
    """Return each sensor's newest reading and trace, on which noise alone looks quiet."""
    known = [sample for sample in state.recent if sample is not None]
    lines = []
    for sensor, last in enumerate(known[-1] if known else ()):
        newest = f"{last:4d}" if isinstance(last, int) else f"{last:6.4g}"
        label = f"sensor {sensor + 1} {newest} "
        shown = list(state.recent)[-max(width - len(label), 1) :]
        readings = [None if sample is None else sample[sensor] for sample in shown]
        lines.append(label + trace(readings, BARS, FLAT_SHARE * state.full_scale))
    return lines


def _survey_lines(state: State) -> list[str]:
    """Return where the head is and what it does, what comes next, and the last places."""
    head = "head not found yet"
    if not math.isnan(state.head_mm):
        head = f"head {'' if state.head_known else 'last '}at {state.head_mm:.1f} mm"
    score = "no score" if math.isnan(state.score) else f"score {state.score:.3f}"
    lines = [
        f"{state.title}  {words.duration(state.time_s)}  {head}: {state.doing}",
        f"  {state.following}",
        "" if math.isnan(state.threshold) else f"{score}, threshold {state.threshold:.3f}",
    ]
    for number, status, place_mm, size in state.places[-MOST_PLACES:]:
        verdict = f"{OF_SURVEY.get(status, 'suspected')}{f', {size}' if size else ''}"
        lines.append(f"place {number} at {place_mm:.0f} mm: {verdict}")
    return [line for line in lines if line.strip()]
