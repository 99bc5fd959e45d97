"""The page on this machine alone: who has its address may look, and nobody can do more.

The address holds a token that cannot be guessed. Any other address is refused, slowly; so is any host but this machine
by its own name, which keeps pages of other hosts out whose name was made to point here.
"""

from __future__ import annotations

import hmac
import os
import secrets
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from device.messages import RecoilError
from experiments.study.folders import PlaceError
from experiments.watch.folder import FolderWatch, Reader, watched_folder
from experiments.watch.page import PAGE_PARTS, page_parts, static, whole_page

HOST = "127.0.0.1"
REFUSAL_S = 0.25
"""How long a wrong token waits for its answer."""
REFUSED_AT_ONCE = 8
"""Of so many wrong tokens at a time each gets its answer; of more none does."""
VIEWERS = 64
"""Connections at a time; of further ones none is served."""
ASK_S, TAKE_S = 2.0, 10.0
"""How long somebody may take to ask, and to read what they asked for."""
ALIVE_S = 1.0
"""How often a viewer to whom nothing is new is told that the page is alive."""
NICE = 10
"""By how much this process stands behind a run, where both want the machine."""
_TYPES = {"watch.css": "text/css", "watch.js": "text/javascript"}
_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; style-src 'self'; script-src 'self'; connect-src 'self'; "
    "img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class WatchPage:
    """Where a page is served."""

    address: str
    port: int


class WatchServer(ThreadingHTTPServer):
    """Serves what a reader saw last. `PlaceError`: the port is taken, or none of this user's."""

    daemon_threads = True
    block_on_close = False
    allow_reuse_address = sys.platform != "win32"  # there it would share a port that is taken
    request_queue_size = VIEWERS

    def __init__(self, reader: Reader, port: int, name: str) -> None:
        self.reader, self.name, self.token = reader, name, secrets.token_urlsafe(24)
        self.refusals = threading.Semaphore(REFUSED_AT_ONCE)
        self._places = threading.Semaphore(VIEWERS)
        try:
            super().__init__((HOST, port), _Handler)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or error
            raise PlaceError(
                f"--port {port}: cannot be used ({reason}); perhaps another `recoil watch` is there: choose another "
                "--port, or 0 for any that is free"
            ) from error

    @property
    def page(self) -> WatchPage:
        """Where it is."""
        port = int(self.server_address[1])
        return WatchPage(address=f"http://{HOST}:{port}/{self.token}/", port=port)

    def service_actions(self) -> None:
        """End with the reader, where it broke off. `RecoilError` says with what."""
        error = self.reader.failure
        if error is not None:
            raise RecoilError(
                f"{self.name}: the looking broke off ({type(error).__name__}: {error}); no run is touched by that: "
                "start `recoil watch` anew"
            ) from error

    def process_request(self, request: object, client_address: object) -> None:
        """Serve a connection in a thread of its own, if there is a place."""
        if not self._places.acquire(blocking=False):
            self.shutdown_request(request)  # type: ignore[arg-type] # the library's types are looser
            return
        super().process_request(request, client_address)  # type: ignore[arg-type]

    def process_request_thread(self, request: object, client_address: object) -> None:
        """Serve it, and give its place back."""
        try:
            super().process_request_thread(request, client_address)  # type: ignore[arg-type]
        finally:
            self._places.release()

    def handle_error(self, request: object, client_address: object) -> None:
        """Somebody who went away in the middle is no trouble."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)  # type: ignore[arg-type]


class _Handler(BaseHTTPRequestHandler):
    """One request. The library closes the connection after it."""

    server: WatchServer
    timeout = ASK_S

    def do_GET(self) -> None:
        self.connection.settimeout(TAKE_S)
        path = self._allowed()
        if path is None:
            return
        if path == "events":
            self._events()
        elif path in _TYPES:
            self._answer(200, static(path), _TYPES[path])
        elif path == "":
            _, parts = self.server.reader.after(-1, 0.0)
            self._answer(200, whole_page(parts, self.server.name), "text/html")
        else:
            self._answer(404, b"Nothing is here.\n", "text/plain")

    do_HEAD = do_GET

    def _allowed(self) -> str | None:
        """What is asked for behind the token; `None`, once it was refused."""
        names = self.headers.get_all("Host") or []
        if len(names) != 1 or names[0].rpartition(":")[0] not in (HOST, "localhost"):
            self._answer(
                403, b"This page is for this machine alone: its address begins with 127.0.0.1.\n", "text/plain"
            )
            return None
        token, slash, rest = self.path.removeprefix("/").partition("/")
        if not hmac.compare_digest(token.encode("utf-8", "replace"), self.server.token.encode()):
            self._refuse()
            return None
        if not slash:
            self._answer(301, b"", "text/plain", Location=f"/{token}/")
            return None
        return rest.partition("?")[0]

    def _refuse(self) -> None:
        """A wrong token gets its answer late, and one of many none at all."""
        if not self.server.refusals.acquire(blocking=False):
            return
        try:
            threading.Event().wait(REFUSAL_S)
            self._answer(403, b"Not the address that `recoil watch` printed.\n", "text/plain")
        finally:
            self.server.refusals.release()

    def _answer(self, status: int, body: bytes, kind: str, **more: str) -> None:
        self._head(status, kind, **more, **{"Content-Length": str(len(body))})
        if self.command != "HEAD":
            self.wfile.write(body)

    def _head(self, status: int, kind: str, **more: str) -> None:
        self.send_response(status)
        for name, value in {"Content-Type": f"{kind}; charset=utf-8", **_HEADERS, **more}.items():
            self.send_header(name, value)
        self.end_headers()

    def _events(self) -> None:
        """Send the parts that change, when they do, until nobody reads any more."""
        self._head(200, "text/event-stream")
        if self.command == "HEAD":
            return
        number, sent = -1, ("",) * len(PAGE_PARTS)
        self.wfile.write(b"retry: 1000\n\n")
        while not self.server.reader.stopped:
            number, parts = self.server.reader.after(number, ALIVE_S)
            news = [(name, part) for name, part, old in zip(PAGE_PARTS, parts, sent, strict=True) if part != old]
            text = "".join(f"event: {name}\ndata: {part}\n\n" for name, part in news)
            self.wfile.write(text.encode(errors="replace") or b"event: alive\ndata:\n\n")
            sent = parts

    def _no_method(self) -> None:
        self._answer(405, b"This page can only be looked at.\n", "text/plain", Allow="GET, HEAD")

    do_POST = do_PUT = do_PATCH = do_DELETE = do_OPTIONS = _no_method

    def version_string(self) -> str:
        """No versions: they are nobody's business here."""
        return "recoil"

    def log_message(self, *_: object) -> None:
        """Nothing: the address would be in it."""


def serve_page(results: Path, port: int, tell: Callable[[WatchPage], None]) -> None:
    """Serve the page of a results folder until interrupted. `tell` is called once it can be opened.

    `PlaceError`: there is no such folder, or the port cannot be used. `RecoilError`: it broke off.
    """
    folder = watched_folder(results)
    if hasattr(os, "nice"):
        os.nice(NICE)
    reader = Reader(FolderWatch(folder), page_parts)
    with WatchServer(reader, port, str(folder)) as server:
        reader.start()
        try:
            tell(server.page)
            server.serve_forever()
        finally:
            reader.stop()
