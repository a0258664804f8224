"""The live page: what a recording or a survey shows, in a browser on the same computer.

The page gets the samples as server-sent events. The recording only puts its newest state into
memory; a thread for each browser sends it on, so a slow or dead browser never touches the
recording.
"""

import contextlib
import json
import secrets
import threading
import webbrowser
from collections.abc import Iterator
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
_STYLES = ("vendor/uplot/uPlot.min.css", "report.css")
_SCRIPTS = (
    "scripts/elements.js",
    "vendor/uplot/uPlot.iife.min.js",
    *(f"scripts/{name}.js" for name in ("theme", "charts")),
)


class LivePage(ThreadingHTTPServer):
    """A page on the loopback, under an address that nobody can guess."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Browser)
        self._news = threading.Condition()
        self._samples: list[tuple[float, ...] | None] = []
        self._count, self._version, self._values = 0, 0, "null"
        self._listeners: list[object] = []
        self._closed = False
        self.host = f"127.0.0.1:{self.server_port}"
        self.path = f"/{secrets.token_urlsafe(16)}/"
        self.address = f"http://{self.host}{self.path}"
        threading.Thread(target=self.serve_forever, args=(0.1,), daemon=True).start()

    def show(self, state: State) -> None:
        """Take over the state."""
        values = json.dumps(state.as_values(), allow_nan=False)
        with self._news:
            self._samples = list(state.recent)
            self._count, self._values = state.samples, values
            self._version += 1
            self._news.notify_all()

    def close(self) -> None:
        """Send the last state, and end all events."""
        self.shutdown()
        with self._news:
            self._closed = True
            self._news.notify_all()
            self._news.wait_for(lambda: not self._listeners, LAST_WORDS_S)
        self.server_close()

    def document(self) -> tuple[str, str]:
        """Return the page, and the policy that allows its own style and script alone."""
        nonce = secrets.token_urlsafe(16)
        style, script = (
            "\n".join((_REPORT / name).read_text(encoding="utf-8") for name in names)
            for names in (_STYLES, _SCRIPTS)
        )
        page = (_REPORT / "live.html").read_text(encoding="utf-8")
        for name, text in {"style": style, "script": script, "nonce": nonce}.items():
            page = page.replace(f"{{{{ {name} }}}}", text)
        policy = "default-src 'none'; img-src data:; connect-src 'self'; base-uri 'none'"
        policy += f"; form-action 'none'; style-src 'nonce-{nonce}'; script-src 'nonce-{nonce}'"
        return page, f"{policy}; frame-ancestors 'none'"

    def events(self, sent: int) -> Iterator[str]:
        """Yield news as events, up to the last state or until newer browsers take the place.

        The id of an event is the number of samples so far; a browser begins with the `sent` that
        it has.
        """
        mine, version = object(), 0
        with self._news:
            self._listeners.append(mine)
            del self._listeners[:-MOST_LISTENERS]
            self._news.notify_all()
        try:
            while True:
                with self._news:
                    while self._version == version and not self._closed and mine in self._listeners:
                        self._news.wait()
                    if self._version == version or mine not in self._listeners:
                        return
                    new = min(self._count - sent, len(self._samples))
                    # A number from another recording is above all of this one: begin anew.
                    new = len(self._samples) if new < 0 else new
                    samples = self._samples[len(self._samples) - new :]
                    sent, version, values = self._count, self._version, self._values
                data = json.dumps({"first": sent - new, "samples": samples})
                yield f"id: {sent}\ndata: [{data}, {values}]\n\n"
        finally:
            with self._news:
                if mine in self._listeners:
                    self._listeners.remove(mine)
                self._news.notify_all()


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
    try:
        yield page
    finally:
        page.close()


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
            self._begin("text/html; charset=utf-8", policy)
            self.wfile.write(document.encode("utf-8"))
        elif self.path == f"{page.path}events":
            self._begin("text/event-stream", "default-src 'none'")
            last = self.headers.get("Last-Event-ID", "")
            sent = int(last) if last.isascii() and last.isdecimal() else 0
            for event in page.events(sent):
                self.wfile.write(event.encode("utf-8"))
        else:
            self.send_error(404)

    def log_message(self, *arguments: object) -> None:
        """Print nothing: the terminal belongs to the recording."""

    def _begin(self, kind: str, policy: str) -> None:
        self.send_response(200)
        for name, value in (
            ("Content-Type", kind),
            ("Content-Security-Policy", policy),
            ("Cache-Control", "no-store"),
            ("Referrer-Policy", "no-referrer"),
            ("X-Content-Type-Options", "nosniff"),
        ):
            self.send_header(name, value)
        self.end_headers()
