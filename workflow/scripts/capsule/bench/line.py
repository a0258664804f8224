"""A serial line that carries frames, and the USB port that leads to it."""

import contextlib
import errno
import os
import threading
import time
from dataclasses import dataclass

import serial
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from capsule.bench.bench_errors import (
    AcquisitionError,
    BoardNotFoundError,
    LineLostError,
    NoPermissionError,
    PortBusyError,
)
from capsule.bench.clock import elapsed_s
from capsule.bench.protocol import Damaged, Event, FrameParser, encode

BAUD = 115200
READ_TIMEOUT_S = 0.05

# Exceptions that pyserial raises when a port disappears; termios.error is not an OSError.
_FAULTS: tuple[type[Exception], ...] = (serial.SerialException, OSError)
if os.name == "posix":
    import termios

    _FAULTS = (*_FAULTS, termios.error)
_OPENING_FAULTS: tuple[type[Exception], ...] = (*_FAULTS, ValueError)


@dataclass(frozen=True)
class Arrival:
    """An event, when it was read by the computer's clock, and whether its board just came back."""

    event: Event
    moment_s: float
    fresh: bool = False


class Line:
    """An open serial port.

    Raises
    ------
    AcquisitionError
        The port cannot be opened; the subclass and the text say why.
    """

    def __init__(self, port: str, baud: int = BAUD) -> None:
        self.port = port
        self.baud = baud
        self.first_bytes = b""
        self._parser = FrameParser()
        # A lease is renewed by a thread of its own, so two threads can send.
        self._sending = threading.Lock()
        self.sent_s = time.monotonic()
        try:
            # Two programs on one port would each get half of the bytes.
            self._serial = serial.serial_for_url(port, baudrate=baud, exclusive=True)
        except _OPENING_FAULTS as fault:
            raise explain_open_fault(port, fault) from fault

    def receive(self, timeout_s: float = READ_TIMEOUT_S) -> list[Arrival]:
        """Read the events that have arrived; wait up to the timeout for the first.

        Raises
        ------
        LineLostError
            The port disappeared.
        """
        try:
            if self._serial.timeout != timeout_s:
                self._serial.timeout = timeout_s
            # A read of more bytes than have arrived would lose them if the port disappeared.
            received = self._serial.read(self._serial.in_waiting or 1)
        except _FAULTS as fault:
            raise LineLostError(str(fault)) from fault
        moment_s = elapsed_s()
        self.first_bytes += received[: 200 - len(self.first_bytes)]
        return [Arrival(event, moment_s) for event in self._parser.feed(received)]

    def send(self, payload: str) -> None:
        """Send a command.

        Raises
        ------
        LineLostError
            The port disappeared.
        """
        with self._sending:
            try:
                self._serial.write(encode(payload))
            except _FAULTS as fault:
                raise LineLostError(str(fault)) from fault
            self.sent_s = time.monotonic()

    def close(self) -> list[Damaged]:
        """Close the port; return the rest of an unfinished frame."""
        with self._sending, contextlib.suppress(*_FAULTS):  # the port may have disappeared
            self._serial.close()
        return self._parser.drop_pending("cut off: the line was closed")


def explain_open_fault(port: str, fault: Exception) -> AcquisitionError:
    """Return the error for a port that could not be opened, with its cause and remedy."""
    number = getattr(fault, "errno", None)
    text = str(fault)
    # On Windows only pyserial's text tells the kind of fault, and "denied" means in use.
    denied = number in (errno.EACCES, errno.EPERM)
    in_use = number in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in text
    if in_use or (os.name == "nt" and "PermissionError" in text):
        return PortBusyError(
            f"{port} is in use by another program; close that program (such as the serial "
            "monitor of the Arduino IDE), and start again"
        )
    if denied:
        return NoPermissionError(
            f"you have no permission to open {port}; on Linux, run: "
            "sudo usermod -aG dialout $USER, then log out and in again"
        )
    missing = number in (errno.ENOENT, errno.ENODEV, errno.ENXIO) or "FileNotFoundError" in text
    if missing:
        names = sorted(port.device for port in list_ports.comports())
        return BoardNotFoundError(
            f"there is no port {port}; ports here: {', '.join(names) or 'none'}; plug the board "
            "in, or name its port with --port"
        )
    return AcquisitionError(f"{port} cannot be opened: {text}")


class UsbPort:
    """A port and, if it is a USB port, the identity of its device.

    A device is known by its serial number. Clones without one, or with the same one, are known by
    the USB socket that they are plugged into.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        ports = {port.device: _told_by(port) for port in list_ports.comports()}
        known = ports.get(name, (None,))
        alike = [each for each in ports.values() if each[:3] == known[:3]]
        by_number = len(alike) == 1 and alike[0][2] is not None
        self._known = known[:3] if by_number else known

    def current_name(self) -> str:
        """Return the present name of the port; the first one if no single port has its device."""
        there = list_ports.comports() if self._known[0] is not None else []
        length = len(self._known)
        same = [port.device for port in there if _told_by(port)[:length] == self._known]
        return same[0] if len(same) == 1 else self._name


def _told_by(port: ListPortInfo) -> tuple[object, ...]:
    # Some systems do not tell the socket; then only the name is left.
    return port.vid, port.pid, port.serial_number, port.location or port.device
