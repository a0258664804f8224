"""Boards imitated in plain Python: they need no emulator and simulate hours in seconds."""

import re

from capsule.bench.protocol import checksum, encode

PERIOD_US = 100_000


class StandIn:
    """The common part of all imitated boards: a serial line, a clock and commands."""

    baud = 115200
    device, firmware = "", "1.0"
    commands: tuple[str, ...] = ()

    def __init__(self) -> None:
        self._now_us = 0
        self.resets = -1
        self.reset()

    def reset(self) -> None:
        """Press the reset button."""
        self.resets += 1
        self._started_us = self._now_us
        self._line = b""
        self._sent = b""
        self.begin()
        self.send_identity()

    @property
    def uptime_ms(self) -> int:
        """Milliseconds since the board started."""
        return (self._now_us - self._started_us) // 1000

    def skip(self, until_us: int) -> None:
        """Advance the time without running the firmware."""
        self._now_us = until_us

    def advance(self, until_us: int) -> None:
        """Run to a point in time."""
        self._now_us = until_us

    def take_sent(self) -> bytes:
        """Return the bytes that the board has sent, once."""
        sent, self._sent = self._sent, b""
        return sent

    def deliver(self, received: bytes) -> None:
        """Obey the commands in these bytes."""
        for byte in received.replace(b"\r", b""):
            self._line = (b"" if byte == ord("$") else self._line) + bytes([byte])
            if byte == ord("\n"):
                line, self._line = self._line[:-1], b""
                self._obey(line)

    def _obey(self, line: bytes) -> None:
        match = re.fullmatch(rb"\$([^*]*)\*([0-9A-F]{4})", line)
        if line == b"?":
            self.send_identity()
        elif not match or int(match[2], 16) != checksum(match[1]):
            if line:
                self.send("E,line,failed its check")
        else:
            command, _, argument = match[1].decode("ascii").partition(",")
            if command == "identify":
                self.send_identity()
            elif command in self.commands:
                self.answer(command, argument)
            else:
                self.send(f"E,{command},unknown; the {self.device} knows {self.known()}")

    def known(self) -> str:
        """Return the commands that the board obeys."""
        return " ".join(("identify", *self.commands))

    def send(self, payload: str) -> None:
        """Send a frame."""
        self._sent += encode(payload)

    def send_identity(self) -> None:
        """Send the board's description of itself."""
        entries = (
            {"protocol": 1, "firmware": self.firmware}
            | self.entries()
            | {"uptime_ms": self.uptime_ms}
        )
        self.send(f"I,{self.device}," + ",".join(f"{key}={entries[key]}" for key in entries))

    def begin(self) -> None:
        """Set the state after power-on."""
        raise NotImplementedError

    def entries(self) -> dict[str, object]:
        """Return the entries of the board's description."""
        raise NotImplementedError

    def answer(self, command: str, argument: str) -> None:
        """Obey a command that the board knows."""
        raise NotImplementedError


class StandInLogger(StandIn):
    """A logger that answers and samples as its firmware does; see docs/protocol.md."""

    device, firmware = "logger", "1.1"
    commands = ("start", "pause")

    def __init__(self) -> None:
        self._voltages_mv = [0.0] * 4
        self._end_stop_closed = False
        super().__init__()

    def begin(self) -> None:
        """Set the state after power-on."""
        self._periods = 0
        self._sequence = 0
        self._running = False
        self._closed_before = False

    def entries(self) -> dict[str, object]:
        """Return the entries of the board's description."""
        electronics = {"rate_hz": 10, "channels": 4, "adc_bits": 10, "vref_mv": 5000}
        state = "running" if self._running else "paused"
        return {**electronics, "series_ohm": 12000, "state": state}

    def set_voltages(self, from_mv: list[float], to_mv: list[float]) -> None:
        """Set the analogue inputs to the voltages at the end of the stretch."""
        del from_mv
        self._voltages_mv = [float(voltage) for voltage in to_mv]

    def set_end_stop(self, closed: bool) -> None:
        """Press or release the end stop."""
        self._end_stop_closed = closed

    def advance(self, until_us: int) -> None:
        """Run to a point in time."""
        while (moment := self._started_us + (self._periods + 1) * PERIOD_US) <= until_us:
            self._now_us = moment
            self._periods += 1
            if self._running:
                self._send_sample()
        self._now_us = until_us

    def answer(self, command: str, argument: str) -> None:
        """Obey a command that the board knows."""
        if argument:
            self.send(f"E,{command},takes no argument")
        else:
            self._running = command == "start"
            self.send(f"A,{command}")

    def _send_sample(self) -> None:
        counts = [min(max(int(mv * 1024 / 5000), 0), 1023) for mv in self._voltages_mv]
        at_end = self._end_stop_closed and self._closed_before
        self._closed_before = self._end_stop_closed
        cells = [self._sequence, self._periods * 100, *counts, int(at_end)]
        self.send("D," + ",".join(map(str, cells)))
        self._sequence += 1
