"""Find the USB port of a board that was plugged in again, because its name can change."""

from collections.abc import Iterable

from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo


class UsbPort:
    """A port and, if it is a USB port, the identity of its device.

    A device is known by its serial number. Clones without one, or with the same one, are known by
    the USB socket that they are plugged into.

    Parameters
    ----------
    name : str
        Present name of the port.
    ports : iterable of port descriptions, optional
        The computer's ports; searched if left out.
    """

    def __init__(self, name: str, ports: Iterable[ListPortInfo] | None = None) -> None:
        self._name = name
        self._identity: tuple[object, ...] | None = None
        self._by_socket = False
        ports = list(list_ports.comports() if ports is None else ports)
        for port in ports:
            if port.device == name and port.vid is not None:
                alike = sum(_device(other) == _device(port) for other in ports)
                self._by_socket = port.serial_number is None or alike > 1
                self._identity = self._identify(port)

    def current_name(self, ports: Iterable[ListPortInfo] | None = None) -> str:
        """Return the present name of the port; the first one if no single port has its device."""
        if self._identity is None:
            return self._name
        ports = list_ports.comports() if ports is None else ports
        same = [port.device for port in ports if self._identify(port) == self._identity]
        return same[0] if len(same) == 1 else self._name

    def _identify(self, port: ListPortInfo) -> tuple[object, ...]:
        if not self._by_socket:
            return _device(port)
        # Some systems do not tell the socket; then only the name is left.
        return (*_device(port), port.location or port.device)


def _device(port: ListPortInfo) -> tuple[int | None, int | None, str | None]:
    return port.vid, port.pid, port.serial_number
