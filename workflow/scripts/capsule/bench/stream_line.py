"""A stream of the Lab Streaming Layer in place of a logger's serial line."""

import math
from collections.abc import Callable
from types import ModuleType
from typing import TYPE_CHECKING

from capsule.bench.bench_errors import BoardNotFoundError, WrongBoardError
from capsule.bench.clock import AWAKE, elapsed_s
from capsule.bench.line import Arrival
from capsule.bench.lsl import import_pylsl
from capsule.bench.protocol import Acknowledgement, Damaged, Event, Sample
from capsule.bench.stamp_grid import StampGrid
from capsule.bench.stream_choice import ALONE_S, FIND_S, ChosenStream, choose, find_stream
from capsule.bench.timeline import CLOCK_ENDS_MS, COUNTER_ENDS
from capsule.kinds import Settings

if TYPE_CHECKING:
    import pylsl

BAUD = 0  # a stream has none
PULL_S = 0.05
LOOK_S = 0.2
OPEN_S = 5.0
SILENT_S = 2.5
_MOST_SAMPLES = 1024


class StreamLine:
    """A stream with the interface of a `Line`.

    A time stamp tells the period of a sample, so samples lost on the way leave a gap. If a source
    ends and starts again, this class finds it again. The Lab Streaming Layer does this itself if
    the source has an id; otherwise the name is searched.

    Parameters
    ----------
    name : str
        The stream's name or source id.
    wanted : str or None
        Channels, as in `choose`.
    rules : mapping
        Section ``recording`` of the configuration.

    Attributes
    ----------
    port : str
        Name of the stream for messages.
    identity : Identity
        Description of the stream in the form of a logger's.
    header : callable
        `ChosenStream.header`.
    full_scale : float
        Approximate largest reading.
    tell : callable
        Function that shows a message when the stream ends or is back.

    Raises
    ------
    AcquisitionError
        There is no such stream, or it does not fit.
    """

    baud = BAUD

    def __init__(self, name: str, wanted: str | None, rules: Settings) -> None:
        self._lsl: ModuleType = import_pylsl("--stream-in")
        self._name, self._wanted, self._rules = name, wanted, rules
        self._inlet, self.chosen = self._open(FIND_S, ALONE_S)
        self.port, self.identity = self.chosen.title, self.chosen.identity()
        self.header, self.full_scale = self.chosen.header, self.chosen.full_scale
        self.tell: Callable[[str], None] = print
        self._period_s = 1.0 / rules["rate_hz"]
        self._grid = StampGrid(self._period_s)
        self._answers: list[Arrival] = []
        self._heard_s = AWAKE.now_s()
        self._away = False

    def receive(self, timeout_s: float = PULL_S) -> list[Arrival]:
        """Read the events that have arrived; wait up to the timeout for the first."""
        answers, self._answers = self._answers, []
        samples, stamps = self._pull(timeout_s)
        moment_s, now_s = elapsed_s(), AWAKE.now_s()
        if stamps:
            self._heard_s = now_s
            if self._away:
                self._away = False
                self.tell(f"{self.port} is back; the recording continues in the same file")
        elif now_s - self._heard_s > SILENT_S:
            self._note_away("sends nothing")
        taken = zip(samples, stamps, strict=True)
        return answers + [Arrival(self._event(*each), moment_s) for each in taken]

    def send(self, payload: str) -> None:
        """Answer a command in place of the stream, which accepts none."""
        if payload == "pause":
            self._answers.append(Arrival(Acknowledgement("pause", ""), elapsed_s()))

    def close(self) -> list[Damaged]:
        """Close the stream."""
        if self._inlet is not None:
            self._inlet.close_stream()
        return []

    def _open(self, wait_s: float, alone_s: float) -> tuple["pylsl.StreamInlet", ChosenStream]:
        info = find_stream(self._lsl, self._name, wait_s, alone_s)
        # Without the layer's smoothing of stamps, which treats a lost sample as jitter.
        inlet = self._lsl.StreamInlet(info, processing_flags=self._lsl.proc_clocksync)
        try:
            chosen = choose(inlet.info(OPEN_S), self._wanted, self._rules)
            inlet.open_stream(OPEN_S)
            # The first correction takes almost a second; later ones run in the background.
            inlet.time_correction(OPEN_S)
        except (TimeoutError, self._lsl.util.LostError) as fault:
            raise BoardNotFoundError(
                f"the LSL stream {self._name!r} ended while it was opened ({fault}); start its "
                "source again"
            ) from None
        return inlet, chosen

    def _pull(self, timeout_s: float) -> tuple[list[list[float]], list[float]]:
        if self._inlet is None and not self._find_again():
            return [], []
        try:
            pulled: tuple[list[list[float]], list[float]]
            pulled = self._inlet.pull_chunk(timeout_s, _MOST_SAMPLES)
            return pulled
        except self._lsl.util.LostError:
            self._inlet = None
            self._note_away("has ended")
        except TimeoutError:
            # A source that has just started again does not yet answer questions about its clock.
            self._note_away("does not report its clock")
        return [], []

    def _find_again(self) -> bool:
        try:
            inlet, chosen = self._open(LOOK_S, 0.0)
        except BoardNotFoundError:
            return False
        except WrongBoardError as reason:
            self._note_away(f"is another one now ({reason})")
            return False
        if (chosen.channels, chosen.unit) != (self.chosen.channels, self.chosen.unit):
            self._note_away("is another one now, with other channels or units")
            inlet.close_stream()
            return False
        self._inlet = inlet
        return True

    def _note_away(self, what: str) -> None:
        if not self._away:
            self._away = True
            self.tell(
                f"{self.port} {what}; start its source again before --patience ends, or end the "
                "recording with Ctrl-C"
            )

    def _event(self, values: list[float], stamp_s: float) -> Event:
        number = self._grid.number(stamp_s)
        chosen = tuple(values[index] for index in self.chosen.channels)
        if not all(map(math.isfinite, chosen)):
            return Damaged(repr((stamp_s, chosen)).encode(), "a reading is not a number")
        device_ms = round(1000.0 * number * self._period_s) % CLOCK_ENDS_MS
        return Sample(number % COUNTER_ENDS, device_ms, chosen, False)
