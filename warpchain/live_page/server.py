"""The server of the live page; on 127.0.0.1 it serves the page and its walks to whoever has its token.

A request is refused unless it names this server as its host, comes from its own page or from no page, and brings the
token; so neither another user of the machine nor a page of another site, whatever name leads it here, gets a walk. The
answer is a line of JSON for each message. Whoever closes the connection ends the walk.
"""

import hmac
import json
import secrets
import select
import socket
import sys
import threading
from contextlib import suppress
from functools import cached_property
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import parse_qs, urlsplit

from warpchain.engine.processors import processors
from warpchain.inputs.validation import InputError, checked
from warpchain.live_page.page import FIRST, live_page

if TYPE_CHECKING:
    from warpchain.live_page.asked_walks import Walker

ADDRESS: Final = "127.0.0.1"
MOST_BYTES: Final = 65_536
"""Most bytes of a request; a floor of 256 points takes 10 kB."""
MOST_CONNECTIONS: Final = 32
PATIENCE: Final = 20.0
"""Time [s] after which a client is given up that does not take an answer."""
HASTE: Final = 5.0
"""Time [s] in which a request has to be there as a whole; on this machine it takes milliseconds."""
_NO_TOKEN: Final = (
    "This address lacks the token of the server. Open the address that `warpchain live` printed; "
    "`warpchain live 'ADDRESS'` opens the set-up of an older one.\n"
)


class LiveServer(ThreadingHTTPServer):
    """A live page: its server, which ends by `close` or with its process, and how a notebook shows it.

    Attributes:
        url: address of the page, with the token that it asks for; only this machine reaches it.
    """

    daemon_threads, block_on_close, request_queue_size = True, False, MOST_CONNECTIONS

    def __init__(self, port: int = 0, folder: Path | None = None) -> None:
        """Listen at a port, or at any that is free, and read the sweep of a folder; errors as of `live`."""
        sweep = None
        if folder is not None:
            from warpchain.results.sweep_result import load

            sweep = load(folder)
        self.token, self.closing = secrets.token_urlsafe(24), threading.Event()
        self.slots = threading.Semaphore(max(2, processors()))  # of walks at the same time; other requests wait
        self._connections = threading.Semaphore(MOST_CONNECTIONS)
        self._sweep, self._folder = sweep, folder or Path()
        super().__init__((ADDRESS, port), _Handler)
        self.page, self.url = live_page(sweep), f"http://{ADDRESS}:{self.server_port}/?token={self.token}"

    def __repr__(self) -> str:
        """The address."""
        return f"<live page at {self.url}>"

    def _repr_html_(self) -> str:
        """The page in a frame."""
        return f'<iframe title="live page" style="width:100%;height:820px;border:0" src="{self.url}"></iframe>'

    @cached_property
    def walker(self) -> "Walker":
        """What runs the walks; importing it takes a second, in which the browser opens the page."""
        from warpchain.live_page.asked_walks import Walker

        return Walker(self._sweep, self._folder)

    def start(self) -> None:
        """Serve in threads of their own, and load what the first walk needs."""
        threading.Thread(target=self.serve_forever, args=(0.1,), daemon=True).start()
        threading.Thread(target=self._warm_up, daemon=True).start()

    def _warm_up(self) -> None:
        first = iter([False])  # the walk is given up once its kernels are there
        with suppress(Exception):  # the page asks for it again, and is told
            self.walker.play(FIRST, lambda message: None, lambda: next(first, True))

    def close(self) -> None:
        """End walks and connections, and serve no more."""
        self.closing.set()
        self.shutdown()
        self.server_close()

    def verify_request(self, request: Any, client_address: Any) -> bool:
        """Whether there are few enough connections for one more; else it is closed."""
        return self._connections.acquire(blocking=False)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Serve a connection."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._connections.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Print what went wrong, unless the client has left before its answer."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """One request."""

    server: LiveServer
    timeout, server_version, sys_version = PATIENCE, "warpchain", ""

    def setup(self) -> None:
        """Give the request its time, however slowly it trickles in: then nothing more of it is read."""
        super().setup()
        self._reading = threading.Timer(HASTE, self._read_no_more)
        self._reading.daemon = True
        self._reading.start()

    def finish(self) -> None:
        """End the connection."""
        self._reading.cancel()
        super().finish()

    def _read_no_more(self) -> None:
        with suppress(OSError):  # the client has ended it
            self.connection.shutdown(socket.SHUT_RD)

    def log_message(self, *_: object) -> None:
        """Keep the terminal free."""

    def do_GET(self) -> None:
        """The page."""
        url = urlsplit(self.path)
        if self._is_admitted(parse_qs(url.query).get("token", [""])[0]):
            if url.path != "/":
                self._reply(404, "There is one page, at /.\n")
                return
            nonce = secrets.token_urlsafe(16)
            policy = f"default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; img-src data:; "
            policy += "connect-src 'self'; base-uri 'none'; form-action 'none'"
            kind = {"Content-Type": "text/html; charset=utf-8", "Content-Security-Policy": policy}
            self._reply(200, self.server.page.replace("{{nonce}}", nonce), kind)

    def do_POST(self) -> None:
        """A walk, or a sample without frames."""
        if not self._is_admitted(self.headers.get("X-Token", "")):
            return
        size = self.headers.get("Content-Length", "")
        if not (size.isascii() and size.isdigit()) or len(size) > 9 or int(size) > MOST_BYTES:
            self._reply(413, f"A request has a Content-Length, and at most {MOST_BYTES} bytes.\n")
            return
        try:
            body = self.rfile.read(int(size))
            self._reading.cancel()
            asked = checked(json.loads(body), "request", dict[str, Any])
            if self.path in ("/walk", "/sample"):
                self._answer(asked)
            else:
                self._reply(404, "Ask for /walk or /sample.\n")
        except (ValueError, RecursionError) as error:  # not JSON, or something else than what is asked for
            self._reply(400, f"{error}\n")

    def _is_admitted(self, token: str) -> bool:
        """Whether the request is meant for this server and brings its token; else it is refused."""
        hosts = [f"{name}:{self.server.server_port}" for name in (ADDRESS, "localhost")]
        origins = self.headers.get_all("Origin", [])
        if self.headers.get_all("Host", []) not in [[host] for host in hosts]:
            self._reply(403, "This is another host.\n")
        elif any(origin not in [f"http://{host}" for host in hosts] for origin in origins):
            self._reply(403, "The page of another site asks.\n")
        elif not hmac.compare_digest(token.encode("utf-8", "replace"), self.server.token.encode()):
            self._reply(403, _NO_TOKEN)
        else:
            return True
        return False

    def _reply(self, status: int, text: str, kind: dict[str, str] | None = None) -> None:
        body = text.encode()
        self.send_response(status)
        usual = {"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body))}
        more = {"Cache-Control": "no-store", "Referrer-Policy": "no-referrer", "X-Content-Type-Options": "nosniff"}
        for name, value in (usual | more | (kind or {})).items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def _answer(self, asked: dict[str, Any]) -> None:
        """Send the messages of a walk, and at its end a refusal if there is one."""
        from warpchain.live_page.asked_walks import GoneError

        self.send_response(200)
        self.send_header("Content-Type", "application/x-ndjson")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        while not self.server.slots.acquire(timeout=0.1):
            if self._is_gone():
                return
        try:
            walker = self.server.walker
            (walker.play if self.path == "/walk" else walker.sample)(asked, self._send, self._is_gone)
        except InputError as error:
            self._send({"error": error.args[0]})
        except (GoneError, OSError):
            return
        finally:
            self.server.slots.release()

    def _send(self, message: dict[str, Any]) -> None:
        self.wfile.write(json.dumps(message, separators=(",", ":"), allow_nan=False).encode() + b"\n")

    def _is_gone(self) -> bool:
        """Whether the client has closed the connection, or the server is being closed."""
        readable, _, _ = select.select([self.connection], [], [], 0)
        with suppress(OSError):
            return self.server.closing.is_set() or bool(readable and not self.connection.recv(1, socket.MSG_PEEK))
        return True


def live(folder: str | Path | None = None, *, port: int = 0) -> LiveServer:
    """Show a live page, on which sliders change a walk, in a notebook whose kernel runs on this machine.

    Args:
        folder: folder of a sweep, or a merged file, whose cells can be clicked to see their walks; None: no sweep.
        port: port of the server on 127.0.0.1; 0: any that is free.

    Returns:
        The page: a notebook shows it, `url` is its address, `close` ends its server.

    Raises:
        InputError: the folder holds no sweep.
        OSError: the port is taken.
    """
    server = LiveServer(port, None if folder is None else Path(folder))
    server.start()
    return server
