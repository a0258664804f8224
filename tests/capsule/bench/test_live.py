"""The live page: its server against rude browsers, and the page in a real one."""

import contextlib
import json
import re
import socket
import urllib.error
import urllib.request
from types import SimpleNamespace

import pytest

from capsule.bench.live import MOST_LISTENERS, LivePage
from capsule.bench.state import State
from support.browser import Browser, needed


@pytest.fixture
def page():
    made = LivePage()
    yield made
    made.close()


@pytest.fixture
def state():
    made = State(0.1, title="3mm/r07", end_s=90.0, longest=1000)
    for number in range(700):
        made.add((500 + 90 * (number % 32 == 0), 510 + 5 * (number % 32), 512, 1023))
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
    answers = [fetch(page) for _ in range(2)]
    content = answers[0].read().decode()
    policy, other = (answer.headers["Content-Security-Policy"] for answer in answers)
    nonce = re.search(r"script-src 'nonce-([^']+)'", policy)[1]
    assert policy.startswith("default-src 'none'") and "{{" not in content
    # Kills: a style or script of the page that its own policy refuses; one nonce for all.
    assert content.count(f'nonce="{nonce}"') == content.count("<script") + content.count("<style")
    assert nonce not in other
    # Kills: no Host check, which lets a foreign page read the samples by a name of its own.
    for path, headers, status in (("x", {}, 404), ("", {"Host": "evil.example"}, 403)):
        with pytest.raises(urllib.error.HTTPError) as refused:
            fetch(page, path, **headers)
        answers.append(refused.value)
        assert refused.value.code == status
    for each in answers:
        each.close()


def test_a_browser_that_comes_back_goes_on_where_it_was(page, state):
    page.show(state)
    with listen(page) as listener:
        number, (news, values) = next_event(listener)
    # A minute is kept, not the whole run.
    assert (number, news["first"], len(news["samples"])) == (700, 100, 600)
    assert values["title"] == "3mm/r07"
    assert values["left"] == "00:20.0 left, 00:30.0 until it is too long for the workflow"
    state.add(None)
    state.add(None)
    page.show(state)
    # The last number of another recording says nothing of this one.
    for last, first, kept in (("700", 700, 2), ("9000", 102, 600)):
        with listen(page, last) as listener:
            _, (news, values) = next_event(listener)
        assert (news["first"], len(news["samples"]), news["samples"][-1]) == (first, kept, None)
        assert (values["gaps"], values["missing"]) == (1, 2)


def test_when_there_are_too_many_the_oldest_goes(page, state):
    page.show(state)
    with contextlib.ExitStack() as stack:
        listeners = []
        for _ in range(MOST_LISTENERS + 1):
            listeners.append(stack.enter_context(listen(page)))
            next_event(listeners[-1])  # before the next one comes, it is known
        assert next_event(listeners[0]) == b""
        state.add((1, 2, 3, 4))
        page.show(state)
        assert [next_event(each)[0] for each in listeners[1:]] == [701] * MOST_LISTENERS


# Kills: a listener that the recording waits for, or a browser's end that prints a traceback.
def test_a_hundred_browsers_come_and_go_and_hold_nothing_up(page, state, capfd):
    address = ("127.0.0.1", int(page.host.split(":")[1]))
    asked = f"GET {page.path}events HTTP/1.1\r\nHost: {page.host}\r\n\r\n".encode()
    with listen(page), listen(page):  # they never read an event
        for number in range(1000):
            state.add((number, 2, 3, 4))
            page.show(state)
            if number % 10 == 5:
                with socket.create_connection(address, timeout=5) as rude:
                    # Cut off within the question, or after it.
                    rude.sendall(asked[: 20 if number % 20 == 5 else None])
        page.close()
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("sensors", "remarks"),
    [
        (lambda n: (500 + n % 90, 500 + n % 80, 512 + n % 3, 500 + n % 15), {3: "flat", 4: "weak"}),
        (lambda n: (500 + n % 90, 500 + n % 80, 500 + n % 40, 500 + n % 60), {}),
    ],
)
def test_a_flat_or_weak_sensor_is_named(sensors, remarks):
    state = State(0.1)
    for n in range(400):
        assert n > 90 or not state.remarks(), "too short to show a wave"
        state.add(None if n % 7 == 0 else sensors(n))
    assert {sensor: words.split(":")[0] for sensor, words in state.remarks().items()} == remarks


@pytest.mark.slow
@needed
def test_the_page_in_a_real_browser(page, state, tmp_path):
    browser = Browser(tmp_path / "profile")
    try:
        browser.visit(page.address)
        assert browser.texts("#banner") == ["waiting for the first sample"]
        state.faults = ["no wave runs: end the recording, and record anew"]
        scores = [{"detector": "diagonal", "score": 0.5, "threshold": 0.2, "verdict": "x"}]
        state.judgement = SimpleNamespace(scores=scores, advice="enough: nodule")
        page.show(state)
        browser.wait_until("return document.querySelectorAll('#sensors canvas').length === 4")
        assert browser.texts("#banner") == state.faults
        assert browser.texts("#time") == ["01:10.0"]
        # Kills: a style of the report that makes the banner a small note, or takes a box away.
        wide = "return document.querySelector(arguments[0]).getBoundingClientRect().width"
        assert browser.run(wide, "#banner") == browser.run(wide, "#judged") > 800
        assert "sensor 3 is flat: check its connection" in browser.texts("#sensors .remark")
        assert browser.texts("#scores tbody tr") == ["diagonal0.50.2x"]
        assert browser.texts("#survey") == []
        state.faults, state.doing, state.length_mm = [], "is folded", 1000.0
        state.head_mm, state.places = 300.0, [(1, "confirmed", 200.0, "3.1 mm")]
        state.ended = "the survey is over"
        page.show(state)
        browser.wait_until("return !document.getElementById('survey').hidden")
        assert browser.texts("#banner") == ["ended: the survey is over"]
        assert browser.texts("#places tbody tr") == ["1200 mmconfirmed3.1 mm"]
        assert browser.messages() == [], "nothing that the policy refuses"
        assert browser.violations() == []
    finally:
        browser.close()
