"""Find a stream of the Lab Streaming Layer, choose its channels, and describe it in a header."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from types import ModuleType
from typing import TYPE_CHECKING

from capsule.bench.bench_errors import AcquisitionError, BoardNotFoundError, WrongBoardError
from capsule.bench.drive import Wave
from capsule.bench.logger_board import moment_text, wave_entries
from capsule.bench.protocol import Identity
from capsule.kinds import Settings

if TYPE_CHECKING:
    import pylsl

FIND_S = 5.0
# Wait for a second stream of the same name, which may miss the first request.
ALONE_S = 1.5
# Element of a stream's description with the entries of its board; stream_outlet.py writes it.
BOARD, BOARD_ENTRIES = "capsule", ("adc_bits", "vref_v", "series_ohm")
_ALL_BITS = 32  # for readings of unknown full scale
# The largest reading in the terminal's display, by unit; counts have 10 bits by default.
_FULL_SCALES = {"V": 5.0, "ohm": 24_000.0, "kohm": 24.0}
_USUAL_BITS = 10
_UNITS = {"counts": "counts", "v": "V", "volt": "V", "volts": "V", "ohm": "ohm", "ohms": "ohm"}
_UNITS |= {"kohm": "kohm", "kohms": "kohm", "": ""}
_IMPORT = "record it with LabRecorder, then import the XDF file: capsule import"
_LONGEST = 100


@dataclass(frozen=True)
class ChosenStream:
    """A stream, and the channels to record.

    Attributes
    ----------
    info : pylsl.StreamInfo
        The stream's full description.
    channels : tuple of S int
        Indices of the channels, from 0, in the order of the sensors.
    unit : str
        Unit of the readings, as in a recording's header; empty if the stream names none.
    """

    info: "pylsl.StreamInfo"
    channels: tuple[int, ...]
    unit: str

    @property
    def title(self) -> str:
        """Name of the stream for messages."""
        return f"the LSL stream {plain(self.info.name())!r}"

    def board(self) -> dict[str, str]:
        """Return the entries of the stream's board; empty if it describes none."""
        node = self.info.desc().child(BOARD)
        entries = {key: plain(node.child_value(key)) for key in (*BOARD_ENTRIES, "source")}
        return {key: text for key, text in entries.items() if text}

    def identity(self) -> Identity:
        """Return a description of the stream in the form of a logger board's."""
        entries = {"rate_hz": f"{self.info.nominal_srate():g}", "channels": str(len(self.channels))}
        return Identity("logger", entries | {"adc_bits": str(self._bits or _ALL_BITS)})

    @property
    def full_scale(self) -> float:
        """Approximate largest reading."""
        return _FULL_SCALES.get(self.unit, 2.0 ** (self._bits or _USUAL_BITS) - 1)

    @property
    def _bits(self) -> int | None:
        bits = self.board().get("adc_bits", "")
        known = self.unit == "counts" and bits.isdecimal() and 1 <= int(bits) <= _ALL_BITS
        return int(bits) if known else None

    def header(self, started: datetime, wave: Wave | None) -> dict[str, str]:
        """Return the header of the stream's recording."""
        info, board = self.info, self.board()
        of = [f"type {info.type()}", f"host {info.hostname()}", f"source id {info.source_id()}"]
        source = f"recorded from {self.title} ({plain(', '.join(of))})"
        if board.get("source"):
            source = f"{board.pop('source')}; {source}"
        header = {"source": source, "rate_hz": f"{info.nominal_srate():g}", **board}
        labels = labels_of(info)
        header["stream_channels"] = plain(", ".join(labels[index] for index in self.channels))
        header["stream_time"] = "time stamps of the stream, corrected to this computer's clock"
        header |= {"unit": self.unit} if self.unit else {}
        return header | {"started": moment_text(started)} | wave_entries(wave)


def plain(text: str) -> str:
    """Return a text from a stream as one printable line of limited length, for a header."""
    return "".join(each for each in " ".join(text.split()) if each.isprintable())[:_LONGEST]


def find_stream(
    lsl: ModuleType, name: str, wait_s: float, alone_s: float = ALONE_S
) -> "pylsl.StreamInfo":
    """Find a stream.

    Parameters
    ----------
    lsl : module
        pylsl.
    name : str
        The stream's name or source id.
    wait_s : float
        Longest wait for the stream, in seconds.
    alone_s : float
        Time in seconds to look for a second stream of that name; 0: take the first one.

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


def choose(info: "pylsl.StreamInfo", wanted: str | None, rules: Settings) -> ChosenStream:
    """Choose the channels of a stream.

    Parameters
    ----------
    info : pylsl.StreamInfo
        The stream's full description.
    wanted : str or None
        Labels or numbers from 1, separated by commas; None: one channel per sensor.
    rules : mapping
        Section ``recording`` of the configuration.

    Raises
    ------
    WrongBoardError
        The stream or the choice does not fit; the text says what would fit.
    """
    title, rate_hz = f"the LSL stream {plain(info.name())!r}", info.nominal_srate()
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
    return ChosenStream(info, channels, units.pop() or "")


def labels_of(info: "pylsl.StreamInfo") -> list[str]:
    """Return the label of each channel; its number, if it has no label."""
    return [label or str(n) for n, label in enumerate(_child_texts(info, "label"), start=1)]


def _child_texts(info: "pylsl.StreamInfo", key: str) -> list[str]:
    texts, channel = [], info.desc().child("channels").child("channel")
    for _ in range(info.channel_count()):
        texts.append(channel.child_value(key).strip())
        channel = channel.next_sibling("channel")
    return texts


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
