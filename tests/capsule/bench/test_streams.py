"""Samples from and to streams of the Lab Streaming Layer, over real streams on this computer."""

import contextlib
import math
import os
import subprocess
import sys
import uuid
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pylsl
import pytest

from capsule.bench import lsl
from capsule.bench.bench_errors import AcquisitionError, BoardNotFoundError
from capsule.bench.lsl import StampGrid, StreamLine, choose, find_stream, ranges_of
from capsule.bench.protocol import Damaged
from capsule.errors import CapsuleError
from support.bench import emulated
from support.bench.cable import TerminalCable
from support.bench.recorder import Recorder, wait_until
from support.bench.workbench import Clock, Workbench
from support.project import ROOT

needs_streams = pytest.mark.boards

RULES = {"sensors": 4, "rate_hz": 10}
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
    info.set_channel_labels(entries.get("labels", [f"sensor_{n + 1}" for n in range(channels)]))
    info.set_channel_units(entries.get("units", ["counts"] * channels))
    channel = info.desc().child("channels").child("channel")
    for gain in entries.get("gains", ""):
        channel.append_child_value("gain", gain)
        channel = channel.next_sibling("channel")
    board = info.desc().append_child("capsule")
    for key, text in entries.get("board", {}).items():
        board.append_child_value(key, text)
    return info


class Source:
    """A stream that a test feeds, described by `describe`; sample n has the time of n periods."""

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


@pytest.fixture
def name():
    """Return a name that no other stream has."""
    return f"stream-{uuid.uuid4().hex}"


@pytest.fixture
def record(tmp_path):
    """Return a function that starts capsule record so that it receives the streams of this test."""
    yield lambda *options: Recorder(tmp_path, "--unlabelled", *options, env=environment(tmp_path))
    Recorder.end_all()


@needs_streams
@pytest.mark.waits
@pytest.mark.parametrize("source_id", ["one and the same", ""], ids=["own recovery", "no recovery"])
def test_a_stream_that_loses_samples_and_begins_again_has_a_row_for_each(name, record, source_id):
    source = Source(name, source_id=source_id and name)
    recorder = record("--stream-in", name, "--site", "a", "--duration", "8")
    source.wait_for_listener()
    lost = [12, 13, *range(30, 45)]
    source.send([number for number in range(30) if number not in lost])
    # On the disk while the recording goes on.
    recorder.wait_for_samples(30)
    source.end()
    source.begin()
    source.wait_for_listener()
    source.send(range(45, 81))
    wait_until(recorder.done)
    recorder.expect(0, name, "2 gaps (17 samples missing)", "ended: --duration is over")
    assert recorder.parts() == []
    recording = recorder.recording()
    np.testing.assert_allclose(np.diff(recording.time_s), 0.1, atol=1e-9)
    expected = np.array([readings_of(number) for number in range(80)]).T
    expected[:, lost] = np.nan
    np.testing.assert_array_equal(recording.values, expected)
    header = recording.header
    assert header["source"].startswith(f"recorded from the LSL stream '{name}' (type Tactile")
    assert (header["unit"], header["rate_hz"], header["site"]) == ("counts", "10", "a")
    assert header["stream_channels"] == "sensor_1, sensor_2, sensor_3, sensor_4"
    assert "adc_bits" not in header and "corrected" in header["stream_time"]


@needs_streams
@emulated.needed
def test_what_a_board_sends_goes_out_as_a_stream(tmp_path, name, record):
    cable = TerminalCable(emulated.EmulatedBoard(emulated.LOGGER), tmp_path / "ttyACM0")
    bench = Workbench(cable, world=Clock(cable.board), speed=10)
    recorder = record("--port", cable.port, "--duration", "20", "--stream-out", name)
    # It listens all the time: on a busy computer, an answer may come late.
    resolver = pylsl.ContinuousResolver("name", name)
    bench.run(resolver.results)
    inlet = pylsl.StreamInlet(resolver.results()[0])
    info = inlet.info(10.0)
    inlet.open_stream(10.0)
    samples = []

    def listen():
        with contextlib.suppress(pylsl.util.LostError):  # the recorder has ended
            samples.extend(inlet.pull_chunk(0.0)[0])
        return recorder.done()

    bench.run(listen)
    recorder.expect(0, "200 samples", "no gap")
    assert (info.nominal_srate(), info.type()) == (10.0, "Tactile")
    assert info.get_channel_labels() == [f"sensor_{n}" for n in range(1, 5)]
    assert info.get_channel_units() == ["counts"] * 4
    told, header = choose(info, None, RULES)[1], recorder.recording().header
    assert told["source"].startswith(header["source"])
    board = ("adc_bits", "vref_v", "series_ohm")
    assert [told[key] for key in board] == [header[key] for key in board]
    # Who listens later hears less; what is heard is what the file holds, one after the other.
    rows = recorder.recording().values.T.tolist()
    begin = rows.index(samples[0])
    assert samples == rows[begin : begin + len(samples)]
    assert len(samples) > 50


def test_our_own_stream_is_recorded_with_what_it_tells_of_its_board(name):
    board = {"adc_bits": "12", "vref_v": "3.3", "source": "recorded by the logger board"}
    _, header = choose(describe(name, board=board), None, RULES)
    assert ranges_of(header) == {"adc_bits": "12", "full_scale": "4095.0"}
    assert (header["adc_bits"], header["vref_v"]) == ("12", "3.3")
    assert header["source"].startswith("recorded by the logger board; recorded from the LSL")


@pytest.mark.parametrize(
    ("wanted", "channels"),
    [("b,c,d,a", (1, 2, 3, 0)), ("6,5,4,3", (5, 4, 3, 2)), ("2, f, 1, e", (1, 5, 0, 4))],
)
def test_channels_are_chosen_by_label_or_number(wanted, channels):
    info = describe("x", 6, labels=list("abcdef"))
    assert choose(info, wanted, RULES)[0] == channels


def test_a_gain_of_a_channel_that_is_not_recorded_is_no_matter():
    assert choose(describe("x", 5, gains="11115"), "4,3,2,1", RULES)[0] == (3, 2, 1, 0)


@pytest.mark.parametrize(
    ("settings", "wanted", "words"),
    [
        ({"channels": 6}, None, r"6 channels \(1 sensor_1, .*recording\.sensors is 4.*--stream-ch"),
        ({"channels": 6}, "1,2,3,9", r"has no channel '9'.*it has 1 sensor_1"),
        ({"channels": 6, "labels": list("aabcde")}, "a,b,c,d", "no channel 'a', or several"),
        ({}, "1,2,3,3", "names 3 different channels; recording.sensors is 4"),
        ({"rate_hz": 250.0}, None, r"rate of 250 Hz, .*configured for 10 Hz.*LabRecorder"),
        ({"rate_hz": 0.0}, None, "has no nominal rate.*LabRecorder"),
        ({"kind": pylsl.cf_string}, None, "sends text, not numbers"),
        ({"units": ["microvolts"] * 4}, None, "in microvolts; all channels .*counts, V"),
        ({"units": ["V", "V", "counts", "V"]}, None, "in V, counts; all channels .*the same unit"),
        ({"channels": 5, "gains": "11115"}, "1,2,3,5", "says 'gain: 5', and not .*capsule import"),
    ],
)
def test_a_stream_that_does_not_fit_is_refused_by_name(settings, wanted, words):
    with pytest.raises(AcquisitionError, match=words) as refusal:
        choose(describe("left hand", **settings), wanted, RULES)
    assert "'left hand'" in str(refusal.value) or "--stream-channels" in str(refusal.value)


@needs_streams
def test_no_stream_and_two_of_one_name_are_told_apart(name):
    with pytest.raises(BoardNotFoundError, match=rf"there is no LSL stream '{name}'; start its"):
        find_stream(pylsl, name, 0.1)
    first, second = Source(name, source_id="first"), Source(name, source_id=f"second {name}")
    wait_until(lambda: len(pylsl.resolve_byprop("name", name, 2, 1.0)) == 2)
    with pytest.raises(BoardNotFoundError, match=r"2 LSL streams .*'first' .* the source id to"):
        find_stream(pylsl, name, 10.0)
    assert find_stream(pylsl, f"second {name}", 10.0).source_id() == f"second {name}"
    first.end()
    second.end()


@needs_streams
def test_a_reading_that_is_no_number_is_kept_in_the_log_and_its_sample_is_missing(name):
    source = Source(name, labels=["a", "b", "c", "d"])
    line = StreamLine(name, "d,c,b,a", RULES, print)
    source.wait_for_listener()
    source.send([0, 1, 2], lambda n: [n, 1, 2, math.nan if n == 1 else 3])
    events = []
    wait_until(lambda: events.extend(line.read(0.05)) or len(events) == 3)
    first, odd, last = (arrival.event for arrival in events)
    assert first.counts == (3, 2, 1, 0) and last.counts == (3, 2, 1, 2)
    assert (first.sequence, last.sequence, last.device_ms) == (0, 2, 200)
    assert isinstance(odd, Damaged) and b"nan" in odd.content
    line.close()


@pytest.mark.parametrize("drift", [-0.003, 0.0, 0.003])
def test_the_grid_follows_a_drifting_clock_and_keeps_gaps(drift):
    generator = np.random.default_rng(3)
    numbers = np.delete(np.arange(5000), [20, 21, 22, 3000])
    stamps = 7e5 + numbers * 0.1 * (1 + drift) + generator.uniform(-0.03, 0.03, numbers.size)
    grid = StampGrid(0.1)
    assert [grid.number(stamp) for stamp in stamps] == numbers.tolist()


def test_a_stamp_that_is_far_off_moves_none_after_it():
    grid = StampGrid(0.1)
    assert [grid.number(stamp) for stamp in (5.0, 5.1, 1e6, 5.2, 5.3)] == [0, 1, 9999950, 2, 3]


def test_without_pylsl_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pylsl", None)
    with pytest.raises(CapsuleError, match=r'--stream-in needs pylsl.*install -e "\.\[lsl\]"'):
        lsl.import_pylsl("--stream-in")


def test_nothing_of_streams_is_imported_for_those_who_ask_for_none():
    code = f"""if True:
        import sys
        sys.path.insert(0, {str(ROOT / "workflow/scripts")!r})
        import capsule.bench.recorder
        print("pylsl" in sys.modules)
    """
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
