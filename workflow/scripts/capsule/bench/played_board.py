"""A logger board that plays a simulated run at a port of this computer, for the demo."""

import contextlib
import math
import re
import select
import socket
import threading
import time
from collections.abc import Iterator

from capsule.arrays import IntArray
from capsule.bench.protocol import checksum, encode
from capsule.phantom.sensor import Electronics

# Longest wait for a command, so that the end of the demo is seen.
_LOOK_EVERY_S = 0.05
_FRAME = re.compile(rb"\$([^*$]*)\*([0-9A-F]{4})")


class PlayedLogger:
    """A logger that sends the readings of a run, one each period (docs/protocol.md).

    Parameters
    ----------
    counts : (S, K) array
        The readings; the last one is at the end stop, and is repeated.
    electronics : Electronics
        Electronics of the simulated bench.
    """

    def __init__(self, counts: IntArray, electronics: Electronics) -> None:
        self._counts, self._electronics = counts, electronics
        self.period_s = 1 / electronics.rate_hz
        self.begin()

    def begin(self) -> None:
        """Start as after power-on."""
        self.running = False
        self._periods = self._sent = 0
        self._line = b""

    @property
    def next_at_s(self) -> float:
        """Time of the next sample, in seconds since the board started."""
        return (self._periods + 1) * self.period_s

    def answer(self, received: bytes, now_s: float) -> bytes:
        """Return the answers to the commands in these bytes, at a time since the board started."""
        *lines, self._line = (self._line + received.replace(b"\r", b"")).split(b"\n")
        return b"".join(self._obey(line, now_s) for line in lines)

    def _obey(self, line: bytes, now_s: float) -> bytes:
        frame = _FRAME.fullmatch(line[max(line.rfind(b"$"), 0) :])
        command = b"identify" if line.endswith(b"?") else b""
        if frame and int(frame[2], 16) == checksum(frame[1]):
            command = frame[1]
        if command == b"identify":
            return self.identity(now_s)
        if command in (b"start", b"pause"):
            if command == b"start" and not self.running:
                self._periods = math.ceil(now_s / self.period_s)
            self.running = command == b"start"
            return encode(f"A,{command.decode()}")
        return encode("E,line,failed its check or is unknown") if line else b""

    def identity(self, now_s: float) -> bytes:
        """Return the board's description of itself."""
        electronics = self._electronics
        entries = {
            "protocol": 1,
            "firmware": "1.0",
            "rate_hz": f"{electronics.rate_hz:g}",
            "channels": len(self._counts),
            "adc_bits": electronics.adc_bits,
            "vref_mv": round(electronics.vref_v * 1000),
            "series_ohm": round(electronics.series_ohm),
            "state": "running" if self.running else "paused",
            "uptime_ms": int(now_s * 1000),
        }
        return encode("I,logger," + ",".join(f"{key}={value}" for key, value in entries.items()))

    def sample(self) -> bytes:
        """Return the next sample."""
        self._periods += 1
        last = self._counts.shape[1] - 1
        counts = self._counts[:, min(self._sent, last)].tolist()
        stamp_ms = round(self._periods * self.period_s * 1000)
        cells = [self._sent, stamp_ms, *counts, int(self._sent >= last)]
        self._sent += 1
        return encode("D," + ",".join(map(str, cells)))


@contextlib.contextmanager
def played_board(counts: IntArray, electronics: Electronics, speed: float) -> Iterator[str]:
    """Plug in a board that plays a run while the context lasts.

    Parameters
    ----------
    counts : (S, K) array
        The readings.
    electronics : Electronics
        Electronics of the simulated bench.
    speed : float
        Seconds of the board per second of the wall clock.

    Yields
    ------
    str
        Name of the port.
    """
    board, over = PlayedLogger(counts, electronics), threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as server:
        player = threading.Thread(target=_play, args=(board, server, speed, over), daemon=True)
        player.start()
        try:
            yield f"socket://127.0.0.1:{server.getsockname()[1]}"
        finally:
            over.set()
            player.join()


def _play(board: PlayedLogger, server: socket.socket, speed: float, over: threading.Event) -> None:
    """Play to each program that opens the port; opening it starts the board anew."""
    while not over.is_set():
        if select.select([server], [], [], _LOOK_EVERY_S)[0]:
            connection, _ = server.accept()
            # A program that has gone is no fault of the board.
            with connection, contextlib.suppress(ConnectionError):
                board.begin()
                _play_to(board, connection, speed, over)


def _play_to(
    board: PlayedLogger, connection: socket.socket, speed: float, over: threading.Event
) -> None:
    begun_s = time.monotonic()
    connection.sendall(board.identity(0.0))
    while not over.is_set():
        now_s = (time.monotonic() - begun_s) * speed
        rest_s = (board.next_at_s - now_s) / speed if board.running else _LOOK_EVERY_S
        if select.select([connection], [], [], min(max(rest_s, 0.0), _LOOK_EVERY_S))[0]:
            received = connection.recv(4096)
            if not received:
                return
            now_s = (time.monotonic() - begun_s) * speed
            connection.sendall(board.answer(received, now_s))
        while board.running and board.next_at_s <= (time.monotonic() - begun_s) * speed:
            connection.sendall(board.sample())
