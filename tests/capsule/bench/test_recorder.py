"""A recording against a scripted serial line: all samples that arrive are kept."""

import contextlib
import errno
import os
from datetime import UTC, datetime
from itertools import pairwise

import pytest

from capsule.bench import growing_file
from capsule.bench.bench_errors import (
    AcquisitionError,
    BoardLostError,
    DiskFullError,
    LineLostError,
    RefusedError,
)
from capsule.bench.protocol import encode
from capsule.recordings.recording import read_recording
from support.bench.scripted import ScriptedBench, identity_frame, sample_frame


def samples(first, last):
    """Return samples with these numbers, each with its time."""
    return [(number / 10, sample_frame(number)) for number in range(first, last)]


@pytest.fixture
def bench(tmp_path, monkeypatch):
    made = ScriptedBench(tmp_path, monkeypatch)
    yield made
    made.log.close()


def read_together(first, last):
    return b"".join(map(sample_frame, range(first, last)))


FALSE_FRAME = sample_frame(999, 20_000, 200)
# As far as anybody can tell, it may follow number 29.
PLAUSIBLE_FRAME = sample_frame(999, 6000, 55)
JUMPED = [(n / 10, sample_frame(n, 100 * n + 10**9)) for n in range(30, 80)]
CLOCK_ENDS = [(n / 10, sample_frame(n, (2**32 - 3000 + 100 * n) % 2**32)) for n in range(60)]
PRESSED = encode("D,30,3000,30,2,3,4,1")


@pytest.mark.parametrize(
    ("script", "numbers", "rows"),
    [
        # After a stop (Ctrl-Z), what lies in the port is read first.
        ([*samples(0, 30), (11.0, read_together(30, 110)), *samples(110, 130)], range(130), 130),
        # Nothing lay there: the board was lost meanwhile, and may still come back.
        ([*samples(0, 30), (11.0, b""), (11.1, b""), *samples(112, 120)],
         [*range(30), *range(112, 120)], 120),
        ([*samples(0, 30), *samples(33, 34), (3.35, FALSE_FRAME), *samples(34, 60)],
         [*range(30), *range(33, 60)], 60),
        ([*samples(0, 30), *samples(33, 34), (3.35, PLAUSIBLE_FRAME), *samples(34, 60)],
         [*range(30), *range(33, 60)], 60),
        # What comes again is continued by the sample after a gap.
        ([*samples(0, 30), (3.05, sample_frame(28)), *samples(31, 40)],
         [*range(30), *range(31, 40)], 40),
        # A clock that jumped for good is not believed, but its samples are.
        ([*samples(0, 30), *JUMPED], range(80), 80),
        # The board's clock passes its end, with a gap just there.
        ([*CLOCK_ENDS[:29], *CLOCK_ENDS[32:]], [*range(29), *range(32, 60)], 60),
        # In doubt to the end.
        ([*samples(0, 30), *samples(33, 34)], [*range(30), 33], 34),
        *(([*samples(0, 30), (3.0, identity_frame(uptime_ms=uptime)), *samples(30, 60)],
           range(60), 60) for uptime in ("soon", "-1", "")),
        # The end stop, with the sample that it came with.
        ([*samples(0, 30), (3.0, PRESSED), *samples(31, 40)], range(31), 31),
    ],
    ids=["stopped", "lost while stopped", "false frame after a gap", "plausible frame after a gap",
         "again before a gap", "clock jumps", "clock ends", "doubt", "soon", "negative", "empty",
         "end stop"],
)  # fmt: skip
def test_every_sample_is_kept_at_its_time(bench, script, numbers, rows):
    bench.run(script)
    assert bench.numbers() == list(numbers)
    assert len(bench.rows()) == rows
    state, known = bench.recorder.state, [bool(row[1]) for row in bench.rows()]
    gaps = sum(here and not there for here, there in pairwise(known))
    assert (state.missing, state.gaps) == (known.count(False), gaps)
    # The board says that it runs, and so it is not told to start.
    assert "start" not in bench.sent


# Kills: a switch whose wire is broken, taken for one that the capsule has pressed.
@pytest.mark.parametrize(("before", "said"), [(0, "broken"), (30, "the capsule reached")])
def test_an_end_stop_that_was_never_open_is_told_from_one_that_was_reached(bench, before, said):
    pressed = [(n / 10, encode(f"D,{n},{100 * n},{n},2,3,4,1")) for n in range(before, before + 2)]
    bench.run([*samples(0, before), *pressed])
    assert said in bench.recorder.state.ended


# Kills: a header with the time at which the command was typed.
def test_a_recording_started_with_its_first_sample(bench):
    # Read together, 9 s after the first one was taken.
    bench.run([(30.0, sample_frame(0)), (39.0, b"".join(map(sample_frame, range(1, 91))))])
    with bench.path.open("rb") as stream:
        started = datetime.fromisoformat(read_recording(stream, 4).header["started"])
    assert (datetime.now(UTC) - started).total_seconds() == pytest.approx(9.5, abs=1)


@pytest.mark.parametrize(
    "nonsense",
    [b"\xff\x00 static\n", encode("P,100,2,3.0,4.0,running") + encode("A,pause")],
    ids=["garbage", "another board"],
)
def test_nonsense_for_ever_ends_by_patience(bench, nonsense):
    script = [*samples(0, 30), *((3 + tick / 10, nonsense) for tick in range(600))]
    with pytest.raises(BoardLostError, match=r"sent no sample for 5 s \(--patience\)"):
        bench.run(script)
    assert bench.now_s < 9
    assert bench.numbers() == list(range(30))


# Kills: a sample beyond the duration, also after a gap over its end.
@pytest.mark.parametrize(
    ("later", "kept", "said"),
    [
        # It passes while the recorder is stopped, and is filled from the port.
        ([(20.0, read_together(30, 80))], range(60), None),
        ([*samples(60, 70), *samples(70, 80)], range(30), None),
        (samples(30, 60), range(60), None),  # nothing follows
        ([(3 + tick / 10, b"static\n") for tick in range(600)], range(30), "--duration is over"),
    ],
)
def test_a_recording_ends_with_its_duration(tmp_path, monkeypatch, later, kept, said):
    bench = ScriptedBench(tmp_path, monkeypatch, duration=60, patience_s=1000)
    with pytest.raises(BoardLostError, match=said) if said else contextlib.nullcontext():
        bench.run([*samples(0, 30), *later])
    assert bench.now_s < 21
    assert bench.numbers() == list(kept)
    assert said or bench.recorder.state.ended == "--duration is over"


@pytest.mark.parametrize("ahead_ms", [300, 5000, 20_000, 600_000, 2**31, 9_999_999_999])
@pytest.mark.parametrize("numbered", ["next", "as far ahead", "anyhow"])
@pytest.mark.parametrize("at", [0, 1, 30])
def test_a_false_frame_that_passed_its_check_harms_nothing(bench, ahead_ms, numbered, at):
    device_ms = min(100 * at + ahead_ms, 9_999_999_999)
    further = {"next": 0, "as far ahead": ahead_ms // 100, "anyhow": 1_234_567_890}
    sequence = at + further[numbered]
    false = sample_frame(999, device_ms, sequence)
    bench.run([*samples(0, at), (at / 10, false), *samples(at, 60)])
    assert bench.numbers() == list(range(60))
    assert len(bench.rows()) == 60


def test_a_gap_of_days_is_written_in_pieces(bench, monkeypatch):
    most = [0]
    flush = bench.part.flush

    def watched():
        most[0] = max(most[0], len(bench.part._pending))
        flush()

    monkeypatch.setattr(bench.part, "flush", watched)
    bench.recorder.patience_s = 1e9
    later = [(number / 10, sample_frame(number)) for number in range(30_000, 30_010)]
    bench.run([*samples(0, 30), *later])
    assert len(bench.rows()) == 30_010
    assert most[0] <= 1001
    assert len(bench.logger.samples) == 1001


def plug_in_later(bench, *boards):
    """Let these boards answer, one per attempt, when the recorder searches for its own."""
    bench.answers, bench.away_s = iter(boards), 1.0


OTHER = {"adc_bits": 12, "vref_mv": 3300, "rate_hz": 50}


def test_another_board_after_a_replug_is_refused(bench):
    plug_in_later(bench, OTHER, OTHER, {"uptime_ms": 5900})
    bench.run([*samples(0, 30), (3.0, LineLostError()), *samples(60, 90)])
    assert bench.numbers() == [*range(30), *range(60, 90)]
    (told,) = [text for text in bench.told if "another one" in text]
    assert "rate_hz=50 instead of 10, adc_bits=12 instead of 10, vref_mv=3300" in told


# Kills: a sample in doubt that is lost with its board.
def test_a_board_that_does_not_come_back_ends_by_patience(bench):
    plug_in_later(bench, *(40 * [OTHER]))
    with pytest.raises(BoardLostError, match=r"did not come back within [56] s \(--patience\)"):
        bench.run([*samples(0, 30), *samples(33, 34), (3.4, LineLostError())])
    assert bench.numbers() == [*range(30), 33]


# Kills: a sample in doubt that a survey, which goes on, never gets.
def test_a_sample_in_doubt_is_kept_as_soon_as_its_board_is_lost(bench):
    bench._script = iter([*samples(0, 30), *samples(33, 34), (3.4, LineLostError())])
    for _ in range(32):
        bench.logger.serve(0.05)
    assert (bench.logger.state.samples, bench.logger.state.missing) == (34, 3)


# Kills: a patience that begins anew with each return of a board that sends no sample.
def test_a_board_that_comes_back_again_and_again_without_a_sample_ends_by_patience(bench):
    plug_in_later(bench, *(40 * [{}]))
    with pytest.raises(BoardLostError, match=r"\(--patience\)"):
        bench.run([*samples(0, 30), *((3.0 + number, LineLostError()) for number in range(40))])


def test_another_board_behind_the_same_line_is_refused(bench):
    strangers = [(3 + n / 50, sample_frame(30 + n, 3000 + 20 * n)) for n in range(100)]
    script = [*samples(0, 30), (3.0, identity_frame(**OTHER)), *strangers]
    bench.run([*script, (5.9, identity_frame(uptime_ms=5900)), *samples(60, 90)])
    assert bench.numbers() == [*range(30), *range(60, 90)]
    assert "identify" in bench.sent


# Kills: a restart that is not seen since the new clock has passed the old one meanwhile.
@pytest.mark.parametrize(
    "uptime_ms", [581_000 + 3000, 0, 2500, 5000], ids=["ahead", "new", "behind", "between"]
)
def test_a_gap_is_measured_by_the_computer_where_the_boards_clock_began_elsewhere(bench, uptime_ms):
    plug_in_later(bench, {"uptime_ms": uptime_ms})
    began = uptime_ms // 100
    later = [(22 + n / 10, sample_frame(n, 100 * (began + n), began + n)) for n in range(1, 30)]
    bench.recorder.patience_s = 1000
    silence = [(3.0 + n / 10, b"") for n in range(180)]
    bench.run([*samples(0, 30), *silence, (21.0, LineLostError()), *later])
    assert [row[0] for row in bench.rows() if row[1]][30:33] == ["22.1", "22.2", "22.3"]
    assert bench.numbers() == [*range(30), *range(1, 30)]
    assert any("its clock started again" in text for text in bench.told)


# Kills: a fault of a detector or of the display that ends a recording, or is told at each sample.
def test_a_recording_goes_on_without_what_it_can_do_without(bench, capsys):
    def fail(*_):
        raise ZeroDivisionError("by a bug")

    for what in ("verdicts", "its display"):
        bench.recorder.loop.add(what, fail)
    bench.run(samples(0, 60))
    assert bench.numbers() == list(range(60))
    bench.recorder.loop.attempt("the check at its end", fail)
    warnings = capsys.readouterr().err.splitlines()
    named = ["verdicts", "its display", "the check at its end"]
    assert warnings == [
        f"warning: the recording goes on without {what}: ZeroDivisionError: by a bug"
        for what in named
    ]
    assert bench.log.path.read_text().count("Traceback") == 2


class Wave:
    """A wave whose board refuses to start it, or whose user presses Ctrl-C as it starts."""

    fault, until = "", "end"

    def __init__(self, bench, refuses):
        self._bench, self._refuses, self.runs = bench, refuses, False

    def start(self):
        """Start, or refuse."""
        if self._refuses:
            raise RefusedError("the motor follows 800")
        self.runs, self._bench._stop.reason = True, "Ctrl-C"

    def serve(self, recorded_s):
        """Go on."""

    def summary(self):
        """Say nothing."""
        return ""

    def leave(self):
        """Stop."""
        self.runs = False
        return ""


# Kills: a file without samples in the way of the next run of that name; a wave that runs on.
@pytest.mark.parametrize("refuses", [True, False])
def test_a_run_that_ends_at_its_very_start_leaves_no_file_and_no_wave(bench, refuses):
    bench.recorder.header["wave_until_s"] = "end"
    wave = bench.recorder.drive = Wave(bench, refuses)
    with pytest.raises(AcquisitionError, match="follows 800" if refuses else "before the first"):
        bench.recorder.archive()
    assert not wave.runs
    assert list(bench.part.path.parent.iterdir()) == []


# Kills: a line that is cut off on the disk; a full disk that ends a recording without its remedy.
@pytest.mark.parametrize("room", range(1000, 1013, 3))
def test_a_full_disk_keeps_the_lines_that_fit_and_names_the_recovery(bench, monkeypatch, room):
    really_write, left = os.write, [room]

    def write(descriptor, content):
        if not left[0]:
            raise OSError(errno.ENOSPC, "No space left on device")
        written = really_write(descriptor, content[: left[0]])
        left[0] -= written
        return written

    monkeypatch.setattr(growing_file.os, "write", write)
    bench._script = iter(samples(0, 200))
    with pytest.raises(DiskFullError, match=r"disk is full.*--recover"):
        bench.recorder.archive()
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


def test_a_run_longer_than_the_matrix_is_told_once_and_goes_on(bench):
    bench.recorder.state.longest = 20
    bench.run(samples(0, 30))
    told = [text for text in bench.told if "(preprocessing.length)" in text]
    assert len(told) == 1
    assert "longer than 20 samples (2 s)" in told[0]
    assert bench.numbers() == list(range(30))
