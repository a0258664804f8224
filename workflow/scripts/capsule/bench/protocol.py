"""The serial protocol of the boards: decode bytes into events, encode commands into bytes.

docs/protocol.md describes the frames: ``$payload*CRC`` and a line feed. A ``$`` always begins a
frame, so a frame cut off by a reset or by noise does not damage the next one.
"""

import binascii
import re
from collections.abc import Mapping
from dataclasses import dataclass

VERSION = 1
LONGEST_FRAME = 256
_PIECE = re.compile(rb"(\$?[^$\n]*)(\n|(?=\$))")
_FRAME = re.compile(rb"\$([ -~]*)\*([0-9A-F]{4})")
_COUNT, _WHOLE, _NUMBER = r"\d{1,10}", r"-?\d{1,10}", r"-?\d{1,10}(?:\.\d{1,6})?"
_SAMPLE = re.compile(rf"({_COUNT}),({_COUNT}),({_COUNT}(?:,{_COUNT})*),([01])")
_POSITION = re.compile(rf"({_WHOLE}),({_WHOLE}),({_NUMBER}),({_NUMBER}),([^,]*)(?:,({_WHOLE})?)?")
_FOLD_STATE = re.compile(
    rf"({_COUNT}),({_WHOLE}),(none|unfolded|folded|both),(unfolded|folding|folded|unfolding|fault)"
)


@dataclass(frozen=True)
class Sample:
    """One sample of all sensors.

    Attributes
    ----------
    sequence : int
        Number of the sample since the board started.
    device_ms : int
        Start of the conversion, in milliseconds since the board started.
    counts : tuple of S float
        ADC counts; from a stream, readings in the unit of the stream.
    at_end : bool
        Whether the capsule has closed the end stop.
    """

    sequence: int
    device_ms: int
    counts: tuple[float, ...]
    at_end: bool


@dataclass(frozen=True)
class Identity:
    """A board's description of itself: its kind (such as ``logger``) and its entries."""

    device: str
    entries: Mapping[str, str]


@dataclass(frozen=True)
class Position:
    """The position of the wave, from the peristalsis board; the speed is negative backward.

    Attributes
    ----------
    index_half_steps : int, optional
        Count of half-steps at the last passage of the cam shaft's index. None if the shaft has not
        passed it since the board started, or if the firmware is too old to report it.
    """

    device_ms: int
    half_steps: int
    position_mm: float
    speed_mm_s: float
    state: str
    index_half_steps: int | None = None


@dataclass(frozen=True)
class FoldState:
    """The state of the origami, from the fold board.

    Attributes
    ----------
    device_ms : int
        Milliseconds since the board started.
    half_steps : int
        Half-steps by which the thread was wound since the switch "unfolded" last closed.
    switches : {"none", "unfolded", "folded", "both"}
        The end switches that are closed.
    state : {"unfolded", "folding", "folded", "unfolding", "fault"}
        The state that the board concludes.
    """

    device_ms: int
    half_steps: int
    switches: str
    state: str


@dataclass(frozen=True)
class Acknowledgement:
    """A board's confirmation of a command."""

    command: str
    argument: str


@dataclass(frozen=True)
class Refusal:
    """A board's refusal of a command, with the reason."""

    command: str
    reason: str


@dataclass(frozen=True)
class Damaged:
    """Bytes that are not a whole frame, with the reason; they are never used."""

    content: bytes
    reason: str


Event = Sample | Identity | Position | FoldState | Acknowledgement | Refusal | Damaged


def checksum(payload: bytes) -> int:
    """Return the CRC-16/CCITT-FALSE (polynomial 0x1021, initial value 0xFFFF)."""
    return binascii.crc_hqx(payload, 0xFFFF)


def encode(payload: str) -> bytes:
    """Return the frame of a payload such as ``start`` or ``speed,25``.

    Raises
    ------
    ValueError
        The payload holds a ``$`` or a character other than printable ASCII.
    """
    if not re.fullmatch(r"[ -#%-~]+", payload):
        raise ValueError(f"{payload!r} cannot be sent: printable ASCII without '$' only")
    content = payload.encode("ascii")
    return b"$%s*%04X\n" % (content, checksum(content))


class FrameParser:
    """A parser that cuts received bytes into frames; it accepts any bytes.

    Examples
    --------
    >>> parser = FrameParser()
    >>> parser.feed(encode("A,start")[:5])
    []
    >>> parser.feed(encode("A,start")[5:])
    [Acknowledgement(command='start', argument='')]
    """

    def __init__(self) -> None:
        self._pending = b""

    def feed(self, received: bytes) -> list[Event]:
        """Return the events that these bytes complete."""
        content = self._pending + received
        events: list[Event] = []
        end = 0
        for match in _PIECE.finditer(content):
            end = match.end()
            piece, line_feed = match.groups()
            if line_feed and piece:
                events.append(decode(piece))
            elif piece:
                events.append(Damaged(piece, "cut off by the next frame"))
        self._pending = content[end:]
        if len(self._pending) > LONGEST_FRAME:
            events += self.drop_pending("longer than any frame")
        return events

    def drop_pending(self, reason: str = "cut off") -> list[Damaged]:
        """Drop the unfinished frame, because the line was closed; return it as damaged."""
        pending, self._pending = self._pending, b""
        return [Damaged(pending, reason)] if pending else []


def decode(frame: bytes) -> Event:
    """Decode one frame, without its line feed."""
    match = _FRAME.fullmatch(frame)
    if not match:
        return Damaged(frame, "not a frame")
    payload, digits = match.groups()
    if int(digits, 16) != checksum(payload):
        return Damaged(frame, "failed its check")
    kind, _, content = payload.decode("ascii").partition(",")
    return _read(kind, content) or Damaged(frame, "a frame of unknown form")


def _read(kind: str, content: str) -> Event | None:
    """Return the event in the fields of a frame; None if they have another form."""
    name, comma, rest = content.partition(",")
    match kind:
        case "D" if form := _SAMPLE.fullmatch(content):
            counts = tuple(map(int, form[3].split(",")))
            return Sample(int(form[1]), int(form[2]), counts, form[4] == "1")
        case "I" if content and all("=" in entry for entry in rest.split(",") if comma):
            entries = (entry.split("=", 1) for entry in rest.split(",") if comma)
            return Identity(name, dict(entries))
        case "P" if form := _POSITION.fullmatch(content):
            way_mm, speed_mm_s = float(form[3]), float(form[4])
            index = int(form[6]) if form[6] else None
            return Position(int(form[1]), int(form[2]), way_mm, speed_mm_s, form[5], index)
        case "F" if form := _FOLD_STATE.fullmatch(content):
            return FoldState(int(form[1]), int(form[2]), form[3], form[4])
        case "A" if content:
            return Acknowledgement(name, rest)
        case "E" if comma:
            return Refusal(name, rest)
    return None
