"""Make sources of the Lab Streaming Layer on this computer, separate for each test."""

import os
import uuid
from collections.abc import Callable, Sequence
from pathlib import Path

import pylsl

from support.bench.waiting import wait_until

# A container may have no multicast. The session's name keeps other programs out.
CONFIGURATION = f"""[ports]
IPv6 = disable
[multicast]
ResolveScope = machine
[lab]
KnownPeers = {{127.0.0.1}}
SessionID = {uuid.uuid4().hex}
[log]
level = -3
"""
PERIOD_S = 0.1
pylsl.set_config_content(CONFIGURATION)


def environment(folder: Path) -> dict[str, str]:
    """Return the environment variables of a program that receives the sources of this process."""
    path = folder / "lsl_api.cfg"
    path.write_text(CONFIGURATION, encoding="utf-8")
    return {**os.environ, "LSLAPICFG": str(path)}


def describe(
    name: str, channels: int = 4, *, rate_hz: float = 10.0, source_id: str = "", **entries: object
) -> pylsl.StreamInfo:
    """Return the description of a stream, with ``labels``, ``units`` and ``board`` if given."""
    kind = entries.get("kind", pylsl.cf_double64)
    info = pylsl.StreamInfo(name, "Tactile", channels, rate_hz, kind, source_id)
    listed = info.desc().append_child("channels")
    labels = entries.get("labels", [f"sensor_{n + 1}" for n in range(channels)])
    for label, unit in zip(labels, entries.get("units", ["counts"] * channels), strict=True):
        channel = listed.append_child("channel")
        channel.append_child_value("label", label)
        channel.append_child_value("unit", unit)
    board = info.desc().append_child("capsule")
    for key, text in entries.get("board", {}).items():
        board.append_child_value(key, text)
    return info


class Source:
    """A stream that a test feeds; sample n has the time of n periods.

    Parameters
    ----------
    **description : object
        Arguments of `describe`.
    """

    def __init__(self, name: str, **description: object) -> None:
        self._description = {"name": name, **description}
        self._from_s = pylsl.local_clock()
        self._outlet: pylsl.StreamOutlet | None = None
        self.begin()

    def begin(self) -> None:
        """Open the stream."""
        self._outlet = pylsl.StreamOutlet(describe(**self._description))

    def end(self) -> None:
        """Close the stream, as a program that ends does."""
        self._outlet = None

    def wait_for_listener(self) -> None:
        """Wait until a program receives the stream."""
        assert self._outlet.wait_for_consumers(30.0), "nobody has listened to the stream in 30 s"

    def send(self, numbers: Sequence[int], reading: Callable[[int], list] | None = None) -> None:
        """Send the samples with these numbers at once."""
        for number in numbers:
            values = reading(number) if reading else readings_of(number)
            self._outlet.push_sample(values, self._from_s + number * PERIOD_S)


def readings_of(number: int) -> list[float]:
    """Return the readings of sample n, which contain its number."""
    return [float(number), number + 0.5, float(number % 7), 1000.0 - number]


def wait_for_lines(folder: Path, lines: int) -> None:
    """Wait until this number of samples, including missing ones, is on the disk."""

    def are_there() -> bool:
        text = "".join(path.read_text(encoding="utf-8") for path in folder.rglob("*.part"))
        return sum(line[:1].isdigit() for line in text.splitlines()) >= lines

    wait_until(are_there, f"{lines} samples in the unfinished recording")
