"""Samples from and to streams of the Lab Streaming Layer, over real streams on this computer."""

import math
import sys
import threading
import time
import uuid
from unittest.mock import Mock

import numpy as np
import pylsl
import pytest

from capsule.bench import lsl, recorder
from capsule.bench.bench_errors import AcquisitionError, BoardNotFoundError
from capsule.bench.lsl import StampGrid, choose, find_stream, ranges_of
from capsule.bench.state import State
from capsule.errors import CapsuleError
from capsule.interface.archive import read_recording
from support.command import parsers

RULES = {"sensors": 4, "rate_hz": 10}
# A container may have no multicast. The session's name keeps other programs out.
pylsl.set_config_content(f"""[ports]
IPv6 = disable
[multicast]
ResolveScope = machine
[lab]
KnownPeers = {{127.0.0.1}}
SessionID = {uuid.uuid4().hex}
[log]
level = -3
""")


def describe(name, channels=4, *, rate_hz=10.0, source_id="", kind=pylsl.cf_double64, **entries):
    """Return the description of a stream, with ``labels``, ``units`` and ``gains`` if given."""
    info = pylsl.StreamInfo(name, "Tactile", channels, rate_hz, kind, source_id)
    info.set_channel_labels(entries.get("labels", [f"sensor_{n + 1}" for n in range(channels)]))
    info.set_channel_units(entries.get("units", ["counts"] * channels))
    channel = info.desc().child("channels").child("channel")
    for gain in entries.get("gains", ""):
        channel.append_child_value("gain", gain)
        channel = channel.next_sibling("channel")
    return info


def readings_of(number):
    """Return the readings of sample n, which contain its number; one of the 20th is none."""
    return [math.nan if number == 20 else number, number + 0.5, number % 7, 1000.0 - number]


def send(outlet, from_s, numbers):
    """Send the samples with these numbers at once, as soon as a program listens."""
    assert outlet.wait_for_consumers(30.0), "nobody has listened to the stream in 30 s"
    for number in numbers:
        outlet.push_sample(readings_of(number), from_s + number / RULES["rate_hz"])


@pytest.mark.boards
@pytest.mark.waits
@pytest.mark.parametrize("source_id", ["one and the same", ""], ids=["own recovery", "no recovery"])
def test_a_stream_that_loses_samples_has_all_rows(tmp_path, monkeypatch, capfd, source_id):
    name, from_s = uuid.uuid4().hex, pylsl.local_clock()
    info = describe(name, source_id=source_id and name)
    part, heard = tmp_path / "unlabelled/r01.csv.part", []

    def feed():
        outlet = pylsl.StreamOutlet(info)
        send(outlet, from_s, [number for number in range(30) if number not in (12, 13)])
        until_s = time.monotonic() + 30.0
        # On the disk while the recording goes on.
        while not part.exists() or "\n2.9," not in part.read_text():
            assert time.monotonic() < until_s
            time.sleep(0.02)
        listening = pylsl.StreamInlet(find_stream(pylsl, f"{name}-out", 30.0))
        listening.open_stream(30.0)
        del outlet
        outlet = pylsl.StreamOutlet(info)
        send(outlet, from_s, range(45, 81))
        heard.append(listening.pull_sample(30.0)[0])

    feeding = threading.Thread(target=feed)
    feeding.start()
    monkeypatch.chdir(tmp_path)  # so that the configuration is that of the program
    words = f"--unlabelled --stream-in {name} --stream-channels 4,3,2,1 --stream-out {name}-out"
    words += f" --name r01 --raw {tmp_path} --logs {tmp_path} --duration 8"
    recorder.record(parsers()["record"].parse_args(words.split()))
    feeding.join(30.0)
    assert heard == [readings_of(45)[::-1]]  # samples that are missing do not go out
    said, lost = capfd.readouterr().out, [12, 13, 20, *range(30, 45)]
    assert "ended: --duration is over" in said
    assert "3 gaps (18 samples missing) | 1 damaged frames" in said
    assert "nan" in (tmp_path / "unlabelled/r01.log").read_text()
    recording = read_recording(tmp_path / "unlabelled/r01.csv", 4)
    np.testing.assert_allclose(np.diff(recording.time_s), 0.1, atol=1e-9)
    expected = np.array([readings_of(number)[::-1] for number in range(80)]).T
    expected[:, lost] = np.nan
    np.testing.assert_array_equal(recording.values, expected)
    told = "sensor_4, sensor_3, sensor_2, sensor_1"
    assert (recording.header["stream_channels"], recording.header["unit"]) == (told, "counts")


# Kills: a stream that sends a sample twice, or each at the time of the last one.
def test_our_own_stream_tells_of_its_board_and_sends_each_sample_once_at_its_time(monkeypatch):
    opened = Mock()
    monkeypatch.setattr(pylsl, "StreamOutlet", opened)
    board = {"source": "recorded by the logger board", "adc_bits": "12", "vref_v": "3.3"}
    outlet, state = lsl.SampleOutlet("x", board | {"rate_hz": "10"}, 4, "3mm/r01"), State(0.1)
    first = [(1, 2, 3, 4), None, (5, 6, 7, 8)]
    for now_s, new in ((100.0, first), (100.1, []), (100.1, [(9, 0, 0, 0)])):
        monkeypatch.setattr(pylsl, "local_clock", Mock(return_value=now_s))
        for counts in new:
            state.add(counts)
        outlet.send(state)
    sent = [call.args for call in opened().push_sample.mock_calls]
    assert [counts for counts, _ in sent] == [[1, 2, 3, 4], [5, 6, 7, 8], [9, 0, 0, 0]]
    assert [stamp_s for _, stamp_s in sent] == pytest.approx([99.8, 100.0, 100.1])
    info = opened.call_args_list[0].args[0]
    assert (info.name(), info.nominal_srate(), info.type()) == ("x", 10.0, "Tactile")
    assert info.get_channel_labels() == [f"sensor_{n}" for n in range(1, 5)]
    _, header = choose(info, None, RULES)
    assert ranges_of(header) == {"adc_bits": "12", "full_scale": "4095.0"}
    assert (header["adc_bits"], header["vref_v"], header["unit"]) == ("12", "3.3", "counts")
    assert header["source"].startswith("recorded by the logger board; recorded from the LSL")


# Kills: a stream that is refused for the gain of a channel that is not recorded.
def test_channels_are_chosen_by_label_or_number_and_a_stream_that_does_not_fit_is_refused():
    info = describe("x", 6, labels=list("abcdef"), gains="111115")
    chosen = {"b,c,d,a": (1, 2, 3, 0), "5,4,3,2": (4, 3, 2, 1), "2, e, 1, d": (1, 4, 0, 3)}
    for wanted, channels in chosen.items():
        assert choose(info, wanted, RULES)[0] == channels
    for settings, wanted, words in (
        ({"channels": 6}, None, r"6 channels \(1 sensor_1, .*recording\.sensors is 4.*--stream-ch"),
        ({"channels": 6, "labels": list("aabcde")}, "a,b,c,d", "no channel 'a', or several"),
        ({}, "1,2,3,3", "names 3 different channels; recording.sensors is 4"),
        ({"rate_hz": 250.0}, None, r"rate of 250 Hz, .*configured for 10 Hz.*LabRecorder"),
        ({"rate_hz": 0.0}, None, "has no nominal rate.*LabRecorder"),
        ({"kind": pylsl.cf_string}, None, "sends text, not numbers"),
        ({"units": ["microvolts"] * 4}, None, "in microvolts; all channels .*counts, V"),
        ({"units": ["V", "V", "counts", "V"]}, None, "in V, counts; all channels .*the same unit"),
        ({"channels": 5, "gains": "11115"}, "1,2,3,5", "says 'gain: 5', and not .*capsule import"),
    ):
        with pytest.raises(AcquisitionError, match=words) as refusal:
            choose(describe("left hand", **settings), wanted, RULES)
        assert "'left hand'" in str(refusal.value) or "--stream-channels" in str(refusal.value)


@pytest.mark.boards
def test_no_stream_and_two_of_one_name_are_told_apart():
    name = uuid.uuid4().hex
    with pytest.raises(BoardNotFoundError, match=rf"there is no LSL stream '{name}'; start its"):
        find_stream(pylsl, name, 0.1)
    ids = ("first", f"second {name}")
    two = [pylsl.StreamOutlet(describe(name, source_id=source_id)) for source_id in ids]
    assert len(pylsl.resolve_byprop("name", name, minimum=2, timeout=30.0)) == 2
    with pytest.raises(BoardNotFoundError, match=r"2 LSL streams .*'first' .* the source id to"):
        find_stream(pylsl, name, 10.0)
    assert find_stream(pylsl, f"second {name}", 10.0).source_id() == f"second {name}"
    del two


@pytest.mark.parametrize("drift", [-0.003, 0.003])
def test_the_grid_follows_a_drifting_clock_and_keeps_gaps(drift):
    generator = np.random.default_rng(3)
    numbers = np.delete(np.arange(5000), [20, 21, 22, 3000])
    stamps = 7e5 + numbers * 0.1 * (1 + drift) + generator.uniform(-0.03, 0.03, numbers.size)
    grid = StampGrid(0.1)
    assert [grid.number(stamp) for stamp in stamps] == numbers.tolist()
    grid = StampGrid(0.1)  # a stamp that is far off moves none after it
    assert [grid.number(stamp) for stamp in (5.0, 5.1, 1e6, 5.2, 5.3)] == [0, 1, 9999950, 2, 3]


def test_without_pylsl_the_extra_is_named_to_those_who_ask_for_streams(monkeypatch):
    assert not hasattr(lsl, "pylsl")
    monkeypatch.setitem(sys.modules, "pylsl", None)
    with pytest.raises(CapsuleError, match=r'--stream-in needs pylsl.*install -e "\.\[lsl\]"'):
        lsl.import_pylsl("--stream-in")
