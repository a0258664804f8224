"""A recording against a scripted serial line, also of any bytes: what arrives is kept."""

import contextlib
import errno
import itertools
import os
import tempfile
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from capsule.bench import bench_errors, growing_file
from capsule.bench.bench_errors import AcquisitionError, BoardLostError, LineLostError
from capsule.bench.protocol import encode
from capsule.interface.archive import read_recording
from support.bench.scripted import ScriptedBench, identity_frame, sample_frame


def samples(first, last):
    """Return samples with these numbers, each with its time."""
    return [(number / 10, sample_frame(number)) for number in range(first, last)]


def together(first, last):
    return b"".join(map(sample_frame, range(first, last)))


@pytest.fixture
def bench(tmp_path, monkeypatch):
    return ScriptedBench(tmp_path, monkeypatch)


# As far as anybody can tell, it may follow number 29.
PLAUSIBLE_FRAME = sample_frame(999, 6000, 55)
JUMPED = [(n / 10, sample_frame(n, 100 * n + 10**9)) for n in range(30, 80)]
CLOCK_ENDS = [(n / 10, sample_frame(n, (2**32 - 3000 + 100 * n) % 2**32)) for n in range(60)]
PRESSED = encode("D,30,3000,30,2,3,4,1")
# What another board says, and its samples.
OTHER = {"adc_bits": 12, "vref_mv": 3300, "rate_hz": 50}
STRANGERS = [(3 + n / 50, sample_frame(30 + n, 3000 + 20 * n)) for n in range(100)]
# Of a false frame: how many samples came before it, its number, and its time in ms.
FALSE_FRAMES = [
    (at, at + further, min(100 * at + ahead_ms, 9_999_999_999))
    for at in (0, 1, 30)
    for ahead_ms in (300, 5000, 20_000, 600_000, 2**31, 9_999_999_999)
    for further in (0, ahead_ms // 100, 1_234_567_890)
]
# Numbered again, earlier, more numbers than time, off the grid, a restart unannounced.
FALSE_FRAMES += [(30, 29, 3000), (30, 29, 2800), (30, 33, 3000), (30, 30, 2970), (30, 0, 100)]
WAVE = {"fault": "", "until": "end", "start": str, "summary": str, "serve": float, "leave": str}
U32, STATES = st.integers(0, 2**32 - 1), st.sampled_from(["running", "paused"])
PIECES = st.one_of(
    st.binary(max_size=60),
    st.integers(0, 300).map(sample_frame),
    st.builds(sample_frame, st.integers(0, 300), U32, U32),
    st.builds(identity_frame, uptime_ms=U32, adc_bits=st.sampled_from([10, 12]), state=STATES),
    st.text("DIAEP,=0123456789abc", max_size=40).map(lambda text: encode(f"D{text}")),
)


@pytest.mark.parametrize(
    ("script", "numbers", "rows"),
    [
        # After a stop (Ctrl-Z), what lies in the port is read first, also what the board is.
        ([*samples(0, 30), (15.0, identity_frame(uptime_ms=3000) + together(30, 150))],
         range(150), 150),
        # Nothing lay there: the board was lost meanwhile, and may still come back.
        ([*samples(0, 30), (11.0, b""), (11.1, b""), *samples(112, 120)],
         [*range(30), *range(112, 120)], 120),
        ([*samples(0, 30), *samples(33, 34), (3.35, PLAUSIBLE_FRAME), *samples(34, 60)],
         [*range(30), *range(33, 60)], 60),
        # What comes again is continued by the sample after a gap.
        ([*samples(0, 30), (3.05, sample_frame(28)), *samples(31, 40)],
         [*range(30), *range(31, 40)], 40),
        # A clock that jumped for good is not believed, but its samples are.
        ([*samples(0, 30), *JUMPED], range(80), 80),
        # The board's clock passes its end, with a gap just there.
        ([*CLOCK_ENDS[:29], *CLOCK_ENDS[32:]], [*range(29), *range(32, 60)], 60),
        # In doubt to the board's restart, or to the end.
        ([*samples(0, 30), *samples(33, 34), (3.4, identity_frame(uptime_ms=0)),
          (6.0, sample_frame(0)), (6.1, sample_frame(1))], [*range(30), 33, 0, 1], 62),
        ([*samples(0, 30), *samples(33, 34)], [*range(30), 33], 34),
        # A reading that no converter of 10 bits has.
        ([*samples(0, 30), (3.0, encode("D,30,3000,1024,2,3,4,0")), *samples(31, 40)],
         [*range(30), *range(31, 40)], 40),
        # The end stop, with the sample that it came with.
        ([*samples(0, 30), (3.0, PRESSED), *samples(31, 40)], range(31), 31),
    ],
)  # fmt: skip
def test_every_sample_is_kept_at_its_time(bench, script, numbers, rows):
    bench.run(script)
    assert bench.numbers() == list(numbers)
    assert len(bench.rows()) == rows
    state, known = bench.recorder.state, [bool(row[1]) for row in bench.rows()]
    gaps = sum(here and not there for here, there in itertools.pairwise(known))
    assert (state.missing, state.gaps) == (known.count(False), gaps)
    # While the board says that it runs, it is not told to start.
    assert ("start" in bench.sent) == ("clock started again" in " ".join(bench.told))


# Kills: a sample beyond the duration, also after a gap over its end; a switch whose wire is broken,
# taken for one that the capsule has pressed.
@pytest.mark.parametrize(
    ("script", "kept", "ended"),
    [
        # It passes while the recorder is stopped, and is filled from the port.
        ([*samples(0, 30), (20.0, together(30, 80))], range(60), "--duration is over"),
        ([*samples(0, 30), *samples(60, 80)], range(30), "--duration is over"),
        (samples(0, 60), range(60), "--duration is over"),  # nothing follows
        ([*samples(0, 30), *((3 + tick / 10, b"static\n") for tick in range(600))], range(30),
         "the logger at scripted sent no sample for 3 s (--duration is over)"),
        ([*samples(0, 30), (3.0, PRESSED)], range(31), "the capsule reached the end stop"),
        ([(3.0, PRESSED), (3.1, sample_frame(31))], [30],
         "the end stop was pressed from the start: its wire is broken"),
    ],
)  # fmt: skip
def test_a_recording_ends_with_its_duration_or_its_end_stop(bench, script, kept, ended):
    bench.recorder.patience_s, bench.recorder.state.end_s = 1000, 6.0
    with pytest.raises(BoardLostError) if "sent no" in ended else contextlib.nullcontext():
        bench.run(script)
    assert bench.now_s < 21
    assert bench.numbers() == list(kept)
    assert bench.recorder.state.ended.startswith(ended)


# Kills: a header with the time at which the command was typed.
def test_a_recording_started_with_its_first_sample(bench):
    # Read together, 9 s after the first one was taken.
    bench.run([(30.0, sample_frame(0)), (39.0, together(1, 91))])
    started = datetime.fromisoformat(read_recording(bench.path, 4).header["started"])
    assert (datetime.now(UTC) - started).total_seconds() == pytest.approx(9.5, abs=1)


@pytest.mark.parametrize(("at", "number", "device_ms"), FALSE_FRAMES)
def test_a_false_frame_that_passed_its_check_harms_nothing(bench, at, number, device_ms):
    false = sample_frame(999, device_ms, number)
    bench.run([*samples(0, at), (at / 10, false), *samples(at, 60)])
    assert bench.numbers() == list(range(60))
    assert len(bench.rows()) == 60


# Behind a line that was lost, or behind the same one.
@pytest.mark.parametrize(
    "script",
    [[(3.0, LineLostError())],
     [(3.0, identity_frame(**OTHER)), *STRANGERS, (5.9, identity_frame(uptime_ms=5900))]],
)  # fmt: skip
def test_another_board_is_refused_until_the_first_is_back(bench, script):
    bench.answers, bench.away_s = iter([OTHER, OTHER, {"uptime_ms": 5900}]), 1.0
    bench.run([*samples(0, 30), *script, *samples(60, 90)])
    # It ran on meanwhile, so its own clock tells the time.
    assert [int(row[1] or -1) for row in bench.rows()] == [*range(30), *(30 * [-1]), *range(60, 90)]
    told = "rate_hz=50 instead of 10, adc_bits=12 instead of 10, vref_mv=3300"
    assert " ".join(bench.told).count(told) == 1
    # It is asked once a second what it is.
    assert bench.sent.count("identify") == (0 if len(script) == 1 else 2)


# Kills: a sample in doubt that is lost with its board; a patience that begins anew with each return
# of a board that sends no sample.
@pytest.mark.parametrize(
    ("answer", "script", "kept", "until_s", "said"),
    [
        ({}, [(3 + n / 10, encode("A,pause")) for n in range(600)], [], 9, "sent no sample for 5"),
        (OTHER, [*samples(33, 34), (3.4, LineLostError())], [33], 26, "did not come back within"),
        ({}, [(3.0 + number, LineLostError()) for number in range(40)], [], 26, ""),
    ],
)  # fmt: skip
def test_a_recording_ends_by_patience(bench, answer, script, kept, until_s, said):
    bench.answers, bench.away_s = iter(40 * [answer]), 1.0
    with pytest.raises(BoardLostError, match=rf"{said}.*\(--patience\)"):
        bench.run([*samples(0, 30), *script])
    assert bench.now_s < until_s
    assert bench.numbers() == [*range(30), *kept]


# Kills: a restart that is not seen since the new clock has passed the old one meanwhile, or that of
# a board whose clock fits, but which has stopped by itself.
@pytest.mark.parametrize("uptime_ms", [584_000, 0, 2500, 5000, 22_000])
def test_a_gap_is_measured_by_the_computer_where_the_boards_clock_began_elsewhere(bench, uptime_ms):
    state = "paused" if uptime_ms == 22_000 else "running"
    bench.answers, bench.away_s = iter([{"uptime_ms": uptime_ms, "state": state}]), 1.0
    later = [(22 + n / 10, sample_frame(n, uptime_ms + 100 * n, n)) for n in range(1, 15)]
    bench.recorder.patience_s = 1000
    silence = [(3.0 + n / 10, b"") for n in range(180)]
    # Now and then the line delays: the least delay tells the time.
    delayed = [(n / 10 + 0.06 * (n % 3 == 2), sample_frame(n)) for n in range(30)]
    bench.run([*delayed, *silence, (21.0, LineLostError()), *later])
    assert [row[0] for row in bench.rows() if row[1]][30:33] == ["22.1", "22.2", "22.3"]
    assert bench.numbers() == [*range(30), *range(1, 15)]
    # A board that has stopped by itself only has to be started.
    assert ("its clock started again" in " ".join(bench.told)) == (state == "running")


# Kills: a fault of a detector or of the display that ends a recording, or is told at each sample.
def test_a_recording_goes_on_without_what_it_can_do_without(bench, capsys):
    bench.recorder.loop.add("verdicts", lambda: 1 / 0)
    bench.run(samples(0, 60))
    assert bench.numbers() == list(range(60))
    told = "warning: the recording goes on without verdicts: ZeroDivisionError: division by zero\n"
    assert capsys.readouterr().err == told
    assert bench.log.path.read_text().count("Traceback") == 1


# Kills: a wave whose end is told and not kept in the header, or told at each sample.
def test_a_wave_that_stops_ends_the_evidence_and_not_the_recording(bench):
    stops = {"fault": "no wave runs", "until": "2.0"}
    drive = bench.recorder.drive = SimpleNamespace(**WAVE)
    drive.serve = lambda recorded_s: vars(drive).update(stops if recorded_s > 2 else {})
    bench.run(samples(0, 30))
    assert read_recording(bench.path, 4).header["wave_until_s"] == "2.0"
    assert bench.told.count("warning: no wave runs") == 1
    assert bench.recorder.state.faults == ["no wave runs"]
    assert bench.numbers() == list(range(30))


# Kills: a file without samples in the way of the next run of that name; a wave that runs on.
@pytest.mark.parametrize(
    ("start", "said"),
    [(Mock(side_effect=AcquisitionError("refused")), "refused"), (str, "before the first sample")],
)
def test_a_run_that_ends_at_its_very_start_leaves_no_file_and_no_wave(bench, start, said):
    drive = bench.recorder.drive = SimpleNamespace(**WAVE | {"start": start, "leave": Mock()})
    with pytest.raises(AcquisitionError, match=said):
        bench.run([])
    assert drive.leave.called
    assert list(bench.part.path.parent.iterdir()) == []


# Kills: a line that is cut off on the disk; a full disk that ends a recording without its remedy.
@pytest.mark.parametrize("room", range(1000, 1013, 3))
def test_a_full_disk_keeps_the_lines_that_fit_and_names_the_recovery(bench, monkeypatch, room):
    really_write, written = os.write, []

    def write(descriptor, content):
        if sum(written) == room:
            raise OSError(errno.ENOSPC, "No space left on device")
        written.append(really_write(descriptor, content[: room - sum(written)]))
        return written[-1]

    monkeypatch.setattr(growing_file.os, "write", write)
    with pytest.raises(bench_errors.DiskFullError, match=r"disk is full.*--recover"):
        bench.run(samples(0, 200))
    monkeypatch.undo()
    assert bench.part.path.read_bytes().endswith(b"\n")
    assert bench.numbers() == list(range(len(bench.rows())))
    assert len(bench.rows()) > 50


def test_nonsense_for_days_does_not_fill_the_disk(bench, monkeypatch):
    monkeypatch.setattr(bench.log, "_room", 5000)
    noise = [(number / 10 + 0.05, b"static" * 20 + b"\n") for number in range(60)]
    bench.run(sorted([*samples(0, 60), *noise]))
    assert bench.numbers() == list(range(60))
    assert bench.log.path.stat().st_size < 5300
    assert bench.recorder.state.damaged == 60
    assert sum("continues without its log" in text for text in bench.told) == 1


def test_a_run_of_hours_is_told_once_to_be_longer_than_the_matrix(bench):
    bench.recorder.patience_s = 1e9
    bench.run([*samples(0, 30), *samples(3000, 3010)])
    assert " ".join(bench.told).count("longer than 1000 samples (100 s)") == 1
    assert (len(bench.rows()), len(bench.logger.samples)) == (3010, 1001)


@pytest.mark.takes(0.3)
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.floats(0, 30), PIECES), max_size=60))
def test_any_bytes_end_with_every_accepted_sample_on_disk(monkeypatch, script):
    monkeypatch.setattr(growing_file.os, "fsync", lambda descriptor: None)
    with tempfile.TemporaryDirectory() as folder:
        bench, accepted = ScriptedBench(Path(folder), monkeypatch), []
        keep = bench.logger.state.add
        bench.logger.state.add = lambda counts: (accepted.append(counts), keep(counts))
        moments_s = itertools.accumulate(step_s for step_s, _ in script)
        with contextlib.suppress(AcquisitionError):
            bench.run(zip(moments_s, (content for _, content in script), strict=True))
        endings = ("Ctrl-C", "(--patience)", "the end stop", "(docs/bench.md)")
        assert bench.recorder.state.ended.endswith(endings)
        cells = [row[1:] for row in bench.rows()]
        assert cells == [[*map(str, counts)] if counts else [""] * 4 for counts in accepted]
        places = [round(float(row[0]) * 10) for row in bench.rows()]
        assert places == list(range(len(places)))  # time never shifts and never runs back
        # What is missing passed by the computer's clock; a false clock makes it no longer.
        assert len(places) / 10 <= bench.now_s + 12
