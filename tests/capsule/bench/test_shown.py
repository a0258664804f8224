"""What a recording or a survey shows: the terminal, and the live page to rude browsers."""

import contextlib
import io
import json
import os
import re
import socket
import urllib.error
import urllib.request
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from capsule.bench import loop
from capsule.bench.live import MOST_LISTENERS, LivePage
from capsule.bench.state import State
from capsule.bench.terminal import WAITING_TEXTS, PatientOutput, Terminal
from support.browser import Browser, needed

SURVEY = State(0.1, title="demo, simulated", samples=12000, away_s=90.4, doing="explores")
SURVEY = replace(SURVEY, following="folds soon", score=0.075, threshold=0.15)
PLACES = [(1, "dismissed", 100.0, ""), (2, "confirmed", 200.0, "3.1 mm (2.4 to 3.8)")]
SURVEY = replace(SURVEY, head_mm=250.0, head_known=True, places=PLACES)


class Screen(io.StringIO):
    """A terminal that can redraw."""

    encoding, isatty = "utf-8", lambda screen: True


def test_a_recording_is_drawn_in_its_place():
    state = State(0.1, samples=754, missing=12, gaps=2, damaged=3, wave="wave 80 mm")
    state.recent.extend([(10, 500, 512, 1000), None, (12, 510, 512, 20)])
    verdicts = ["if the run ended now:", "template  nodule" + "." * 1000]
    state.judgement = SimpleNamespace(lines_so_far=lambda: verdicts)
    terminal = Terminal(screen := Screen())
    terminal.show(state)
    summary, *sensors, title, verdict = screen.getvalue().splitlines()
    told = "01:15.4 | 754 samples | 2 gaps (12 samples missing) | 3 damaged frames | wave 80 mm"
    assert (state.summary(), summary) == (told, told[:79])
    # Of ten counts a sensor looks quiet, and a missing sample is a space.
    drawn = ["1   12 ▁ ▂", "2  510 ▁ ▇", "3  512 ▁ ▁", "4   20 █ ▁"]
    assert [line[7:] for line in sensors] == drawn
    assert title == "if the run ended now:"
    # A longer line would break, and the terminal could not be drawn in its place again.
    assert verdict.startswith("template  nodule") and len(verdict) < 1000
    terminal.note("the board was unplugged")
    assert screen.getvalue().endswith("\x1b[7A\x1b[Jthe board was unplugged\n")
    # A log file gets plain lines, and nothing of a survey.
    file = io.StringIO()
    for shown in (state, SURVEY):
        Terminal(file).show(shown)
    assert file.getvalue().splitlines() == [told, *state.judgement.lines_so_far()]
    # A plain terminal gets what it can show, also of readings in volts.
    state.recent.append((0.0, 2.4951, 2.5, 5.0))
    plain = Screen()
    plain.encoding = "ascii"
    Terminal(plain).show(state)
    assert plain.getvalue().isascii() and "\nsensor 2  2.495 " in plain.getvalue()


# Kills: a last position taken for the present one; a place without its verdict; the first places.
def test_a_survey_is_drawn_in_its_place_and_stays_at_its_end():
    terminal = Terminal(screen := Screen())
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
    terminal.show(replace(SURVEY, head_known=False, score=np.nan, places=places))
    last = screen.getvalue().removeprefix(drawn)
    assert last.startswith("\x1b[5A\x1b[Jdemo")
    assert "head last at 250.0 mm" in last and "no score, threshold" in last
    assert "place 2" not in last and "place 3 at 30 mm: suspected" in last
    # What follows does not wipe it away.
    terminal.leave()
    terminal.note("the survey is over")
    assert screen.getvalue().count("\x1b") == 2


# Kills: a display that is drawn at each sample, or never again.
def test_what_is_seen_is_shown_seldom_and_what_is_sent_each_time(monkeypatch):
    now_s, done, state = [100.0], [], State(0.1)
    monkeypatch.setattr(loop, "time", SimpleNamespace(monotonic=lambda: now_s[0]))
    made = loop.Loop("the survey", state, None)
    made.add("its display", lambda: done.append("shown"), 0.25)
    made.add("its stream", lambda: done.append("sent"))
    for now_s[0] in 100 + np.arange(10) / 16:
        made.attempt_due()
    assert (done.count("sent"), done.count("shown")) == (10, 3)
    state.ended = "Ctrl-C"
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


@pytest.fixture
def page():
    with contextlib.closing(LivePage()) as made:
        yield made


@pytest.fixture
def long_run():
    made = State(0.1, title="3mm/r07", end_s=90.0, longest=1000)
    for number in range(700):
        made.add((500, 510 + 5 * (number % 32), 512, 1023))
    return made


def fetch(page, path="", **headers):
    request = urllib.request.Request(f"{page.address}{path}", headers=headers)
    return urllib.request.urlopen(request, timeout=5)


def listen(page, last="0"):
    """Listen to the page's events as a browser that knows the samples up to the last number."""
    return fetch(page, "events", **{"Last-Event-ID": last})


def next_event(listener):
    """Return id and data of the next event; empty after the last one."""
    number, data, _ = (listener.readline() for _ in range(3))
    return number and (int(number.removeprefix(b"id: ")), json.loads(data.removeprefix(b"data: ")))


def test_only_a_browser_that_knows_the_address_gets_the_page(page):
    with fetch(page) as answer, fetch(page) as again:
        content = answer.read().decode()
        policy, other = (each.headers["Content-Security-Policy"] for each in (answer, again))
    nonce = re.search(r"script-src 'nonce-([^']+)'", policy)[1]
    assert policy.startswith("default-src 'none'") and "{{" not in content
    # Kills: a style or script of the page that its own policy refuses; one nonce for all.
    assert content.count(f'nonce="{nonce}"') == content.count("<script") + content.count("<style")
    assert nonce not in other
    # Kills: no Host check, which lets a foreign page read the samples by a name of its own.
    for path, headers, status in (("x", {}, 404), ("", {"Host": "evil.example"}, 403)):
        with pytest.raises(urllib.error.HTTPError, match=str(status)) as refused:
            fetch(page, path, **headers)
        refused.value.close()


def test_a_browser_that_comes_back_goes_on_where_it_was(page, long_run):
    page.show(long_run)
    with listen(page) as listener:
        number, (news, values) = next_event(listener)
    # A minute is kept, not the whole run.
    assert (number, news["first"], len(news["samples"])) == (700, 100, 600)
    assert values["title"] == "3mm/r07"
    assert values["left"] == "00:20.0 left, 00:30.0 until it is too long for the workflow"
    long_run.add(None)
    long_run.add(None)
    page.show(long_run)
    # The last number of another recording says nothing of this one.
    for last, first, kept in (("700", 700, 2), ("9000", 102, 600)):
        with listen(page, last) as listener:
            _, (news, values) = next_event(listener)
        assert (news["first"], len(news["samples"]), news["samples"][-1]) == (first, kept, None)
        assert (values["gaps"], values["missing"]) == (1, 2)


# Kills: a listener that the recording waits for, or a browser's end that prints a traceback.
def test_too_many_browsers_come_and_go_and_hold_nothing_up(page, long_run, capfd):
    asked = f"GET {page.path}events HTTP/1.1\r\nHost: {page.host}\r\n\r\n".encode()
    page.show(long_run)
    with contextlib.ExitStack() as stack:
        listeners = []
        for _ in range(MOST_LISTENERS + 1):
            listeners.append(stack.enter_context(listen(page)))
            next_event(listeners[-1])  # before the next one comes, it is known
        assert next_event(listeners[0]) == b"", "the oldest goes"
        for number in range(100):  # of which they read one
            long_run.add((number, 2, 3, 4))
            page.show(long_run)
            assert number or {next_event(each)[0] for each in listeners[1:]} == {701}
            if number % 5 == 0:
                with socket.create_connection(("127.0.0.1", page.server_port), timeout=5) as rude:
                    # Cut off within the question, or after it.
                    rude.sendall(asked[: 20 if number % 10 else None])
        page.close()
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("periods", "remarks"), [((90, 80, 3, 15), {3: "flat", 4: "weak"}), ((90, 80, 40, 60), {})]
)
def test_a_flat_or_weak_sensor_is_named(periods, remarks):
    state = State(0.1)
    for n in range(400):
        state.add(None if n % 7 == 0 else tuple(500 + n % period for period in periods))
        assert n > 90 or not state.remarks(), "too short to show a wave"
    told = {sensor: words.split(":")[0] for sensor, words in state.remarks().items()}
    assert told == remarks


@pytest.mark.slow
@needed
def test_the_page_in_a_real_browser(page, long_run, tmp_path):
    with contextlib.closing(Browser(tmp_path / "profile")) as browser:
        browser.visit(page.address)
        assert browser.texts("#banner") == ["waiting for the first sample"]
        long_run.faults = ["no wave runs: end the recording, and record anew"]
        scores = [{"detector": "diagonal", "score": 0.5, "threshold": 0.2, "verdict": "x"}]
        long_run.judgement = SimpleNamespace(scores=scores, advice="enough: nodule")
        page.show(long_run)
        browser.wait_until("return document.querySelectorAll('#sensors canvas').length === 4")
        assert browser.texts("#banner") == long_run.faults
        assert browser.texts("#time") == ["01:10.0"]
        assert "sensor 3 is flat: check its connection" in browser.texts("#sensors .remark")
        assert browser.texts("#scores tbody tr") == ["diagonal0.50.2x"]
        long_run.faults, long_run.doing, long_run.length_mm = [], "is folded", 1000.0
        long_run.head_mm, long_run.places = 300.0, [(1, "confirmed", 200.0, "3.1 mm")]
        long_run.ended = "the survey is over"
        page.show(long_run)
        browser.wait_until("return !document.getElementById('survey').hidden")
        assert browser.texts("#banner") == ["ended: the survey is over"]
        assert browser.texts("#places tbody tr") == ["1200 mmconfirmed3.1 mm"]
        assert browser.messages() == [], "nothing that the policy refuses"
        assert browser.violations() == []
