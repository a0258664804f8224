"""What the computer does for the boards with motors: leases, hangs, resets, refusals."""

import itertools
import signal
import subprocess
import sys
import threading
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

from capsule.bench import board, survey_bench, wave
from capsule.bench.bench_errors import (
    AcquisitionError,
    BoardLostError,
    RefusedError,
    SurveyFaultError,
)
from capsule.bench.fold import FoldBoard
from capsule.bench.survey_bench import BoardBench
from capsule.bench.wave import Drive, Wave
from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG
from capsule.survey.cycle import Cycle
from capsule.survey.pilot import Pilot
from capsule.survey.survey_log import FOLDED, FOLDING, UNKNOWN_FOLD, Readings
from capsule.survey.way_back import Leg
from support.bench.scripted import FakeLine, board_on, identity_of


def log_to(told):
    return SimpleNamespace(note=lambda text: None, tell=told.append, damaged=lambda piece: None)


LOG = log_to([])
DETECTOR = read_config_file(CONFIG / "config.yaml")["diagonal"]
WAVE = Wave(25.0, 25.0, "forward")


class Line(FakeLine):
    """A line whose board obeys everything at once."""

    def __init__(self):
        super().__init__()
        self.renewed = threading.Event()

    def send(self, payload):
        """Take a command, and confirm it."""
        super().send(payload)
        if payload == "position":
            self.renewed.set()
        else:
            self.frames.append(f"A,{payload}")


@pytest.fixture
def line():
    return Line()


# Kills: a lease of 50 s, and a start without the thread that renews the lease.
def test_a_wave_is_started_with_a_lease_that_is_renewed_while_the_program_is_busy(
    line, monkeypatch
):
    monkeypatch.setattr(wave, "LOOK_EVERY_S", 0.001)
    drive = Drive(board_on(line), WAVE, LOG)
    drive.set_up()
    drive.start()
    assert line.renewed.wait(10)
    told = [payload for payload in line.sent if payload != "position"]
    assert told[-3:] == ["speed,25", "lease,5", "start"]
    assert drive.leave() == ""
    assert line.sent[-1] == "stop"


# Kills: a thread that renews the lease for a main thread that hangs; one that stops a busy one.
def test_a_wave_whose_main_thread_hangs_is_stopped_within_its_lease(line):
    drive = Drive(board_on(line), WAVE, LOG)
    looks = round(wave.LEASE_S / wave.LOOK_EVERY_S)
    for _ in range(3 * looks):
        drive.look()
        drive.serve()
    assert "stop" not in line.sent
    line.sent.clear()
    for _ in range(looks):
        drive.look()
    assert line.sent[0] == "position"
    assert line.sent[-1] == "stop"
    drive.serve()
    drive.look()
    assert line.sent[-1] != "stop"


# Kills: a thread that ends when the line is lost, so that nobody renews the lease afterwards.
def test_a_lease_outlives_a_board_that_is_away_for_a_moment(line):
    away = board_on(line)
    drive = Drive(away, WAVE, LOG)
    away.line = None
    drive.look()
    assert not line.sent
    away.line = line
    drive.look()
    assert line.sent == ["position"]
    assert wave.RENEW_AFTER_S + wave.LOOK_EVERY_S < 2.0  # as docs/bench.md says


# Kills: a board that was away, taken to go on where it was since its clock is ahead of the old one.
def test_a_wave_board_that_is_back_has_forgotten_its_phase_and_is_started_again(line, monkeypatch):
    away = board_on(line)
    drive = Drive(away, WAVE, LOG, restarts=3)
    line.frames = ["P,10,10,0.6,25.0,running,"]
    drive.serve()
    line.lost = True
    drive.serve()
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
    line.frames = ["P,60000,1200,75.0,0.0,stopped,"]
    drive.serve(60.1)
    assert "no wave runs" in drive.fault
    assert drive.until == "2.9"
    line.frames = ["P,60200,1200,75.0,0.0,stopped,"]
    drive.serve(60.3)
    assert drive.until == "2.9"
    assert set(line.sent) == {"position"}


HANGS = """
import ctypes, time
from capsule.bench.clock import StopRequest
stop, libc, mutex = StopRequest(), ctypes.CDLL(None), ctypes.create_string_buffer(256)
print("ready", flush=True)
while not stop.reason:
    time.sleep(0.01)
print(stop.reason, flush=True)
for _ in range(2):
    libc.pthread_mutex_lock(mutex)  # the second call never returns, and no signal ends it
"""


# Kills: a handler in Python, which a main thread that hangs in the system never runs.
@pytest.mark.skipif(sys.platform != "linux", reason="needs the mutexes of Linux")
def test_a_second_ctrl_c_ends_a_program_that_hangs():
    program = subprocess.Popen(
        [sys.executable, "-c", HANGS], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    for said in ("ready", "Ctrl-C"):
        assert program.stdout.readline().strip() == said
        program.send_signal(signal.SIGINT)
    assert "ended at once by a second Ctrl-C" in program.communicate(timeout=60)[1]
    assert program.returncode == 130


# Kills: a wave that is started again for ever.
def test_a_wave_whose_board_is_reset_again_and_again_is_given_up(line):
    told, starts = [], []
    drive = Drive(board_on(line), WAVE, log_to(told), restarts=board.MOST_RESETS)
    for number in range(25):
        assert (drive.trouble(60) is None) == (number <= 3)
        line.frames.append(f"P,{9000 - number},10,0.6,25.0,running,")
        drive.serve()
        line.frames.append("P,20,0,0.0,0.0,stopped,")
        for _ in range(10):
            drive.serve()
        starts.append(line.sent.count("start"))
    assert starts == [1, 2, *(23 * [3])]
    with pytest.raises(AcquisitionError, match="/dev/board was reset or unplugged"):
        raise drive.trouble(60)
    assert len(told) == 3


def bench_on(fold, peristalsis, logger=None):
    lines = {"fold": fold, "peristalsis": peristalsis, "logger": logger or Line()}
    boards = {kind: board_on(line, kind) for kind, line in lines.items()}
    return BoardBench(boards, WAVE, LOG, SimpleNamespace(reason=""), 60.0)


# Kills: a fold that is begun after Ctrl-C, such as by the judgement that was just under way.
@pytest.mark.parametrize(("reason", "sent"), [("", ["fold", "unfold"]), ("Ctrl-C", ["unfold"])])
def test_after_ctrl_c_nothing_folds(line, reason, sent):
    bench = bench_on(line, Line())
    bench._stop.reason = reason
    for command in ("fold", "unfold"):
        bench.tell(command)
    assert line.sent == sent


FRAMES = {
    "fold": ["F,10,0,unfolded,unfolded"],
    "peristalsis": ["P,10,10,0.6,25.0,running,"],
    "logger": [f"D,{number},{100 * number},1,2,3,4,0" for number in range(8)],
}


# Kills: a survey that misses one of its boards for ever, or all of them.
@pytest.mark.parametrize("silent", FRAMES)
def test_any_board_that_stays_silent_ends_a_survey(monkeypatch, silent):
    now_s = 0.0
    wave.AWAKE.pause_s()  # other tests' pauses do not count
    monkeypatch.setattr(wave.AWAKE, "now_s", lambda: now_s)
    lines = {name: Line() for name in FRAMES}
    bench = bench_on(lines["fold"], lines["peristalsis"], logger=lines["logger"])
    now_s = 61.0
    for name in FRAMES.keys() - {silent}:
        lines[name].frames = FRAMES[name]
    with pytest.raises(BoardLostError, match=rf"{silent}.*\(--patience\)"):
        bench.read(8)


# Kills: samples that come late, taken for those of the time at which they come.
def test_a_sample_that_is_late_stays_missing(monkeypatch):
    now_s, logger = [0.0], Line()
    monkeypatch.setattr(survey_bench, "elapsed_s", lambda: now_s[0])
    bench = bench_on(Line(), Line(), logger=logger)
    heard = []
    for first, last, looked_s in ((0, 8, 0.0), (8, 8, 10.0), (8, 24, 10.0)):
        now_s[0] = looked_s
        logger.frames = [f"D,{n},{100 * n},{n},2,3,4,0" for n in range(first, last)]
        heard.append(bench.read(8).values[0].tolist())
    np.testing.assert_equal(heard, [list(range(8)), 8 * [np.nan], list(range(16, 24))])


# Kills: a resumed survey that takes the count of a board that was reset for its phase.
def test_a_resumed_survey_knows_its_phase_by_the_index_alone(line):
    bench = bench_on(Line(), line)
    bench.resume(3.0)
    for frame, known in (
        ("P,10,10,0.6,25.0,running,", False),
        ("P,210,90,5.3,25.0,running,85", True),
    ):
        line.frames = [frame]
        bench._drive.serve()
        assert bench._drive.phase.known == known
    assert bench.index_mm == 3.0


# Kills: a survey that never holds the lease of its fold: pilot, bench or fold board.
@pytest.mark.parametrize("state", ["folding", "returning"])
def test_a_folded_survey_holds_its_lease_at_each_judgement(line, state):
    bench = bench_on(line, Line())
    pilot = Pilot(DETECTOR, 10.0, 4)
    pilot.cycle, pilot._leg = Cycle(state), Leg(0.0, begun_s=0.0, planned_s=30.0)
    nothing = np.full((4, pilot.every), np.nan)
    fold = FOLDED if state == "returning" else FOLDING
    for _ in range(9):
        for command in pilot.tick(Readings(nothing, nothing[0], fold)):
            bench.tell(command)
    assert line.sent == 9 * ["hold"]
    assert pilot.every / 10.0 < 5.0 / 2


def resumed(drive):
    drive.phase.begin_anew()
    return drive


def fold_of(board):
    return FoldBoard(board, LOG)


# Kills: an end that does not wait until the origami is unfolded; a wave that is started before.
def test_a_survey_begins_and_ends_only_with_an_unfolded_origami(line, monkeypatch):
    monkeypatch.setattr(wave.AWAKE, "now_s", itertools.count().__next__)
    said, drive = "does not confirm that the origami is unfolded", Line()
    assert said in fold_of(board_on(line)).leave_unfolded()
    with pytest.raises(SurveyFaultError, match=said):
        bench_on(line, drive).start()
    assert "start" not in drive.sent


RESET = [["F,9000,1860,folded,folded", "F,20,1860,folded,unfolding"]]


# Kills: a survey that waits for a silent board for ever, or never notices a lost phase; that goes
# on with a board whose refusals only a person can end, or begins a fold for ever.
@pytest.mark.parametrize(
    ("make", "batches", "passed_s", "words"),
    [
        # What is damaged tells nothing.
        (fold_of, [["X"]], 16, "board at .* has sent nothing for 15 s"),
        (
            lambda of: resumed(Drive(of, WAVE, LOG, restarts=3)),
            [["P,10,0,0.0,25.0,running,"]],
            16,
            "reset and has no index switch, or its motor is blocked",
        ),
        (
            fold_of,
            [["F,10,0,unfolded,fault", "E,fold,not set up"]],
            0,
            "/dev/board is not set up.*--fold-set-up",
        ),
        (
            fold_of,
            [["E,fold,the memory cannot be written", "F,10,1860,folded,unfolding"]],
            0,
            "/dev/board cannot write its memory.*replace the board",
        ),
        (fold_of, 2 * [["F,10,0,unfolded,fault"]], 16, "has reported a fault for 30 s"),
        (fold_of, 4 * RESET, 0, "/dev/board was reset 4 times; check its supply"),
    ],
)
def test_what_ends_a_survey(line, monkeypatch, make, batches, passed_s, words):
    now_s = 1000.0
    monkeypatch.setattr(wave.AWAKE, "now_s", lambda: now_s)
    made = make(board_on(line))
    for batch in batches:
        assert made.trouble(15) is None
        now_s += passed_s
        line.frames = list(batch)
        made.serve()
    with pytest.raises((BoardLostError, SurveyFaultError), match=words):
        raise made.trouble(15)


# Kills: a motor that has to rest, taken for an origami that does not fold; the last state of a
# board that has fallen silent, taken for the present one.
def test_a_fold_motor_that_rests_is_no_fault_and_a_silent_board_is_not_trusted(line, monkeypatch):
    fold = FoldBoard(board_on(line), LOG)
    line.frames = ["F,5,0,unfolded,unfolded"]
    line.send = line.sent.append  # it does not confirm
    fold.serve()
    fold.command("fold")
    line.frames = ["E,fold,the motor has to rest for 9 s", "F,15,0,unfolded,unfolded"]
    fold.serve()
    assert (fold.state, fold.trouble(60)) == ("resting", None)
    line.frames = ["A,fold", "F,25,0,unfolded,folding"]
    fold.serve()
    assert fold.state == FOLDING
    later_s = wave.AWAKE.now_s() + 2
    monkeypatch.setattr(wave.AWAKE, "now_s", lambda: later_s)
    assert fold.state == UNKNOWN_FOLD


# Kills: a wave that starts again behind the back of a person who stopped the program (Ctrl-Z).
@pytest.mark.parametrize(("paused_s", "ends"), [(3.2, False), (3.3, True)])
def test_a_survey_that_was_stopped_until_a_lease_may_have_ended_starts_nothing_itself(
    line, monkeypatch, paused_s, ends
):
    bench = bench_on(Line(), line)
    monkeypatch.setattr(wave.AWAKE, "pause_s", lambda: paused_s)
    with pytest.raises(AcquisitionError, match="look at the bench") if ends else nullcontext():
        bench.read(8)
    assert line.sent == ([] if ends else ["position"])


def test_a_wave_that_the_motor_cannot_make_is_refused_with_its_reason(line):
    line.send = lambda payload: line.frames.append("E,direction,the motor follows 800")
    with pytest.raises(RefusedError, match="/dev/board refuses 'direction,forward': the motor"):
        Drive(board_on(line), WAVE, LOG).set_up()


# Kills: a firmware that knows no leases, of which nobody is told.
def test_a_board_without_leases_is_driven_with_a_warning(line):
    told, obey = [], line.send
    line.send = lambda payload: (
        line.frames.append("E,lease,unknown") if "lease" in payload else obey(payload)
    )
    Drive(board_on(line), WAVE, log_to(told)).set_up()
    assert "the wave will not stop if this computer fails" in told[0]
