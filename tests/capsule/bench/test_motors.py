"""What the computer does for the boards with motors: leases, hangs, resets, refusals, phase."""

import contextlib
import itertools
import threading
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capsule.bench import bench_errors, board, fold, survey_bench, wave
from capsule.bench.bench_errors import AcquisitionError, BoardLostError, SurveyFaultError
from capsule.bench.fold import FoldBoard
from capsule.bench.protocol import Position
from capsule.bench.survey_bench import BoardBench
from capsule.bench.timeline import BoardClock
from capsule.bench.wave import Drive, Wave, WavePhase
from capsule.survey.survey_log import FOLDING, UNKNOWN_FOLD
from support.bench.emulated import HALF_STEPS_PER_MM
from support.bench.scripted import FakeLine, board_on, identity_of

WAVE = Wave(25.0, 25.0, "forward")
WAVELENGTH_MM, SPEED_MM_S, EVERY_S = 80.0, 25.0, 0.2  # of simulated cams
MISHAPS = st.tuples(st.booleans(), st.floats(7, 20), st.floats(0, 0.05))  # resets, runs_s, delay_s
told = []  # what the user was told in a test
LOG = SimpleNamespace(note=lambda text: None, tell=told.append, damaged=lambda piece: None)
FRAMES = {
    "fold": ["F,10,0,unfolded,unfolded"],
    "peristalsis": ["P,10,10,0.6,25.0,running,"],
    "logger": [f"D,{number},{100 * number},1,2,3,4,0" for number in range(8)],
}
# The index was passed three waves ago.
BLOCKED = ["P,10,4000,235.6,25.0,running,1"]
FAULT = ["F,10,0,unfolded,fault"]
FOLDS_NO_MORE = ["E,fold,the memory cannot be written", "F,10,1860,folded,unfolding"]
RESET = ["F,9000,1860,folded,folded", "F,20,1860,folded,unfolding"]


class Line(FakeLine):
    """A line whose board obeys everything at once, but for its `answers` to some commands."""

    def __init__(self, **answers):
        super().__init__()
        self.answers = answers

    def send(self, payload):
        """Take a command, and confirm or answer it."""
        super().send(payload)
        if payload != "position":
            self.frames.append(self.answers.get(payload.partition(",")[0], f"A,{payload}"))


@pytest.fixture
def line():
    told.clear()
    return Line()


@pytest.fixture
def clock(monkeypatch):
    """Return the clock of the waiting times."""
    now = SimpleNamespace(s=0.0)
    monkeypatch.setattr(wave.AWAKE, "now_s", lambda: now.s)
    return now


# Kills: a lease of 50 s, and a start without the thread that renews the lease; a firmware that
# knows no leases, of which nobody is told.
def test_a_wave_is_started_with_a_lease_that_a_thread_renews_if_its_board_can(line, monkeypatch):
    looked = threading.Event()
    monkeypatch.setattr(Drive, "look", lambda drive: looked.set())
    drive = Drive(board_on(line), WAVE, LOG)
    drive.set_up()
    drive.start()
    assert looked.wait(10)
    assert line.sent == ["direction,forward", "ramp,25", "speed,25", "lease,5", "start"]
    assert (drive.leave(), line.sent[-1]) == ("", "stop")
    line.answers["lease"] = "E,lease,unknown"
    Drive(board_on(line), WAVE, LOG).set_up()
    assert "the wave will not stop if this computer fails" in told[0]
    line.answers["speed"] = "E,speed,the motor follows 800"
    with pytest.raises(bench_errors.RefusedError, match="refuses 'speed,25': the motor"):
        Drive(board_on(line), WAVE, LOG).set_up()


# Kills: a thread that renews the lease for a main thread that hangs; one that stops a busy one;
# one that ends when the line is lost, so that nobody renews the lease afterwards.
def test_a_wave_is_stopped_within_its_lease_if_the_main_thread_hangs_but_not_if_it_is_busy(line):
    drive = Drive(connected := board_on(line), WAVE, LOG)
    looks = round(wave.LEASE_S / wave.LOOK_EVERY_S)
    for _ in range(3 * looks):
        drive.look()
        drive.serve()
    assert set(line.sent) == {"position"}
    connected.line, line.sent = None, []
    drive.look()
    connected.line = line
    for _ in range(looks):
        drive.look()
    assert (line.sent[0], line.sent[-1]) == ("position", "stop")
    drive.serve()
    line.sent.clear()
    drive.look()
    line.sent_s = np.inf  # just now
    drive.look()
    assert line.sent == ["position"]
    assert wave.RENEW_AFTER_S + wave.LOOK_EVERY_S < 2.0  # as docs/bench.md says


# Kills: a board that was away, taken to go on where it was since its clock is ahead of the old one.
def test_a_wave_board_that_is_back_has_forgotten_its_phase_and_is_started_again(line, monkeypatch):
    drive = Drive(away := board_on(line), WAVE, LOG, restarts=3)
    line.frames = ["P,10,10,0.6,25.0,running,"]
    drive.serve()
    assert drive.summary() == "wave 1 mm at 25.0 mm/s"
    line.lost = True
    drive.serve()
    assert drive.summary() == "no wave"
    monkeypatch.setattr(board, "Line", lambda *_: line)
    away._open_s, line.lost, line.frames = 0.0, False, [identity_of("peristalsis")]
    drive.serve()
    line.frames = ["P,3000,10,0.6,25.0,running,"]
    drive.serve()
    assert (drive.phase.known, away.pending[-1]) == (False, "start")


# Kills: an answer that lay in the port while the wave stopped, taken for one that came just now;
# a recording that starts its wave again.
def test_a_wave_is_known_to_run_until_the_last_question_that_its_board_answered(line, monkeypatch):
    monkeypatch.setattr(wave, "ASK_EVERY_S", 0.0)
    drive = Drive(board_on(line), WAVE, LOG)
    for tenth in range(30):
        drive.serve(tenth / 10)
        assert drive.fault == ""
        line.frames = [f"P,{100 * tenth},{40 * tenth},2.5,25.0,running,"]
    assert drive.until == "end"
    # The program was stopped; all samples since are in the port, and read first.
    drive.serve(60.0)
    assert drive.fault == ""
    for now_s in (60.1, 60.3):
        line.frames = [f"P,{1000 * now_s:.0f},1200,75.0,0.0,stopped,"]
        drive.serve(now_s)
        assert ("no wave runs" in drive.fault, drive.until) == (True, "2.9")
    assert set(line.sent) == {"position"}


# Kills: a wave that is started again for ever.
def test_a_wave_whose_board_is_reset_again_and_again_is_given_up(line):
    starts, drive = [], Drive(board_on(line), WAVE, LOG, restarts=board.MOST_RESETS)
    for number in range(6):
        assert (drive.trouble(60) is None) == (number <= 3)
        for frame in (f"P,{9000 - number},10,0.6,25.0,running,", "P,20,0,0.0,0.0,stopped,"):
            line.frames.append(frame)
            for _ in range(10):
                drive.serve()
        starts.append(line.sent.count("start"))
    assert starts == [1, 2, 3, 3, 3, 3]
    assert "/dev/board was reset or unplugged" in str(drive.trouble(60))
    assert len(told) == 3


def bench_on(**lines):
    """Return a bench on these lines, and its request to stop."""
    boards = {kind: board_on(lines.get(kind) or Line(), kind) for kind in FRAMES}
    wave.AWAKE.pause_s()  # other tests' pauses do not count
    return BoardBench(boards, WAVE, LOG, stop := SimpleNamespace(reason=""), 60.0), stop


# Kills: samples that come late, taken for those of the time at which they come.
def test_a_sample_that_is_late_stays_missing(line, monkeypatch):
    now_s, drive, heard = [0.0], Line(), []
    monkeypatch.setattr(survey_bench, "elapsed_s", lambda: now_s[0])
    bench, _ = bench_on(logger=line, peristalsis=drive)
    drive.frames = ["P,10,212,12.5,25.0,running,"]
    for first, last, now_s[0] in ((0, 4, 0.0), (4, 8, 0.0), (8, 8, 10.0), (8, 24, 10.0)):
        line.frames = [f"D,{n},{100 * n},{n},2,3,4,0" for n in range(first, last)]
        heard.append(bench.read(8))
    assert heard[0] is None
    values = [readings.values[0] for readings in heard[1:]]
    np.testing.assert_equal(values, [np.arange(8), np.full(8, np.nan), np.arange(16, 24)])
    # The last of the first came with the position of the wave.
    np.testing.assert_equal(heard[1].wave_mm, [*(7 * [np.nan]), 12.5])


# Kills: an end that does not wait until the origami is unfolded, for 12 s, or lets the wave carry
# the capsule on meanwhile; a wave that is started before, or after Ctrl-C; a fold that is begun
# after Ctrl-C, such as by the judgement that was just under way.
def test_a_survey_begins_and_ends_only_with_an_unfolded_origami(line, monkeypatch, capsys):
    monkeypatch.setattr(wave.AWAKE, "now_s", itertools.count(0, 0.1).__next__)
    unfolded = Line(state="F,10,0,unfolded,unfolded")  # as it says when it is asked
    assert FoldBoard(board_on(unfolded), LOG).leave_unfolded() == ""
    said, drive = "does not confirm that the origami is unfolded", Line()
    assert said in FoldBoard(board_on(line), LOG).leave_unfolded()
    with pytest.raises(SurveyFaultError, match=said):
        bench_on(fold=line, peristalsis=drive)[0].start()
    bench, stop = bench_on(fold=unfolded, peristalsis=drive)
    assert bench.read(8) is None
    stop.reason = "Ctrl-C"
    for act in (bench.start, partial(bench.read, 8)):
        with pytest.raises(KeyboardInterrupt):
            act()
    bench.tell("fold")
    assert "fold" not in unfolded.sent and "start" not in drive.sent
    line.sent = drive.sent = []
    bench_on(fold=line, peristalsis=drive)[0].leave()
    assert [each for each in line.sent if each in ("stop", "unfold")] == ["stop", "unfold"]
    assert said in capsys.readouterr().err


# Kills: a survey that misses one of its boards for ever, or never notices a lost phase; that goes
# on with a board whose refusals only a person can end, or begins a fold for ever.
@pytest.mark.parametrize(
    ("kind", "batches", "passed_s", "error", "said"),
    [
        # What is damaged tells nothing.
        *((kind, [["X"]], 61, BoardLostError, rf"{kind}.*\(--patience\)") for kind in FRAMES),
        ("peristalsis", [BLOCKED], 61, BoardLostError, "is blocked"),
        ("fold", [[*FAULT, "E,fold,not set up"]], 0, SurveyFaultError, "--fold-set-up"),
        ("fold", [FOLDS_NO_MORE], 0, SurveyFaultError, "replace the board"),
        ("fold", 2 * [FAULT], 16, SurveyFaultError, "has reported a fault for 30 s"),
        ("fold", 4 * [RESET], 0, SurveyFaultError, "/dev/board was reset 4 times"),
    ],
)
def test_what_ends_a_survey(clock, monkeypatch, kind, batches, passed_s, error, said):
    monkeypatch.setattr(survey_bench, "elapsed_s", lambda: 0.0)
    lines = {name: Line() for name in FRAMES}
    bench, _ = bench_on(**lines)
    for left in reversed(range(len(batches))):
        clock.s += passed_s
        for name, frames in FRAMES.items():
            lines[name].frames = list(batches[left] if name == kind else frames)
        with contextlib.nullcontext() if left else pytest.raises(error, match=said):
            assert bench.read(9) is None


# Kills: a motor that has to rest, taken for an origami that does not fold; the last state of a
# board that has fallen silent, taken for the present one; a refusal that is told each second.
def test_a_fold_motor_that_rests_is_no_fault_and_a_silent_board_is_not_trusted(line, clock):
    fold_board = FoldBoard(board_on(line), LOG)
    line.send = line.sent.append  # it does not confirm
    line.frames = ["F,5,0,unfolded,unfolded"]
    fold_board.serve()
    fold_board.command("fold")
    assert fold_board.state == "unfolded"
    rests = "the motor has to rest for"
    for frames, state in (
        ([f"E,fold,{rests} 9 s", "F,15,0,unfolded,unfolded"], "resting"),
        ([f"E,fold,{rests} 8 s"], "resting"),
        (["A,fold", "F,25,0,unfolded,unfolded"], "unfolded"),
        (["F,35,0,unfolded,folding"], FOLDING),
    ):
        line.frames = frames
        fold_board.serve()
        assert (fold_board.state, fold_board.trouble(60)) == (state, None)
    assert told == [f"the fold board does not fold: {rests} 9 s"]
    clock.s += 2
    assert fold_board.state == UNKNOWN_FOLD


# Kills: a wave that starts again behind the back of a person who stopped the program (Ctrl-Z).
def test_a_survey_that_was_stopped_until_a_lease_may_have_ended_starts_nothing(line, monkeypatch):
    bench, paused_s = bench_on(peristalsis=line)[0], iter((3.2, 3.3))
    monkeypatch.setattr(wave.AWAKE, "pause_s", lambda: next(paused_s))
    assert bench.read(8) is None
    line.sent.clear()
    with pytest.raises(AcquisitionError, match="look at the bench"):
        bench.read(8)
    assert line.sent == []


@pytest.mark.parametrize(
    ("typed", "known", "answer", "said"),
    [
        (" 'Unfolded' ", "no", "A,setup,unfolded", "is set up"),
        ("unfolded", "no", "E,setup,it must be closed", "must be closed"),
        ("unfolded", "yes", "", "nothing is to be done"),
        # Whoever has not looked changes nothing.
        ("yes", "no", "", "is not set up"),
        (None, "no", "", "run it on a terminal"),
    ],
)
def test_a_person_sets_a_new_fold_board_up(line, monkeypatch, capsys, typed, known, answer, said):
    line.answers["setup"] = answer
    new = board_on(line, "fold", setup=known)
    monkeypatch.setattr(fold, "Board", lambda *_: new)
    monkeypatch.setattr(fold.sys, "stdin", SimpleNamespace(isatty=lambda: typed is not None))
    try:
        fold.set_up_fold("/dev/board", 115200, lambda question: typed)
        output = capsys.readouterr().out
    except AcquisitionError as reason:
        output = str(reason)
    assert (line.sent, said in output) == (["setup,unfolded"] if answer else [], True)


# Kills: a least delay that never ages, so that a slow clock falls behind by minutes a day.
def test_a_board_whose_clock_is_slow_is_followed():
    slow = BoardClock()
    moments_s = [slow.moment_s(100 * number, 0.1005 * number) for number in range(10_000)]
    assert moments_s[-1] == pytest.approx(0.1005 * 9_999)


class Cams:
    """Cams that a simulated peristalsis board turns, with an index at 17 mm, and the phase."""

    def __init__(self, sign=1, cam_mm=3.0, indexed=True):
        self.sign, self.cam_mm, self.indexed, self.now_s = sign, cam_mm, indexed, 100.0
        self.origin_mm, self.phase = cam_mm, WavePhase(WAVELENGTH_MM, forward=sign > 0)
        self.reset()

    def reset(self):
        """Press the reset button."""
        self.started_s, self.counted_mm, self.index_steps = self.now_s, 0.0, None

    def run(self, seconds, *, delay_s=0.01, stalled=False, state="running"):
        """Run the wave, and pass its frames to the phase."""
        speed_mm_s = self.sign * SPEED_MM_S * (state == "running")
        for _ in range(round(seconds / EVERY_S)):
            self.now_s += EVERY_S
            self.counted_mm += speed_mm_s * EVERY_S
            way_mm = 0.0 if stalled else abs(speed_mm_s) * EVERY_S
            self.cam_mm += way_mm
            beyond_mm = (self.cam_mm - 17.0) % WAVELENGTH_MM
            if self.indexed and beyond_mm < way_mm:
                index_mm = self.counted_mm - self.sign * beyond_mm
                self.index_steps = round(index_mm * HALF_STEPS_PER_MM)
            board_ms = round(1000 * (self.now_s - self.started_s))
            counted = round(self.counted_mm * HALF_STEPS_PER_MM), round(self.counted_mm, 3)
            frame = Position(board_ms, *counted, speed_mm_s, state, self.index_steps)
            self.phase.note(frame, self.now_s + delay_s)

    def off_mm(self):
        """Return the error of the phase against the cams, modulo a wavelength."""
        (wave_mm,) = self.phase.at(np.array([self.now_s + 0.01]))
        return (wave_mm - (self.cam_mm - self.origin_mm) + 40) % WAVELENGTH_MM - 40


def test_the_way_is_that_of_the_cams_at_any_moment_and_else_nobody_knows_it():
    cams = Cams(sign=-1)
    assert np.isnan(cams.phase.at(np.array([1.0]))).all()
    cams.run(0.4, state="stopped")
    cams.run(10.0)
    now_s = cams.now_s + 0.01
    moments_s = now_s - np.array([5.0, 2.03, 0.5, 0.1, 0.0, -0.3])
    expected_mm = cams.cam_mm - 3.0 - SPEED_MM_S * (now_s - moments_s)
    np.testing.assert_allclose(cams.phase.at(moments_s), expected_mm, atol=0.1)
    cams.now_s += 3.0
    cams.run(4.0)
    moments_s = np.array([now_s - 1, now_s + 1.5, cams.now_s, cams.now_s + 2])
    assert np.isnan(cams.phase.at(moments_s)).tolist() == [False, True, False, True]
    cams.run(1.0, state="stopped")
    assert not cams.phase.known
    # A reset before the first index loses the phase for good.
    cams = Cams(cam_mm=18.0)
    cams.run(1.0)
    cams.reset()
    cams.run(20.0)
    assert (cams.phase.index_mm, cams.phase.known) == (None, False)


@settings(max_examples=15)
@given(st.sampled_from([1, -1]), st.floats(0, 80), st.booleans(), st.lists(MISHAPS, max_size=3))
def test_after_a_mishap_the_index_alone_tells_the_phase(sign, cam_mm, indexed, mishaps):
    cams = Cams(sign, cam_mm, indexed)
    cams.run(8.0)
    assert cams.off_mm() == pytest.approx(0.0, abs=0.3)
    for resets, runs_s, delay_s in mishaps:
        if resets or not indexed:
            cams.now_s += 1.0
            cams.reset()
            cams.run(0.2, state="stopped")
        else:
            cams.run(5.0, stalled=True)
        assert not cams.phase.known
        cams.run(runs_s, delay_s=delay_s)
        assert cams.phase.known == indexed
        assert not indexed or cams.off_mm() == pytest.approx(0.0, abs=0.6 + 25 * delay_s)
