"""The terminal: the display of a recording or a survey, redrawn in its place, or plain lines."""

import io
import os
from dataclasses import replace
from types import SimpleNamespace

import pytest

from capsule.bench import loop
from capsule.bench.state import State
from capsule.bench.terminal import WAITING_TEXTS, PatientOutput, Terminal, state_lines
from capsule.words import MINUS


class Screen(io.StringIO):
    """A terminal that can redraw."""

    encoding = "utf-8"

    def isatty(self):
        """Return True, as a terminal does."""
        return True


@pytest.fixture
def state():
    shown = State(0.1, samples=754, missing=12, gaps=2, damaged=3, wave="wave 80 mm")
    shown.recent.extend([(10, 500, 512, 1000), None, (12, 510, 512, 20)])
    verdicts = ["if the run ended now:", "template  nodule" + "." * 1000]
    shown.judgement = SimpleNamespace(lines_so_far=lambda: verdicts)
    return shown


NAN = float("nan")
SURVEY = State(
    0.1,
    title="demo, simulated",
    samples=12000,
    away_s=90.4,
    head_mm=250.0,
    head_known=True,
    doing="explores",
    score=0.075,
    threshold=0.15,
    following="folds soon",
    places=[(1, "dismissed", 100.0, ""), (2, "confirmed", 200.0, "3.1 mm (2.4 to 3.8)")],
)


def test_a_recording_is_drawn_in_its_place(state):
    screen = Screen()
    terminal = Terminal(screen)
    terminal.show(state)
    summary, *sensors, title, verdict = screen.getvalue().splitlines()
    assert state.summary() == (
        "01:15.4 | 754 samples | 2 gaps (12 samples missing) | 3 damaged frames | wave 80 mm"
    )
    assert summary == state.summary()[:79]
    # Of ten counts a sensor looks quiet, and a missing sample is a space.
    assert [line[7:] for line in sensors] == [
        "1   12 ▁ ▂", "2  510 ▁ ▇", "3  512 ▁ ▁", "4   20 █ ▁"
    ]  # fmt: skip
    assert title == "if the run ended now:"
    # A longer line would break, and the terminal could not be drawn in its place again.
    assert verdict.startswith("template  nodule") and len(verdict) < 1000
    terminal.note("the board was unplugged")
    assert screen.getvalue().endswith("\x1b[7A\x1b[Jthe board was unplugged\n")


# Kills: a log file with control characters, and one with a drawing of a survey a second.
def test_a_log_file_gets_plain_lines_now_and_then(state):
    stream = io.StringIO()
    terminal = Terminal(stream)
    for shown in (state, SURVEY, replace(state, ended="Ctrl-C")):
        terminal.show(shown)
    assert stream.getvalue().splitlines() == [state.summary(), *state.judgement.lines_so_far()]
    assert terminal.every_s > 1


# Kills: a last position taken for the present one; a place without its verdict; the first places.
def test_a_survey_is_drawn_in_its_place_and_stays_at_its_end():
    screen = Screen()
    terminal = Terminal(screen)
    terminal.show(SURVEY)
    drawn = screen.getvalue()
    assert drawn.splitlines() == [
        "demo, simulated  21 min 30 s  head at 250.0 mm: explores",
        "  folds soon",
        "score 0.075, threshold 0.150",
        "place 1 at 100 mm: no nodule",
        "place 2 at 200 mm: nodule, 3.1 mm (2.4 to 3.8)",
    ]
    places = [(number, "", 10.0 * number, "") for number in range(1, 9)]
    terminal.show(replace(SURVEY, head_known=False, score=NAN, places=places))
    last = screen.getvalue().removeprefix(drawn)
    assert last.startswith("\x1b[5A\x1b[Jdemo")
    assert "head last at 250.0 mm" in last and "no score, threshold" in last
    assert "place 2" not in last and "place 3 at 30 mm: suspected" in last
    # What follows does not wipe it away.
    terminal.leave()
    terminal.note("the survey is over")
    assert screen.getvalue().count("\x1b") == 2


def test_a_narrow_plain_terminal_gets_what_it_can_show_also_readings_in_volts(state):
    start = replace(SURVEY, head_mm=NAN, threshold=NAN, places=[], following="")
    assert state_lines(start, 20) == ["demo, simulated  21 "]
    state.judgement.lines_so_far = lambda: [f"{MINUS}2.0 mm"]
    state.full_scale = 5.0
    state.recent.extend([(0.0, 2.5, 2.5, 5.0), (0.0, 2.4951, 2.5, 5.0)])
    screen = Screen()
    screen.encoding = "ascii"
    Terminal(screen).show(state)
    assert screen.getvalue().endswith("\n-2.0 mm\n") and screen.getvalue().isascii()
    assert screen.getvalue().splitlines()[2].split()[:3] == ["sensor", "2", "2.495"]


# Kills: a display that is drawn at each sample, or never again.
def test_what_is_seen_is_shown_seldom_and_what_is_sent_each_time(monkeypatch):
    now_s, done, state = [100.0], [], State(0.1)
    monkeypatch.setattr(loop, "time", SimpleNamespace(monotonic=lambda: now_s[0]))
    made = loop.Loop("the survey", state, None)
    made.add("its display", lambda: done.append("shown"), 0.25)
    made.add("its stream", lambda: done.append("sent"))

    def look():
        now_s[0] += 0.0625
        return "Ctrl-C" if len(done) > 11 else ""

    made.go_on(look)
    assert (done.count("sent"), done.count("shown"), state.ended) == (10, 3, "Ctrl-C")
    made.attempt_due()
    assert done[-2:] == ["shown", "sent"]


# Kills: a terminal that takes no output, or is closed, and holds a recording up.
@pytest.mark.parametrize("closed", [False, True])
def test_output_that_nobody_takes_holds_nothing_up(closed):
    ours, theirs = os.pipe()
    output = PatientOutput(theirs)
    if closed:
        os.close(ours)
    for _ in range(2 * WAITING_TEXTS):
        assert output.write(1000 * b"x") == 1000
    if not closed:
        os.close(ours)
    output.finish()
    assert not output._writer.is_alive()
    os.close(theirs)
