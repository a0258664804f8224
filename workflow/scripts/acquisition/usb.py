"""Find the USB port of a board that was plugged in again, because its name can change."""

from collections.abc import Iterable

from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo


class UsbPort:
    """A port and, if it is a USB port, the identity of its device.

    Parameters
    ----------
    name : str
        Present name of the port.
    ports : iterable of port descriptions, optional
        The computer's ports; searched if left out.
    """

    def __init__(self, name: str, ports: Iterable[ListPortInfo] | None = None) -> None:
        self._name = name
        self._identity = None
        for port in list_ports.comports() if ports is None else ports:
            if port.device == name and port.vid is not None:
                self._identity = _identity(port)

    def current_name(self, ports: Iterable[ListPortInfo] | None = None) -> str:
        """Return the present name of the port; the old one if no single port has its device."""
        if self._identity is None:
            return self._name
        ports = list_ports.comports() if ports is None else ports
        same = [port.device for port in ports if _identity(port) == self._identity]
        if self._name not in same and len(same) == 1:
            self._name = same[0]
        return self._name


def _identity(port: ListPortInfo) -> tuple[int | None, int | None, str | None]:
    return port.vid, port.pid, port.serial_number
