"""The serial protocol of the boards: decode bytes into events, encode commands into bytes.

docs/protocol.md describes the frames: ``$payload*CRC`` and a line feed. A ``$`` always begins a
frame, so a frame cut off by a reset or by noise does not damage the next one.
"""

import binascii
import re
from collections.abc import Mapping
from dataclasses import dataclass

VERSION = "1"
LONGEST_FRAME = 256
_PIECE = re.compile(rb"(\$?[^$\n]*)(\n|(?=\$))")
_FRAME = re.compile(rb"\$([ -~]*)\*([0-9A-F]{4})")
_COUNT = re.compile(r"\d{1,10}")
_WHOLE = re.compile(r"-?\d{1,10}")
_NUMBER = re.compile(r"-?\d{1,10}(\.\d{1,6})?")
_SWITCHES = ("none", "unfolded", "folded", "both")
_FOLD_STATES = ("unfolded", "folding", "folded", "unfolding", "fault")


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
    """Decode one frame, without its line feed.

    Returns
    -------
    Event
        `Damaged` if the checksum or the form is wrong.
    """
    match = _FRAME.fullmatch(frame)
    if not match:
        return Damaged(frame, "not a frame")
    payload, digits = match.groups()
    if int(digits, 16) != checksum(payload):
        return Damaged(frame, "failed its check")
    kind, *fields = payload.decode("ascii").split(",")
    read = _READERS.get(kind)
    event = read(fields) if read else None
    return event or Damaged(frame, "a frame of unknown form")


def _read_sample(fields: list[str]) -> Sample | None:
    if len(fields) < 4 or not all(map(_COUNT.fullmatch, fields)) or fields[-1] not in ("0", "1"):
        return None
    sequence, device_ms, *counts, at_end = map(int, fields)
    return Sample(sequence, device_ms, tuple(counts), bool(at_end))


def _read_identity(fields: list[str]) -> Identity | None:
    if not fields or not all("=" in entry for entry in fields[1:]):
        return None
    return Identity(fields[0], dict(entry.split("=", 1) for entry in fields[1:]))


def _read_position(fields: list[str]) -> Position | None:
    if len(fields) not in (5, 6) or not all(map(_NUMBER.fullmatch, fields[:4])):
        return None
    if "." in fields[0] + fields[1]:
        return None
    device_ms, half_steps, position_mm, speed_mm_s, state = fields[:5]
    index = "".join(fields[5:])
    if index and not _WHOLE.fullmatch(index):
        return None
    return Position(
        int(device_ms),
        int(half_steps),
        float(position_mm),
        float(speed_mm_s),
        state,
        int(index) if index else None,
    )


def _read_fold_state(fields: list[str]) -> FoldState | None:
    if len(fields) != 4 or not _COUNT.fullmatch(fields[0]) or not _WHOLE.fullmatch(fields[1]):
        return None
    device_ms, half_steps, switches, state = fields
    if switches not in _SWITCHES or state not in _FOLD_STATES:
        return None
    return FoldState(int(device_ms), int(half_steps), switches, state)


def _read_acknowledgement(fields: list[str]) -> Acknowledgement | None:
    return Acknowledgement(fields[0], ",".join(fields[1:])) if fields else None


def _read_refusal(fields: list[str]) -> Refusal | None:
    return Refusal(fields[0], ",".join(fields[1:])) if len(fields) > 1 else None


_READERS = {
    "D": _read_sample,
    "I": _read_identity,
    "P": _read_position,
    "F": _read_fold_state,
    "A": _read_acknowledgement,
    "E": _read_refusal,
}
