"""Find the boards at the serial ports, and identify them."""

import os
import re
import time
from collections.abc import Generator, Iterable, Sequence

from serial.tools import list_ports

from capsule.bench.bench_errors import (
    AcquisitionError,
    BoardNotFoundError,
    LineLostError,
    NoAnswerError,
    WrongBaudError,
    WrongBoardError,
)
from capsule.bench.clock import StopRequest
from capsule.bench.line import BAUD, Arrival, Line
from capsule.bench.protocol import VERSION, Damaged, Identity

# Opening a port restarts an Arduino. A Mega's boot loader then waits for up to two seconds. A byte
# that arrives meanwhile makes it wait for an upload. So the program sends nothing at first.
QUIET_S = 2.5
ASK_EVERY_S = 0.1
ANSWER_S = 4.0  # 40 questions: with 1 % of bytes damaged, one answer in four is whole
GARBLED_S = 1.0  # after so long without an answer, silence or a wrong baud rate is certain
# A search only listens for so long, before it asks: a board that the opening has restarted says by
# itself who it is.
LISTEN_S = 3.0
LOOK_EVERY_S = 0.02
# USB numbers (vendor, product) of Arduino's own Mega 2560 and UNO. Clones have the numbers of a
# general USB serial chip, which lab devices have too; the user names their ports.
USB_IDS = {
    (vendor, product)
    for vendor in (0x2341, 0x2A03)
    for product in (0x0001, 0x0010, 0x0042, 0x0043, 0x0242, 0x0243)
}
# Numbers that a board must report, by its kind, with their smallest and largest values; those with
# whole limits are whole.
_NUMBERS: dict[str, dict[str, tuple[float, float]]] = {
    "logger": {
        "rate_hz": (1, 10_000),
        "channels": (1, 64),
        "adc_bits": (1, 32),
        "vref_mv": (1, 100_000),
        "series_ohm": (1, 1_000_000_000),
    },
    "peristalsis": {"wavelength_mm": (1.0, 10_000.0)},
}
PURPOSES = {
    "logger": "record with it (--port)",
    "peristalsis": "drive the wave with it (--drive)",
    "fold": "fold the origami with it (capsule survey --fold)",
}


def opened(
    port: str, baud: int, wanted: str, listen_s: float = 0.0
) -> Generator[tuple[Line, Identity] | None]:
    """Open a port and identify its board in short steps, so that others are served meanwhile.

    The port is closed if this fails, or is given up before the board has answered.

    Yields
    ------
    (Line, Identity) or None
        None once the port is open, and after each look at it, until the board has answered.

    Raises
    ------
    AcquisitionError
        The port cannot be opened, or has disappeared; another board answers, or none, or the baud
        rate is wrong.
    """
    line = Line(port, baud)
    identity: Identity | None = None
    others: list[Arrival] = []
    frames = questions = 0
    try:
        yield None
        opened_s = asked_s = time.monotonic()
        while True:
            for arrival in line.receive(0):
                frames += not isinstance(arrival.event, Damaged)
                if isinstance(arrival.event, Identity):
                    identity = arrival.event
                    _check(identity, wanted, port)
                else:
                    others.append(arrival)
            if identity:
                break
            yield None
            now_s = time.monotonic()
            if not questions:
                if now_s - opened_s < (listen_s if line.first_bytes else max(QUIET_S, listen_s)):
                    continue
                # What sends text without frames is no board of this bench, so it is not even asked.
                if listen_s and len(line.first_bytes) >= 20 and b"$" not in line.first_bytes:
                    raise _explain_silence(line, frames)
                asked_s = now_s
            hopeless = not line.first_bytes or _is_garbled(line, frames)
            if now_s - asked_s > (GARBLED_S if hopeless else ANSWER_S):
                raise _explain_silence(line, frames)
            if now_s - asked_s >= questions * ASK_EVERY_S:
                line.send("identify")
                questions += 1
    except LineLostError as fault:
        line.close()
        raise NoAnswerError(
            f"the board at {port} was disconnected before it identified itself: {fault}"
        ) from fault
    except BaseException:
        line.close()
        raise
    line.put_back(others)  # a running board sends samples meanwhile
    yield line, identity


def _is_garbled(line: Line, frames: int) -> bool:
    """Return whether most bytes are not printable; mere noise leaves most bytes printable."""
    content = line.first_bytes
    printable = sum(32 <= byte < 127 or byte in b"\r\n\t" for byte in content)
    return frames == 0 and len(content) >= 20 and printable < 0.8 * len(content)


def _check(identity: Identity, wanted: str, port: str) -> None:
    if identity.device != wanted:
        purpose = PURPOSES.get(identity.device, "it does not belong to this bench")
        raise WrongBoardError(
            f"the board at {port} is the {identity.device} board, not the {wanted}: {purpose}"
        )
    if fault := _fault_of(identity):
        raise WrongBoardError(
            f"the {wanted} at {port} reports {fault}; upload the firmware of this version "
            "(workflow/firmware)"
        )


def _fault_of(identity: Identity) -> str:
    """Return the first fault in a board's description of itself; empty if there is none."""
    entries = identity.entries
    if entries.get("protocol") != VERSION:
        return f"protocol={entries.get('protocol')}, but this program needs {VERSION}"
    if "firmware" not in entries:
        return "no firmware"
    for key, (least, most) in _NUMBERS.get(identity.device, {}).items():
        value = entries.get(key, "")
        form = r"[0-9]{1,10}" if isinstance(least, int) else r"[0-9]{1,10}(\.[0-9]{1,6})?"
        if not re.fullmatch(form, value) or not least <= float(value) <= most:
            return f"{key}={value}" if value else f"no {key}"
    return ""


def differences(identity: Identity, other: Identity) -> str:
    """Return the differences of another board in kind and electronics; empty if there are none."""
    if other.device != identity.device:
        return f"it is the {other.device} board"
    return ", ".join(
        f"{key}={other.entries.get(key)} instead of {identity.entries.get(key)}"
        for key in ("protocol", *_NUMBERS.get(identity.device, ()))
        if other.entries.get(key) != identity.entries.get(key)
    )


def _explain_silence(line: Line, frames: int) -> AcquisitionError:
    if not line.first_bytes:
        return NoAnswerError(
            f"nothing answers at {line.port}; check that this is the right port, and that the "
            "firmware is on the board (workflow/firmware)"
        )
    if _is_garbled(line, frames):
        return WrongBaudError(
            f"{line.port} sent bytes but no frame; this is probably the wrong baud rate (--baud "
            f"is {line.baud}, the firmware uses {BAUD})"
        )
    if frames:
        return NoAnswerError(
            f"the board at {line.port} sends frames but does not answer 'identify'; "
            "try another cable, or press the reset button of the board"
        )
    return WrongBoardError(
        f"the board at {line.port} runs another program: it sends {line.first_bytes[:40]!r}; "
        "upload the firmware (workflow/firmware)"
    )


def connect(
    port: str | None,
    baud: int,
    wanted: str,
    skip: Iterable[str] = (),
    stop: StopRequest | None = None,
) -> tuple[Line, Identity]:
    """Open a port, or find one, and check which board is behind it.

    Opening a port restarts many devices, and a command can do anything to a device that is no board
    of this bench. So a search opens only ports with the USB numbers of the boards. For three
    seconds it only listens to them, before it asks.

    Raises
    ------
    AcquisitionError
        The port cannot be opened, another board or none answers, or the baud rate is wrong. A
        search finds no board, or more than one: the text says what each port answered, and which
        ports were left alone.
    KeyboardInterrupt
        The user has ended the program.
    """
    if port is None:
        return _found(wanted, baud, skip, stop)
    boards, faults = _introduced([port], baud, wanted, 0.0, stop)
    if faults:
        raise faults[0]
    return boards[0]


def _found(
    wanted: str, baud: int, skip: Iterable[str], stop: StopRequest | None
) -> tuple[Line, Identity]:
    """Find a board at the USB ports."""
    left = {os.path.realpath(port) for port in skip}
    candidates, foreign = [], []
    for port in sorted(list_ports.comports(), key=lambda port: str(port.device)):
        if os.path.realpath(port.device) in left:
            continue
        if (port.vid, port.pid) in USB_IDS:
            candidates.append(port.device)
        # Built-in ports and Bluetooth have no USB vendor number, so they are no Arduino.
        elif port.vid is not None:
            name = port.product or port.description
            foreign.append(f"{port.device} ({name}, {port.vid:04X}:{port.pid:04X})")
    if len(candidates) > 1:
        print(f"looking for the {wanted} at {', '.join(candidates)}")
    boards, faults = _introduced(candidates, baud, wanted, LISTEN_S, stop)
    if len(boards) == 1:
        return boards[0]
    for line, _ in boards:
        line.close()
    if boards:
        names = ", ".join(line.port for line, _ in boards)
        raise BoardNotFoundError(
            f"found {len(boards)} boards of the kind {wanted}: {names}; choose one with --port"
        )
    raise BoardNotFoundError(_nothing_found(wanted, faults, foreign))


def _nothing_found(wanted: str, answers: Sequence[Exception], foreign: list[str]) -> str:
    """Return why no board was found, and which ports the user could name."""
    listed = "".join(f"\n  {answer}" for answer in answers)
    text = f"no {wanted} found at any USB port of an Arduino{':' if listed else ''}{listed}"
    if foreign:
        return (
            f"{text}\nnot opened, since they can be other devices: {', '.join(foreign)}; if one "
            f"of them is the {wanted} (a clone of an Arduino), name it with --port"
        )
    return text if answers else f"{text}; plug it in, or name its port with --port"


def _introduced(
    ports: Iterable[str], baud: int, wanted: str, listen_s: float, stop: StopRequest | None
) -> tuple[list[tuple[Line, Identity]], list[AcquisitionError]]:
    """Identify the boards at these ports together; return the fitting ones and others' faults."""
    boards: list[tuple[Line, Identity]] = []
    faults: list[AcquisitionError] = []
    strangers = [opened(port, baud, wanted, listen_s) for port in ports]
    try:
        while strangers:
            if stop and stop.reason:
                raise KeyboardInterrupt
            time.sleep(LOOK_EVERY_S)
            for each in list(strangers):
                try:
                    if found := next(each):
                        boards.append(found)
                        strangers.remove(each)
                except AcquisitionError as fault:
                    faults.append(fault)
                    strangers.remove(each)
    except KeyboardInterrupt:
        for each in strangers:
            each.close()
        for line, _ in boards:
            line.close()
        raise
    return boards, faults
