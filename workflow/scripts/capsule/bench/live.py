"""The live page: what a recording or a survey shows, in a browser on the same computer.

The page gets the samples as server-sent events. The recording only puts its newest state into
memory; a thread for each browser sends it on, so a slow or dead browser never touches the
recording.
"""

import contextlib
import json
import secrets
import socket
import sys
import threading
import time
import webbrowser
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import TypeAlias

from capsule.bench.state import State
from capsule.engine.project import PROJECT

SHOW_EVERY_S = 0.1
# Further connections close the oldest one; a browser that is still there comes back.
MOST_CONNECTIONS = 8
# A browser that takes nothing for so long is dead.
TAKES_WITHIN_S = 5.0
LAST_WORDS_S = 1.0
# What the classes of the standard library's server hand on.
_Request: TypeAlias = socket.socket | tuple[bytes, socket.socket]
_RetAddress: TypeAlias = object
_REPORT = PROJECT / "workflow" / "report"
_STYLES = ("vendor/uplot/uPlot.min.css", "report.css")
_SCRIPTS = (
    "vendor/uplot/uPlot.iife.min.js",
    *(f"scripts/{name}.js" for name in ("palette", "elements", "chart_frame")),
)


class LivePage:
    """A page on the loopback, under an address that nobody can guess."""

    def __init__(self) -> None:
        self._news = threading.Condition()
        self._samples: list[tuple[float, ...] | None] = []
        self._count, self._version, self._values = 0, 0, "null"
        self._closed = False
        self._server = _Server(self)
        host, port = self._server.server_address[:2]
        self.host = f"{host!s}:{port}"
        self.path = f"/{secrets.token_urlsafe(16)}/"
        self.address = f"http://{self.host}{self.path}"
        threading.Thread(
            target=self._server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True
        ).start()

    def open(self) -> None:
        """Open the page in a browser, without waiting for it; a browser in text is left alone."""
        try:
            browser = webbrowser.get()
        except webbrowser.Error:
            return
        if type(browser) is not webbrowser.GenericBrowser:
            threading.Thread(target=browser.open, args=(self.address,), daemon=True).start()

    def show(self, state: State) -> None:
        """Take over the state."""
        values = json.dumps(state.as_values(), allow_nan=False)
        with self._news:
            self._samples = list(state.recent)
            self._count, self._values = state.samples, values
            self._version += 1
            self._news.notify_all()

    def close(self) -> None:
        """Send the last state, and end all connections."""
        with self._news:
            self._closed = True
            self._news.notify_all()
        self._server.shutdown()
        deadline_s = time.monotonic() + LAST_WORDS_S
        while self._server.connections and time.monotonic() < deadline_s:
            time.sleep(0.01)
        self._server.server_close()

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

    def next_event(self, sent: int, version: int) -> tuple[str, int, int] | None:
        """Wait for news, and return them as an event; None after the last one.

        Parameters
        ----------
        sent : int
            Number of samples that the browser has.
        version : int
            Version of the state that it has.

        Returns
        -------
        event : str
            Its id is the number of samples so far.
        sent, version : int
            What the browser has after it.
        """
        with self._news:
            self._news.wait_for(lambda: self._version != version or self._closed)
            if self._version == version:
                return None
            new = min(self._count - sent, len(self._samples))
            # A number from another recording is above all of this one: begin anew.
            new = len(self._samples) if new < 0 else new
            samples = self._samples[len(self._samples) - new :]
            count, version, values = self._count, self._version, self._values
        data = json.dumps({"first": count - new, "samples": samples})
        return f"id: {count}\ndata: [{data}, {values}]\n\n", count, version


@contextlib.contextmanager
def opened_page(*, browser: bool = True) -> Iterator[LivePage]:
    """Make a live page, tell its address, and open it in a browser; close it at the end."""
    page = LivePage()
    print(f"live page: {page.address}", flush=True)
    if browser:
        page.open()
    try:
        yield page
    finally:
        page.close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, page: LivePage) -> None:
        self.page = page
        self.connections: list[socket.socket] = []
        self._changing = threading.Lock()
        super().__init__(("127.0.0.1", 0), _Handler)

    def process_request(self, request: _Request, client_address: _RetAddress) -> None:
        with self._changing:
            if isinstance(request, socket.socket):  # as every connection over TCP
                self.connections.append(request)
            oldest = self.connections[:-MOST_CONNECTIONS]
        for each in oldest:
            self.shutdown_socket(each)
        super().process_request(request, client_address)

    def shutdown_request(self, request: _Request) -> None:
        with self._changing:
            self.connections = [each for each in self.connections if each is not request]
        super().shutdown_request(request)

    @staticmethod
    def shutdown_socket(request: socket.socket) -> None:
        """End a connection, so that its thread ends too."""
        try:
            request.shutdown(socket.SHUT_RDWR)
        except OSError:
            return  # it has ended by itself

    def handle_error(self, request: _Request, client_address: _RetAddress) -> None:
        """Say nothing of a browser that has left."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    timeout = TAKES_WITHIN_S

    def do_GET(self) -> None:
        page = self.server.page
        if self.headers.get("Host") != page.host:  # of a page elsewhere that found the port
            self.send_error(403)
        elif self.path == page.path:
            document, policy = page.document()
            self._begin("text/html; charset=utf-8", policy)
            self.wfile.write(document.encode("utf-8"))
        elif self.path == f"{page.path}events":
            self._begin("text/event-stream", "default-src 'none'")
            self._send_events(page)
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

    def _send_events(self, page: LivePage) -> None:
        last = self.headers.get("Last-Event-ID", "")
        sent, version = int(last) if last.isascii() and last.isdecimal() else 0, 0
        while event := page.next_event(sent, version):
            text, sent, version = event
            self.wfile.write(text.encode("utf-8"))
