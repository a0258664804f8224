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
from capsule.survey.cycle import FOLDED_STATES, STATES
from capsule.words import BARS, PLAIN_BARS, trace

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

REDRAW_EVERY_S = 0.2
LINE_EVERY_S = 10.0  # if the output cannot redraw: a log file, a pipe
WAITING_TEXTS = 200  # further texts are dropped until the terminal accepts output again
LAST_WORDS_S = 1.0


class PatientOutput(io.RawIOBase):
    """A file that a second thread writes, so that the caller never waits."""

    def __init__(self, descriptor: int | None) -> None:
        self._descriptor = descriptor
        self._texts: queue.Queue[bytes | None] = queue.Queue(WAITING_TEXTS)
        # A daemon: a terminal that accepts no output must not keep the program alive.
        self._writer = threading.Thread(target=self._write_all, daemon=True)
        self._writer.start()

    def isatty(self) -> bool:
        """Return whether this is a terminal."""
        return self._descriptor is not None and os.isatty(self._descriptor)

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
        print(text, file=self._stream, flush=True)

    def show(self, state: State) -> None:
        """Show the state in place of the former one.

        If the terminal cannot redraw, a line shows a recording that goes on, and nothing a survey.
        """
        if not self.redraws:
            if not (state.doing or state.ended):
                self.note("\n".join([state.summary(), *_verdicts(state)]))
            return
        width = shutil.get_terminal_size().columns - 1
        lines = state_lines(state, width, plain=self._plain)
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


# Number of places that the display lists.
_PLACES = 6
# Step in mm by which the bar grows if the length of the gut is unknown.
_STRETCH_MM = 250.0
# The bar of the score ends at this multiple of the threshold.
_THRESHOLDS = 3
_MARKS = {"confirmed": "●", "dismissed": "○", "undecided": "◇", "": "?"}
_PLAIN = str.maketrans(f"{BARS}●○◇━─▶◀│·{words.MINUS}", f"{PLAIN_BARS}*oU=-><|.-")


def state_lines(state: State, width: int, *, plain: bool = False) -> list[str]:
    """Return the lines that show the state, none of them longer than `width`."""
    if state.doing:
        lines = _survey_lines(state, width)
    else:
        lines = [state.summary(), *_sensor_lines(state, width), *_verdicts(state)]
    short = [line[:width] for line in lines]
    return [line.translate(_PLAIN) for line in short] if plain else short


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


def _survey_lines(state: State, width: int) -> list[str]:
    """Return where the head is and what it does, the gut, the score, and the last places."""
    head = "head not found yet"
    if not math.isnan(state.head_mm):
        last = "" if state.head_known else "last "
        head = f"head {last}at {words.number(state.head_mm, 1)} mm"
    first = f"{state.title}  {words.duration(state.time_s)}  {head}: {STATES[state.doing]}"
    lines = [first, _gut_bar(state, width), _score_bar(state, width)]
    for number, status, place_mm, size in state.places[: -_PLACES - 1 : -1]:
        verdict = f"{OF_SURVEY.get(status, 'suspected')}{f', {size}' if size else ''}"
        lines.append(f"{_MARKS[status]} place {number} at {place_mm:.0f} mm: {verdict}")
    if len(state.places) > _PLACES:
        lines.append(f"  and {len(state.places) - _PLACES} before")
    return lines


def _gut_bar(state: State, width: int) -> str:
    """Return a bar of the gut: the part passed so far, the places, the head and its direction."""
    reached_mm = max([0.0, *(place_mm for _, _, place_mm, _ in state.places)])
    if not math.isnan(state.head_mm):
        reached_mm = max(reached_mm, state.head_mm)
    length_mm = state.length_mm
    if math.isinf(length_mm):
        length_mm = _STRETCH_MM * (reached_mm // _STRETCH_MM + 1)
    end = f" {length_mm:.0f} mm"
    cells = max(width - len(end) - 2, 10)

    def cell_of(place_mm: float) -> int:
        return min(max(int(place_mm / length_mm * cells), 0), cells - 1)

    passed = cell_of(reached_mm)
    bar = ["━" if at <= passed else "─" for at in range(cells)]
    for _, status, place_mm, _ in state.places:
        bar[cell_of(place_mm)] = _MARKS[status]
    if not math.isnan(state.head_mm):
        bar[cell_of(state.head_mm)] = "◀" if state.doing in FOLDED_STATES else "▶"
    return f"0 {''.join(bar)}{end}"


def _score_bar(state: State, width: int) -> str:
    """Return a bar of the score, with a mark at the threshold."""
    score = "none" if math.isnan(state.score) else words.number(state.score, 3)
    label, end = f"score {score:<6}", f" threshold {state.threshold:.3f}"
    cells = max(min(width - len(label) - len(end), 60), 9)
    mark = cells // _THRESHOLDS
    filled = 0
    if not math.isnan(state.score):
        filled = min(max(round(state.score / state.threshold * mark), 0), cells)
    bar = ["█" if at < filled else "·" for at in range(cells)]
    if filled <= mark:
        bar[mark] = "│"
    return f"{label}{''.join(bar)}{end}"
