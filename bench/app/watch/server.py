"""The read-only server of the page: four fixed files, the document, and its changes as server-sent events."""

import hmac
import sys
import threading
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from ipaddress import ip_address
from socket import AF_INET, AF_INET6, gethostname
from typing import Any

from bench.app.display.theme import DARK, LIGHT, Theme
from bench.app.watch.feed import Feed
from sim.errors import InvalidInput

HEARTBEAT = 1.0
"""Longest interval between two messages to a browser [s]."""
PATIENCE = 5.0
"""Time after which a browser that neither sends a request nor reads the response is disconnected [s]."""
MOST = 64
"""Maximum number of simultaneous connections; further ones are closed at once."""

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Connection": "close",
}
TYPES = {"html": "text/html", "css": "text/css", "js": "text/javascript"}


def is_loopback(address: str) -> bool:
    """Whether only this computer can reach an address."""
    with suppress(ValueError):
        return ip_address(address).is_loopback
    return address == "localhost"


class PageServer(ThreadingHTTPServer):
    """Serves the page of `feed` to browsers, each in a thread.

    address, port : interface and port to listen on; port 0 is any free one.
    token : first part of every path; empty for none, which is permitted on a loopback address only.

    Raises InvalidInput if the address or the port cannot be used.
    """

    daemon_threads = True
    # on Windows, this option would let a second program take over the port
    allow_reuse_address = sys.platform != "win32"

    def __init__(self, address: str, port: int, token: str, feed: Feed) -> None:
        if not token and not is_loopback(address):
            why = "without a token, the page is served on a loopback address only; omit --no-token"
            raise InvalidInput("--address", address, why)
        self.token, self.feed = token, feed
        self.pages = _pages()
        self.hosts = {"localhost", "127.0.0.1", "[::1]", address}
        self._free = threading.Semaphore(MOST)
        self.address_family = AF_INET6 if ":" in address else AF_INET
        try:
            super().__init__((address, port), Handler)
        except OSError as error:
            why = f"the page cannot be served there ({error.strerror or error}); choose another address or --port"
            raise InvalidInput("--address", f"{address}, port {port}", why) from None
        except OverflowError:
            raise InvalidInput("--port", port, "it must be from 0 (any free port) to 65535") from None

    @property
    def url(self) -> str:
        """Address (URL) of the page, including the token."""
        host, port = str(self.server_address[0]), self.server_address[1]
        if not is_loopback(host) and ip_address(host).is_unspecified:
            host = gethostname()
        host = f"[{host}]" if ":" in host else host
        return f"http://{host}:{port}/{self.token + '/' if self.token else ''}"

    def start(self) -> None:
        """Serve connections in a background thread."""
        threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.1}, name="page", daemon=True).start()

    def close(self) -> None:
        """End all connections, and close the port."""
        self.feed.close()
        self.shutdown()
        self.server_close()

    def process_request(self, request: Any, client_address: Any) -> None:
        """Serve a connection in a thread; close it if `MOST` connections are already open."""
        if self._free.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore errors of a connection: a browser may disconnect at any time."""


class Handler(BaseHTTPRequestHandler):
    """Answers GET and HEAD for the names of `PageServer.pages`, "state" and "events"; refuses everything else."""

    server: PageServer  # pyright: ignore[reportIncompatibleVariableOverride] - the type of the base class is wider
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "rockbench", ""
    timeout = PATIENCE
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        """Answer with a file, the document, or its changes."""
        name = self._name()
        if name == "events":
            self._stream()
        elif name == "state":
            self._answer(HTTPStatus.OK, "application/json", self.server.feed.since(0, HEARTBEAT)[1])
        elif name is not None:
            self._answer(HTTPStatus.OK, *self.server.pages[name])

    do_HEAD = do_GET

    def __getattr__(self, name: str) -> Any:
        """Refuse all other request methods: `http.server` looks up the attribute "do_X" for the request method X."""
        if name.startswith("do_"):
            return self._refuse_method
        raise AttributeError(name)

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing: the addresses contain the token."""

    def _refuse_method(self) -> None:
        text = "this page is read-only: GET and HEAD are the only methods\n"
        self._answer(HTTPStatus.METHOD_NOT_ALLOWED, "text/plain", text.encode(), {"Allow": "GET, HEAD"})

    def _name(self) -> str | None:
        """The requested name, "" for the page; None if the request was refused."""
        token, path = self.server.token, self.path.partition("?")[0].removeprefix("/")
        given = ""
        if token:
            given, _, path = path.partition("/")
        elif self.headers.get("Host", "").rsplit(":", 1)[0] not in self.server.hosts:
            # DNS rebinding: another site must not read this page through a host name that resolves to this computer
            self._answer(HTTPStatus.FORBIDDEN, "text/plain", b"open the address that rockbench printed\n")
            return None
        if not hmac.compare_digest(given.encode(), token.encode()):
            text = "the token in the address is missing or wrong: open the address that rockbench printed\n"
            self._answer(HTTPStatus.FORBIDDEN, "text/plain", text.encode())
            return None
        if path not in (*self.server.pages, "events", "state"):
            self._answer(HTTPStatus.NOT_FOUND, "text/plain", b"there is no such page\n")
            return None
        return path

    def _answer(
        self, status: HTTPStatus, kind: str, content: bytes | None, further: dict[str, str] | None = None
    ) -> None:
        # the body of a refused request is never read, so the connection cannot be reused
        self.close_connection = True
        self.send_response(status)
        length = {} if content is None else {"Content-Length": str(len(content))}
        for name, value in {"Content-Type": f"{kind}; charset=utf-8", **length, **HEADERS, **(further or {})}.items():
            self.send_header(name, value)
        self.end_headers()
        if content is not None and self.command != "HEAD":
            self.wfile.write(content)

    def _stream(self) -> None:
        """Send the document and then its changes, with at most `HEARTBEAT` between two messages."""
        self._answer(HTTPStatus.OK, "text/event-stream", None)
        if self.command == "HEAD":
            return
        version, feed = 0, self.server.feed
        while not feed.closed:
            version, text = feed.since(version, HEARTBEAT)
            self.wfile.write(b"data: %b\n\n" % text)


def _pages() -> dict[str, tuple[str, bytes]]:
    """Type and content of each file of the page by name; these files are read once."""
    folder = files("bench.app.watch") / "page"
    names = ("index.html", "style.css", "page.js", "draw.js")
    found = {name: (TYPES[name.rpartition(".")[2]], (folder / name).read_bytes()) for name in names}
    colours = f"{_colours(LIGHT)}\n@media (prefers-color-scheme: dark) {{\n{_colours(DARK)}\n}}\n"
    found["style.css"] = (TYPES["css"], colours.encode() + found["style.css"][1])
    return {"": found.pop("index.html"), **found}


def _colours(theme: Theme) -> str:
    names = ("ground", "raised", "text", "faint", "calm", "good", "wait", "alarm")
    lines = [f"--line-{number}: {colour};" for number, colour in enumerate(theme.lines)]
    return ":root { " + " ".join([*(f"--{name}: {getattr(theme, name)};" for name in names), *lines]) + " }"
