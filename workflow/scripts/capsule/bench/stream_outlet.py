"""Send the samples of a recording as a stream of the Lab Streaming Layer."""

from collections.abc import Callable, Mapping

from capsule.bench.lsl import import_pylsl
from capsule.bench.stream_choice import BOARD, BOARD_ENTRIES
from capsule.bench.terminal import Progress

Samples = list[tuple[float, ...] | None]


class SampleOutlet:
    """A stream that sends each sample once, with the time at which it was read.

    Parameters
    ----------
    name : str
        The stream's name.
    header : mapping of str to str
        Header of the recording; the stream's description repeats it.
    sensors : int
        Number of sensors S.
    recording : str
        The recording's name.

    Raises
    ------
    AcquisitionError
        pylsl is not installed.
    """

    def __init__(self, name: str, header: Mapping[str, str], sensors: int, recording: str) -> None:
        self._lsl = lsl = import_pylsl("--stream-out")
        rate_hz = float(header["rate_hz"])
        # The same for each run, so that listeners reconnect to the next run.
        source_id = f"origami-capsule {name}"
        info = lsl.StreamInfo(name, "Tactile", sensors, rate_hz, lsl.cf_float32, source_id)
        channels = info.desc().append_child("channels")
        for sensor in range(1, sensors + 1):
            channel = channels.append_child("channel")
            channel.append_child_value("label", f"sensor_{sensor}")
            channel.append_child_value("unit", header.get("unit", "counts"))
            channel.append_child_value("type", "Tactile")
        board = info.desc().append_child(BOARD)
        for key in ("source", *BOARD_ENTRIES):
            if key in header:
                board.append_child_value(key, header[key])
        board.append_child_value("recording", recording)
        self._outlet = lsl.StreamOutlet(info)
        self._sent = 0

    def send(self, progress: Progress) -> None:
        """Send the new samples; skip missing ones, so that the time stamps show the gap."""
        new = min(progress.places - self._sent, len(progress.recent))
        self._sent = progress.places
        now_s = self._lsl.local_clock()
        for behind in range(new - 1, -1, -1):
            sample = progress.recent[-1 - behind]
            if sample is not None:
                self._outlet.push_sample(list(sample), now_s - behind * progress.period_s)


def watched_and_sent(
    watch: Callable[[Progress, Samples], None], outlet: SampleOutlet
) -> Callable[[Progress, Samples], None]:
    """Return a function that sends the new samples, then calls `watch`."""

    def both(progress: Progress, samples: Samples) -> None:
        outlet.send(progress)
        watch(progress, samples)

    return both
