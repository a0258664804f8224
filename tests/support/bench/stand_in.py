"""The logger imitated in plain Python, for systems without the emulator."""

import re

from acquisition.protocol import checksum, encode

PERIOD_US = 100_000


class StandInLogger:
    """Answers and samples as the logger's firmware does; docs/protocol.md describes both."""

    baud = 115200

    def __init__(self) -> None:
        self._voltages_mv = [0.0] * 4
        self._end_stop_closed = False
        self._now_us = 0
        self.reset()

    def reset(self) -> None:
        """Press the reset button."""
        self._started_us = self._now_us
        self._periods = 0
        self._sequence = 0
        self._running = False
        self._closed_before = False
        self._line = b""
        self._sent = b""
        self._send_identity()

    def set_voltages(self, from_mv: list[float], to_mv: list[float]) -> None:
        """Set the analogue inputs; they stay at the end of the stretch."""
        del from_mv
        self._voltages_mv = [float(voltage) for voltage in to_mv]

    def set_end_stop(self, closed: bool) -> None:
        """Press or release the end stop."""
        self._end_stop_closed = closed

    def skip(self, until_us: int) -> None:
        """Let time pass without the firmware."""
        self._now_us = until_us

    def advance(self, until_us: int) -> None:
        """Run to a point in time."""
        while (moment := self._started_us + (self._periods + 1) * PERIOD_US) <= until_us:
            self._now_us = moment
            self._periods += 1
            if self._running:
                self._send_sample()
        self._now_us = until_us

    def take_sent(self) -> bytes:
        """Take what was sent."""
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
            self._send_identity()
        elif not match or int(match[2], 16) != checksum(match[1]):
            if line:
                self._send("E,line,failed its check")
        else:
            self._answer(match[1].decode("ascii"))

    def _answer(self, payload: str) -> None:
        command, _, argument = payload.partition(",")
        if argument:
            self._send(f"E,{command},takes no argument")
        elif command == "identify":
            self._send_identity()
        elif command in ("start", "pause"):
            self._running = command == "start"
            self._send(f"A,{command}")
        else:
            self._send(f"E,{command},unknown; the logger knows identify start pause")

    def _send(self, payload: str) -> None:
        self._sent += encode(payload)

    def _send_identity(self) -> None:
        state = "running" if self._running else "paused"
        uptime_ms = (self._now_us - self._started_us) // 1000
        self._send(
            "I,logger,protocol=1,firmware=1.0,rate_hz=10,channels=4,adc_bits=10,vref_mv=5000,"
            f"series_ohm=12000,state={state},uptime_ms={uptime_ms}"
        )

    def _send_sample(self) -> None:
        counts = [min(max(int(mv * 1024 / 5000), 0), 1023) for mv in self._voltages_mv]
        at_end = self._end_stop_closed and self._closed_before
        self._closed_before = self._end_stop_closed
        cells = [self._sequence, self._periods * 100, *counts, int(at_end)]
        self._send("D," + ",".join(map(str, cells)))
        self._sequence += 1
