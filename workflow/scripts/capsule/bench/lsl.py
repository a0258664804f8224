"""Streams of the Lab Streaming Layer: record from one in place of a board, and send samples."""

import importlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import ModuleType
from typing import TYPE_CHECKING

from capsule.bench.bench_errors import AcquisitionError, BoardNotFoundError, WrongBoardError
from capsule.bench.clock import AWAKE, elapsed_s
from capsule.bench.line import Arrival
from capsule.bench.logger import Source
from capsule.bench.protocol import Damaged, Event, Sample
from capsule.bench.state import State
from capsule.bench.timeline import CLOCK_ENDS_MS, COUNTER_ENDS
from capsule.engine.project import how_to_install, not_installed
from capsule.kinds import Settings
from capsule.recordings.recording import column_names
from capsule.recordings.scaling import scales

if TYPE_CHECKING:
    import pylsl

EXTRA = how_to_install("lsl")
FIND_S = 5.0
# Wait for a second stream of the same name, which may miss the first request.
ALONE_S = 1.5
# Element of a stream's description with the entries of its board; `SampleOutlet` writes it.
BOARD, BOARD_ENTRIES = "capsule", ("adc_bits", "vref_v", "series_ohm")
_ALL_BITS = 32  # for readings of unknown full scale
# The largest reading in the terminal's display, by unit; counts have 10 bits by default.
_FULL_SCALES = {"V": 5.0, "ohm": 24_000.0, "kohm": 24.0}
_USUAL_BITS = 10
_UNITS = {"counts": "counts", "v": "V", "volt": "V", "volts": "V", "ohm": "ohm", "ohms": "ohm"}
_UNITS |= {"kohm": "kohm", "kohms": "kohm", "": ""}
_IMPORT = "record it with LabRecorder, then import the XDF file: capsule import"
_LONGEST = 100
LOOK_S = 0.2
OPEN_S = 5.0
SILENT_S = 2.5
_MOST_SAMPLES = 1024
# Indices of channels, and entries of a header.
_Choice = tuple[tuple[int, ...], dict[str, str]]
# Share of a stamp's deviation by which the grid moves: it follows drift, but hardly jitter.
_GAIN = 0.1


def import_pylsl(option: str) -> ModuleType:
    """Import pylsl for an option; raise `CapsuleError` if that fails."""
    try:
        return importlib.import_module("pylsl")
    except ModuleNotFoundError:
        raise not_installed(f"{option} needs pylsl", "lsl") from None
    except (RuntimeError, OSError) as fault:
        # pylsl is there, but the library liblsl that it loads is not.
        reason = str(fault).partition("\n")[0]
        raise AcquisitionError(
            f"{option} needs the library liblsl, which pylsl cannot load ({reason}); install it "
            "from github.com/sccn/liblsl/releases, or with: conda install -c conda-forge liblsl"
        ) from None


class StampGrid:
    """An even grid that numbers time stamps by periods and follows a clock that drifts.

    A stamp may jitter by less than half a period. The grid moves with the stamps. So a clock that
    is wrong by a part in a thousand neither adds nor loses a sample.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._last_s: float | None = None  # time of the last stamp's grid point
        self._number = 0

    def number(self, stamp_s: float) -> int:
        """Return the number of a stamp's period, from 0; it can be lower than the last one."""
        if self._last_s is None:
            self._last_s = stamp_s
            return 0
        passed = (stamp_s - self._last_s) / self._period_s
        steps = round(passed)
        self._last_s += (steps + _GAIN * (passed - steps)) * self._period_s
        self._number += steps
        return self._number


def title_of(info: "pylsl.StreamInfo") -> str:
    """Return the name of a stream for messages."""
    return f"the LSL stream {plain(info.name())!r}"


def plain(text: str) -> str:
    """Return a text from a stream as one printable line of limited length, for a header."""
    return "".join(each for each in " ".join(text.split()) if each.isprintable())[:_LONGEST]


def find_stream(
    lsl: ModuleType, name: str, wait_s: float, alone_s: float = ALONE_S
) -> "pylsl.StreamInfo":
    """Find a stream by its name or source id; with `alone_s` 0, take the first of that name.

    Raises
    ------
    BoardNotFoundError
        There is no such stream, or there are several.
    """
    query = f"name='{name}' or source_id='{name}'"
    streams = lsl.resolve_bypred(query, 1, wait_s)
    # The search ended with the first answer, so look once more for a second stream.
    if streams and alone_s:
        streams = lsl.resolve_bypred(query, 2, alone_s) or streams
    if len(streams) == 1:
        return streams[0]
    if not streams:
        raise BoardNotFoundError(
            f"there is no LSL stream {name!r}; start its source, or name another one with "
            "--stream-in. Both computers must be in the same network, and no firewall between them"
        )
    told = ", ".join(
        f"source id {plain(each.source_id())!r} at {plain(each.hostname())}" for each in streams
    )
    raise BoardNotFoundError(
        f"there are {len(streams)} LSL streams {name!r}: {told}; give the source id to --stream-in"
    )


def choose(info: "pylsl.StreamInfo", wanted: str | None, rules: Settings) -> _Choice:
    """Choose channels by labels or numbers from 1, separated by commas; None: one per sensor.

    Returns
    -------
    channels : tuple of S int
        Indices of the channels, from 0, in the order of the sensors.
    header : dict
        Entries of a recording's header, with what the stream tells of its board.

    Raises
    ------
    WrongBoardError
        The stream or the choice does not fit; the text says what would fit.
    """
    title, rate_hz = title_of(info), info.nominal_srate()
    if info.channel_format() == 3:  # pylsl.cf_string
        raise WrongBoardError(f"{title} sends text, not numbers; name another one with --stream-in")
    if rate_hz != rules["rate_hz"]:
        told = f"a nominal rate of {rate_hz:g} Hz" if rate_hz else "no nominal rate"
        raise WrongBoardError(
            f"{title} has {told}, but the workflow is configured for {rules['rate_hz']:g} Hz "
            f"(recording.rate_hz); {_IMPORT}"
        )
    channels = _channels(title, labels_of(info), wanted, rules["sensors"])
    written = {_child_texts(info, "unit")[index] for index in channels}
    units = {_UNITS.get(unit.lower()) for unit in written}
    if len(units) > 1 or None in units:
        raise WrongBoardError(
            f"{title} has channels in {', '.join(sorted(plain(unit) for unit in written))}; all "
            "channels of a recording must have the same unit, counts, V, ohm or kohm: let its "
            "source send one of these"
        )
    stated = (f"{key}: {text}" for key, text in _stated(info, channels) if scales(key, text))
    if scaling := next(stated, ""):
        raise WrongBoardError(
            f"{title} says {plain(scaling)!r}, and not whether it is applied already; {_IMPORT}"
        )
    return channels, _header_of(info, channels, units.pop() or "")


def _header_of(info: "pylsl.StreamInfo", channels: Sequence[int], unit: str) -> dict[str, str]:
    labels, board = labels_of(info), info.desc().child(BOARD)
    of = f"type {info.type()}, host {info.hostname()}, source id {info.source_id()}"
    told = plain(board.child_value("source")), f"recorded from {title_of(info)} ({plain(of)})"
    entries = {
        "source": "; ".join(filter(None, told)),
        "rate_hz": f"{info.nominal_srate():g}",
        **{key: plain(board.child_value(key)) for key in BOARD_ENTRIES},
        "stream_channels": plain(", ".join(labels[index] for index in channels)),
        "stream_time": "time stamps of the stream, corrected to this computer's clock",
        "unit": unit,
    }
    return {key: text for key, text in entries.items() if text}


def ranges_of(header: Mapping[str, str]) -> dict[str, str]:
    """Return the range of a stream's readings, as entries of a logger's identity."""
    unit, told = header.get("unit", ""), header.get("adc_bits", "")
    known = unit == "counts" and told.isdecimal() and 1 <= int(told) <= _ALL_BITS
    full_scale = 2.0 ** (int(told) if known else _USUAL_BITS) - 1
    return {
        "adc_bits": told if known else str(_ALL_BITS),
        "full_scale": str(_FULL_SCALES.get(unit, full_scale)),
    }


def labels_of(info: "pylsl.StreamInfo") -> list[str]:
    """Return the label of each channel; its number, if it has no label."""
    return [label or str(n) for n, label in enumerate(_child_texts(info, "label"), start=1)]


def _child_texts(info: "pylsl.StreamInfo", key: str) -> list[str]:
    return [channel.child_value(key).strip() for channel in _described_channels(info)]


def _described_channels(info: "pylsl.StreamInfo") -> list["pylsl.XMLElement"]:
    """Return the description of each channel; empty elements where there is none."""
    described = [info.desc().child("channels").child("channel")]
    while len(described) < info.channel_count():
        described.append(described[-1].next_sibling("channel"))
    return described


def _stated(info: "pylsl.StreamInfo", channels: Sequence[int]) -> Iterator[tuple[str, str]]:
    """Yield what is stated of the stream and of these channels, each a name with a text."""
    described = _described_channels(info)
    yield from _texts_in(info.desc(), ("channels", BOARD))
    for index in channels:
        yield from _texts_in(described[index])


def _texts_in(
    element: "pylsl.XMLElement", left_out: Sequence[str] = ()
) -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each element in another one, at any depth."""
    child = element.first_child()
    while not child.empty():
        if child.name() not in left_out:
            yield child.name(), child.child_value().strip()
            yield from _texts_in(child)
        child = child.next_sibling()


def _channels(
    title: str, labels: Sequence[str], wanted: str | None, sensors: int
) -> tuple[int, ...]:
    listed = ", ".join(f"{n} {plain(label)}" for n, label in enumerate(labels, start=1))
    if wanted is None:
        if len(labels) == sensors:
            return tuple(range(sensors))
        raise WrongBoardError(
            f"{title} has {len(labels)} channels ({listed}), but recording.sensors is {sensors}; "
            "choose with --stream-channels, or name another stream"
        )
    chosen = []
    for each in wanted.split(","):
        word = each.strip()
        number = int(word) - 1 if word.isdecimal() else -1
        if labels.count(word) == 1:
            chosen.append(labels.index(word))
        elif 0 <= number < len(labels):
            chosen.append(number)
        else:
            raise WrongBoardError(
                f"--stream-channels: {title} has no channel {word!r}, or several of them; it has "
                f"{listed}"
            )
    if len(set(chosen)) != sensors or len(chosen) != sensors:
        raise AcquisitionError(
            f"--stream-channels names {len(set(chosen))} different channels; recording.sensors is "
            f"{sensors}, so give {sensors}"
        )
    return tuple(chosen)


class StreamLine(Source):
    """A stream as a source of samples.

    A time stamp tells the period of a sample, so samples lost on the way leave a gap. If a source
    ends and starts again, this class finds it again. The Lab Streaming Layer does this itself if
    the source has an id; otherwise the name is searched.

    Raises
    ------
    AcquisitionError
        There is no such stream, or it does not fit.
    """

    def __init__(
        self, name: str, wanted: str | None, rules: Settings, tell: Callable[[str], None]
    ) -> None:
        self._lsl: ModuleType = import_pylsl("--stream-in")
        self._name, self._wanted, self._rules = name, wanted, rules
        self._inlet, (self._channels, header) = self._open(FIND_S, ALONE_S)
        described = ranges_of(header) | {"channels": str(len(self._channels))}
        super().__init__(title_of(self._inlet.info()), header, **described)
        self._tell = tell
        self._period_s = 1.0 / rules["rate_hz"]
        self._grid = StampGrid(self._period_s)
        self._heard_s = AWAKE.now_s()
        self._away = False

    def read(self, timeout_s: float) -> list[Arrival]:
        """Read the samples that have arrived; wait up to the timeout for the first."""
        samples, stamps = self._pull(timeout_s)
        moment_s, now_s = elapsed_s(), AWAKE.now_s()
        if stamps:
            self._heard_s = now_s
            if self._away:
                self._away = False
                self._tell(f"{self.port} is back; the recording continues in the same file")
        elif now_s - self._heard_s > SILENT_S:
            self._note_away("sends nothing")
        taken = zip(samples, stamps, strict=True)
        return [Arrival(self._event(*each), moment_s) for each in taken]

    def close(self) -> list[Damaged]:
        """Close the stream."""
        if self._inlet is not None:
            self._inlet.close_stream()
        return []

    def _open(self, wait_s: float, alone_s: float) -> tuple["pylsl.StreamInlet", _Choice]:
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
        try:
            if self._inlet is None:
                inlet, (channels, header) = self._open(LOOK_S, 0.0)
                if channels != self._channels or header.get("unit") != self.header.get("unit"):
                    raise WrongBoardError("with other channels or units")
                self._inlet = inlet
            pulled: tuple[list[list[float]], list[float]]
            pulled = self._inlet.pull_chunk(timeout_s, _MOST_SAMPLES)
            return pulled
        except BoardNotFoundError:
            pass  # it is still away
        except WrongBoardError as reason:
            self._note_away(f"is another one now ({reason})")
        except self._lsl.util.LostError:
            self._inlet = None
            self._note_away("has ended")
        except TimeoutError:
            # A source that has just started again does not yet answer questions about its clock.
            self._note_away("does not report its clock")
        return [], []

    def _note_away(self, what: str) -> None:
        if not self._away:
            self._away = True
            self._tell(
                f"{self.port} {what}; start its source again before --patience ends, or end the "
                "recording with Ctrl-C"
            )

    def _event(self, values: list[float], stamp_s: float) -> Event:
        number = self._grid.number(stamp_s)
        chosen = tuple(values[index] for index in self._channels)
        if not all(map(math.isfinite, chosen)):
            return Damaged(repr((stamp_s, chosen)).encode(), "a reading is not a number")
        device_ms = round(1000.0 * number * self._period_s) % CLOCK_ENDS_MS
        return Sample(number % COUNTER_ENDS, device_ms, chosen, False)


class SampleOutlet:
    """A stream that sends each sample once, with the time at which it was read.

    Raises
    ------
    CapsuleError
        pylsl is not installed.
    """

    def __init__(self, name: str, header: Mapping[str, str], sensors: int, recording: str) -> None:
        self._lsl = lsl = import_pylsl("--stream-out")
        rate_hz = float(header["rate_hz"])
        # The same for each run, so that listeners reconnect to the next run.
        source_id = f"origami-capsule {name}"
        info = lsl.StreamInfo(name, "Tactile", sensors, rate_hz, lsl.cf_float32, source_id)
        info.set_channel_labels(column_names(sensors)[1:])
        info.set_channel_units(header.get("unit", "counts"))
        info.set_channel_types("Tactile")
        board = info.desc().append_child(BOARD)
        for key in ("source", *BOARD_ENTRIES):
            if key in header:
                board.append_child_value(key, header[key])
        board.append_child_value("recording", recording)
        self._outlet = lsl.StreamOutlet(info)
        self._sent = 0

    def send(self, state: State) -> None:
        """Send the new samples; skip missing ones, so that the time stamps show the gap."""
        new = min(state.samples - self._sent, len(state.recent))
        self._sent = state.samples
        now_s = self._lsl.local_clock()
        for behind in range(new - 1, -1, -1):
            sample = state.recent[-1 - behind]
            if sample is not None:
                self._outlet.push_sample(list(sample), now_s - behind * state.period_s)
