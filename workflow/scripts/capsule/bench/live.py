"""The live page: what a recording or a survey shows, in a browser on the same computer.

The page gets the samples as server-sent events. The recording only puts its newest state into
memory; a thread for each browser sends it on, so a slow or dead browser never touches the
recording.
"""

import contextlib
import json
import re
import secrets
import threading
import time
import webbrowser
from collections import deque
from collections.abc import Iterable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from capsule.bench.state import State
from capsule.engine.project import PROJECT

SHOW_EVERY_S = 0.1
# A further browser ends the oldest one's events; one that is still there comes back.
MOST_LISTENERS = 8
# A browser that takes nothing for so long is dead.
TAKES_WITHIN_S = 5.0
LAST_WORDS_S = 1.0
_REPORT = PROJECT / "workflow" / "report"


class LivePage(ThreadingHTTPServer):
    """A page on the loopback, under an address that nobody can guess."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Browser)
        # Number of samples so far, the last of them, and all else as JSON; replaced as a whole.
        self._shown: tuple[int, list[tuple[float, ...] | None], str] | None = None
        self._listeners: deque[object] = deque(maxlen=MOST_LISTENERS)
        self._closed = threading.Event()
        self.host = f"127.0.0.1:{self.server_port}"
        self.path = f"/{secrets.token_urlsafe(16)}/"
        self.address = f"http://{self.host}{self.path}"
        threading.Thread(target=self.serve_forever, args=(SHOW_EVERY_S,), daemon=True).start()

    def show(self, state: State) -> None:
        """Take over the state."""
        values = json.dumps(state.as_values(), allow_nan=False)
        self._shown = state.samples, list(state.recent), values

    def close(self) -> None:
        """Send the last state, and end all events."""
        self.shutdown()
        self._closed.set()
        until_s = time.monotonic() + LAST_WORDS_S
        while self._listeners and time.monotonic() < until_s:
            time.sleep(SHOW_EVERY_S / 10)
        self.server_close()

    def document(self) -> tuple[str, str]:
        """Return the page, and the policy that allows its own style and script alone."""
        nonce = secrets.token_urlsafe(16)
        page = (_REPORT / "live.html").read_text(encoding="utf-8").replace("{{ nonce }}", nonce)
        # The page names the files of the report that it holds.
        for file in re.findall("{{ (.+) }}", page):
            page = page.replace(f"{{{{ {file} }}}}", (_REPORT / file).read_text(encoding="utf-8"))
        policy = "default-src 'none'; img-src data:; connect-src 'self'; base-uri 'none'"
        policy += f"; form-action 'none'; style-src 'nonce-{nonce}'; script-src 'nonce-{nonce}'"
        return page, f"{policy}; frame-ancestors 'none'"

    def events(self, sent: int) -> Iterator[str]:
        """Yield news as events, up to the last state or until newer browsers take the place.

        The id of an event is the number of samples so far; a browser begins with the `sent` that
        it has.
        """
        mine, last = object(), None
        self._listeners.append(mine)
        try:
            while mine in self._listeners:
                closed, shown = self._closed.is_set(), self._shown
                if shown and shown is not last:
                    last = shown
                    count, recent, values = shown
                    # A number from another recording is above all of this one: begin anew.
                    new = count - sent if sent <= count else count
                    samples, sent = recent[max(len(recent) - new, 0) :], count
                    data = json.dumps({"first": count - len(samples), "samples": samples})
                    yield f"id: {count}\ndata: [{data}, {values}]\n\n"
                elif closed:
                    return
                self._closed.wait(SHOW_EVERY_S)
        finally:
            with contextlib.suppress(ValueError):
                self._listeners.remove(mine)


@contextlib.contextmanager
def opened_page(*, browser: bool = True) -> Iterator[LivePage]:
    """Make a live page, tell its address, and open it in a browser; close it at the end.

    It does not wait for the browser; one in text is left alone.
    """
    page = LivePage()
    print(f"live page: {page.address}", flush=True)
    if browser:
        with contextlib.suppress(webbrowser.Error):
            found = webbrowser.get()
            if type(found) is not webbrowser.GenericBrowser:
                threading.Thread(target=found.open, args=(page.address,), daemon=True).start()
    with contextlib.closing(page):
        yield page


class _Browser(BaseHTTPRequestHandler):
    timeout = TAKES_WITHIN_S
    server: LivePage

    def handle(self) -> None:
        """Answer, and say nothing of a browser that has left."""
        with contextlib.suppress(OSError):
            super().handle()

    def do_GET(self) -> None:
        page = self.server
        if self.headers.get("Host") != page.host:  # of a page elsewhere that found the port
            self.send_error(403)
        elif self.path == page.path:
            document, policy = page.document()
            self._send("text/html; charset=utf-8", policy, [document])
        elif self.path == f"{page.path}events":
            last = self.headers.get("Last-Event-ID", "")
            sent = int(last) if last.isascii() and last.isdecimal() else 0
            self._send("text/event-stream", "default-src 'none'", page.events(sent))
        else:
            self.send_error(404)

    def log_message(self, *arguments: object) -> None:
        """Print nothing: the terminal belongs to the recording."""

    def _send(self, kind: str, policy: str, texts: Iterable[str]) -> None:
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Security-Policy", policy)
        self.send_header("Cache-Control", "no-store")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        for text in texts:
            self.wfile.write(text.encode("utf-8"))
