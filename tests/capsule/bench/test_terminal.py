"""The terminal: the display of a recording or a survey, redrawn in its place, or plain lines."""

import io
import os
from dataclasses import replace
from types import SimpleNamespace

import pytest

from capsule.bench import loop
from capsule.bench.state import State
from capsule.bench.terminal import WAITING_TEXTS, PatientOutput, Terminal, state_lines


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
    assert [line.split(maxsplit=3) for line in sensors] == [
        ["sensor", "1", "12", "▁ ▂"],
        ["sensor", "2", "510", "▁ ▇"],
        ["sensor", "3", "512", "▁ ▁"],
        ["sensor", "4", "20", "█ ▁"],
    ]
    assert title == "if the run ended now:"
    # A longer line would break, and the terminal could not be drawn in its place again.
    assert verdict.startswith("template  nodule") and len(verdict) < 1000
    terminal.note("the board was unplugged")
    assert screen.getvalue().endswith("\x1b[7A\x1b[Jthe board was unplugged\n")


def test_readings_in_volts_are_shown_too(state):
    state.full_scale = 5.0
    state.recent.extend([(0.0, 2.5, 2.5, 5.0), (0.0, 2.4951, 2.5, 5.0)])
    screen = Screen()
    Terminal(screen).show(state)
    assert screen.getvalue().splitlines()[2].split()[:3] == ["sensor", "2", "2.495"]


# Kills: a log file with control characters, and one with a drawing of a survey a second.
def test_a_log_file_gets_plain_lines_now_and_then(state):
    stream = io.StringIO()
    terminal = Terminal(stream)
    terminal.show(state)
    terminal.show(STATE)
    state.ended = "Ctrl-C"
    terminal.show(state)
    assert stream.getvalue().splitlines() == [state.summary(), *state.judgement.lines_so_far()]
    assert terminal.every_s > 1


NAN = float("nan")
STATE = State(
    0.1,
    title="demo, simulated",
    samples=12000,
    away_s=90.4,
    head_mm=250.0,
    head_known=True,
    doing="exploring",
    score=0.075,
    threshold=0.15,
    length_mm=1000.0,
    places=[(1, "dismissed", 100.0, ""), (2, "confirmed", 200.0, "3.1 mm (2.4 to 3.8)")],
)


def test_the_lines_say_where_the_head_is_what_it_does_and_what_was_found():
    first, gut, score, *places = state_lines(STATE, 100)
    assert first == "demo, simulated  21 min 30 s  head at 250.0 mm: explores"
    assert gut.startswith("0 ━") and gut.endswith("─ 1000 mm")
    bar = gut[2:-8]
    assert len(gut) == 100
    long = replace(STATE, length_mm=float("inf"), head_mm=1720.0)
    assert state_lines(long, 100)[1].endswith("─ 1750 mm")
    for mark, share in (("○", 0.1), ("●", 0.2), ("▶", 0.25)):
        assert bar.index(mark) == int(share * len(bar))
    # The threshold stands at a third, and half of it is filled.
    bar = score[len("score 0.075 ") : -len(" threshold 0.150")]
    assert bar.count("█") == pytest.approx(bar.index("│") / 2, abs=0.5)
    assert places == [
        "● place 2 at 200 mm: nodule, 3.1 mm (2.4 to 3.8)",
        "○ place 1 at 100 mm: no nodule",
    ]


@pytest.mark.parametrize("width", [40, 300])
@pytest.mark.parametrize(
    "changes",
    [
        {"head_mm": NAN, "head_known": False, "score": NAN, "places": [], "doing": "starting"},
        {"length_mm": float("inf"), "head_mm": 1720.0, "score": 9.0},
        {"places": [(n, "", 10.0 * n, "") for n in range(1, 12)], "score": -0.1},
    ],
)
def test_no_line_is_wider_than_the_terminal(width, changes):
    lines = state_lines(replace(STATE, **changes), width)
    assert all(len(line) <= width for line in lines)
    assert len(lines) <= 10
    plain = state_lines(replace(STATE, **changes), width, plain=True)
    assert all(line.isascii() for line in plain)


def test_a_survey_is_drawn_in_its_place_and_stays_at_its_end():
    screen = Screen()
    terminal = Terminal(screen)
    places = [(1, "confirmed", 90.0, "2.0 mm")]
    state = replace(STATE, title="demo", samples=0, away_s=0.0, places=places)
    terminal.show(state)
    drawn = screen.getvalue()
    state.samples, state.doing = 8000, "returning"
    # Folded, the head points back, and its position is the last known one.
    state.head_mm, state.head_known = 199.9, False
    terminal.show(state)
    last = screen.getvalue()[len(drawn) :]
    assert last.startswith("\x1b[4A\x1b[Jdemo  13 min 20 s  head last at 199.9 mm: is folded")
    assert "◀" in last and "▶" not in last
    # What follows does not wipe it away.
    terminal.leave()
    ended = screen.getvalue()
    terminal.note("the survey is over")
    assert "\x1b" not in screen.getvalue()[len(ended) :]


# Kills: a display that is drawn at each sample, or never again.
def test_what_is_seen_is_shown_seldom_and_what_is_sent_each_time(monkeypatch):
    now_s, done = [100.0], []
    monkeypatch.setattr(loop, "time", SimpleNamespace(monotonic=lambda: now_s[0]))
    state = State(0.1)
    made = loop.Loop("the survey", state, None)
    made.add("its display", lambda: done.append("shown"), 0.25)
    made.add("its stream", lambda: done.append("sent"))

    def look():
        now_s[0] += 0.0625
        return "Ctrl-C" if len(done) > 11 else ""

    made.go_on(look)
    assert (done.count("sent"), done.count("shown"), state.ended) == (10, 3, "Ctrl-C")
    made.show()
    assert done[-1] == "shown"


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
