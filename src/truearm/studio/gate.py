"""Who may talk to the window: every connection and every message passes here before viser sees it.

viser listens for anybody who asks, from any web page, and takes what it is sent. So its server is started with a gate
around it (:func:`start_server`), by replacing for that moment the one function with which it listens,
``websockets.asyncio.server.serve``. What is relied on, each held by a test in ``tests/studio/test_gate.py``:

- ``WebsockServer._background_worker`` looks that function up when it starts, and gives it ``process_request``;
- each connection is read with ``recv()`` alone, and what comes is msgpack with the name of its kind in ``type``;
- uploads are ``FileTransferStartUpload`` with ``size_bytes`` and ``FileTransferPart`` with ``content``.

The socket is bound here before, so viser cannot move on to another port, whatever its environment says.
"""

from __future__ import annotations

import hmac
import http
import ipaddress
import logging
import secrets
import socket
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from typing import Any, Final
from urllib.parse import parse_qs, urlsplit

import msgspec
import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from truearm.errors import InputError
from truearm.limits import limit
from truearm.printable import printable, shortened

#: A message of the window is small; files come in parts of half a megabyte.
_MESSAGE_SIZE: Final = 4_000_000
#: So many windows are open at once.
_WINDOWS: Final = 16
#: So many files are taken in at once.
_UPLOADS: Final = 4
#: What any window may send: where it looks from, and answers that viser asked for.
_LOOKING: Final = frozenset({"ViewerCameraMessage", "GetRenderResponseMessage", "FileTransferPartAck"})
#: What only the window that works may send. Everything else is refused: asking for a public address, for example.
_WORKING: Final = frozenset(
    {
        "GuiUpdateMessage",
        "GuiButtonHoldMessage",
        "GuiFormSubmitMessage",
        "GuiFormDirtyMessage",
        "CommandTriggerMessage",
        "FileTransferStartUpload",
        "FileTransferPart",
        "ScenePointerMessage",
        "SceneNodeClickMessage",
        "SceneNodeDragMessage",
        "TransformControlsUpdateMessage",
        "TransformControlsDragStartMessage",
        "TransformControlsDragEndMessage",
    }
)
#: Headers of every answer. The page is one file that asks nobody else, so it may not: its own address can name another
#: server to obey, and that is refused here.
_HEADERS: Final = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
_POLICY: Final = (
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; connect-src 'self' ws://{host} data: blob:; "
    "frame-ancestors 'none'; form-action 'none'; base-uri 'none'; object-src 'none'"
)
#: The page that takes the token out of the address: the browser then comes again with the cookie alone.
_ENTER: Final = (
    '<!doctype html><meta charset="utf-8"><meta name="referrer" content="no-referrer">'
    '<meta http-equiv="refresh" content="0;url=/"><title>truearm studio</title>'
)


@dataclass(frozen=True)
class Access:
    """Where the window is served, and to whom.

    Attributes
    ----------
    host, port
        As bound.
    token
        What a browser must bring; None for none, on loopback alone.
    names
        Names and addresses by which a browser may call this machine, in lower case; the numeric addresses of a machine
        that listens on more than loopback are all allowed.
    """

    host: str
    port: int
    token: str | None
    names: frozenset[str]

    @property
    def address(self) -> str:
        """The page's address, without the token."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        shown = {"0.0.0.0": "127.0.0.1", "[::]": "[::1]"}.get(host, host)
        return f"http://{shown}:{self.port}/"

    @property
    def entrance(self) -> str:
        """The address to open first: it holds the token, where there is one."""
        return self.address if self.token is None else f"{self.address}?token={self.token}"

    @property
    def cookie(self) -> str:
        """The name of the cookie that stands for the token from then on."""
        return f"truearm-studio-{self.port}"

    def knows(self, name: str) -> bool:
        """Return whether a browser may call this machine by a name."""
        if name in self.names:
            return True
        if is_loopback(self.host):
            return False
        with suppress(ValueError):
            ipaddress.ip_address(name)
            return True
        return False

    def admits(self, token: str | None) -> bool:
        """Return whether a token is the right one; it takes as long for every wrong one."""
        if self.token is None:
            return True
        given = (token or "").encode("utf-8", "surrogatepass")
        return hmac.compare_digest(given, self.token.encode())


@dataclass
class _Upload:
    """A file that is coming: its announced size, and what has come [bytes]."""

    size: int
    parts: int
    came: int = 0


@dataclass(eq=False)
class Gate:
    """Decides on requests and messages, and which window works.

    Attributes
    ----------
    access
        Who is let in.
    say
        Called with every refusal in words; from the server's thread.
    blocked
        Called with the number of a window of which something was refused, and why; from the server's thread.
    offers
        Elements that a window which only reads may use: those with which it takes over.
    """

    access: Access
    say: Callable[[str], None] = lambda _: None
    blocked: Callable[[ServerConnection, str], None] = lambda *_: None
    offers: set[str] = field(default_factory=set)
    _working: ServerConnection | None = None
    _uploads: dict[str, tuple[ServerConnection, _Upload]] = field(default_factory=dict)
    _said: dict[str, float] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def answer(
        self, theirs: Callable[[ServerConnection, Request], Response | None]
    ) -> Callable[[ServerConnection, Request], Response | None]:
        """Return what decides on a request before viser's own function sees it."""

        def decided(connection: ServerConnection, request: Request) -> Response | None:
            response = self._decision(connection, request)
            if response is None:
                response = theirs(connection, request)
                if response is None:
                    return None
            for name, value in _HEADERS.items():
                response.headers[name] = value
            host = next(iter(request.headers.get_all("Host")), "")
            if self._refused_host(host) is None:
                response.headers["Content-Security-Policy"] = _POLICY.format(host=host)
            return response

        return decided

    def _decision(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the answer to a request that goes no further; None where viser may answer."""
        headers = request.headers
        upgrade = [value.lower() for value in headers.get_all("Upgrade")]
        is_socket = "websocket" in upgrade
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if len(hosts) != 1 or len(origins) > 1:
            return self._refuse(connection, 400, "a request with no Host, or with several of Host or Origin")
        refused = self._refused_host(hosts[0])
        if refused is not None:
            return self._refuse(connection, 403, refused)
        if (is_socket or origins) and origins != [f"http://{hosts[0]}"]:
            came = origins[0] if origins else "none"
            return self._refuse(connection, 403, f"a page of another origin ({_shown(came)})")
        if upgrade and (not is_socket or headers.get_all("Upgrade") != ["websocket"]):
            return self._refuse(connection, 400, "a connection of another kind")
        path, _, query = request.path.partition("?")
        given = parse_qs(query, max_num_fields=4).get("token", []) if len(query) < 1000 else []
        if given and not is_socket and path == "/" and self.access.token is not None:
            if len(given) != 1 or not self.access.admits(given[0]):
                return self._refuse(connection, 401, "a wrong token")
            return self._entered(connection)
        if not self.access.admits(self._brought(headers)):
            return self._refuse(connection, 401, "no token, or a wrong one")
        if query:
            return self._refuse(connection, 404, "an address with a question mark, which could name another server")
        if is_socket and len(connection.server.connections) >= _WINDOWS:
            return self._refuse(connection, 503, f"more than {_WINDOWS} windows at once")
        return None

    def _refused_host(self, host: str) -> str | None:
        """Return why this machine is not called by a name; None if it is."""
        name = ""
        with suppress(ValueError):
            split = urlsplit(f"//{host}")
            _ = split.port  # refuses what is no number
            if split.netloc == host and not (split.username or split.password or split.path or split.query):
                name = (split.hostname or "").lower()
        if name and self.access.knows(name):
            return None
        return f"a request for another machine ({_shown(host)})"

    def _brought(self, headers: Headers) -> str | None:
        """Return the token in the cookie of a request."""
        for text in headers.get_all("Cookie"):
            with suppress(CookieError):
                found = SimpleCookie(text).get(self.access.cookie)
                if found is not None:
                    return found.value
        return None

    def _entered(self, connection: ServerConnection) -> Response:
        """Return the page that gives the browser its cookie."""
        body = _ENTER.encode()
        cookie = f"{self.access.cookie}={self.access.token}; Path=/; HttpOnly; SameSite=Strict"
        headers = Headers(
            {"Content-Type": "text/html; charset=utf-8", "Content-Length": str(len(body)), "Set-Cookie": cookie}
        )
        return Response(http.HTTPStatus.OK, "OK", headers, body)

    def _refuse(self, connection: ServerConnection, status: int, why: str) -> Response:
        self._tell(f"refused: {why}")
        return connection.respond(http.HTTPStatus(status), f"truearm studio refused this: {why}.\n")

    def _tell(self, words: str) -> None:
        """Say what was refused; the same words once in a second, so that nobody fills a log with them."""
        now = time.monotonic()
        with self._lock:
            if now - self._said.get(words, -1.0) < 1.0:
                return
            if len(self._said) > 100:
                self._said.clear()
            self._said[words] = now
        self.say(words)

    def is_working(self, connection: ServerConnection | None) -> bool:
        """Return whether a window works, and does not only read."""
        with self._lock:
            return connection is not None and connection is self._working

    def take_over(self, connection: ServerConnection | None) -> None:
        """Let a window work; the one that did only reads from now on."""
        with self._lock:
            self._working = connection

    def arrived(self, connection: ServerConnection) -> bool:
        """Let the first window work; return whether this one does."""
        with self._lock:
            if self._working is None or self._working.state.name == "CLOSED":
                self._working = connection
            return connection is self._working

    def gone(self, connection: ServerConnection) -> None:
        """Forget a window, and what it was sending."""
        with self._lock:
            if self._working is connection:
                self._working = None
            self._uploads = {name: one for name, one in self._uploads.items() if one[0] is not connection}

    def passes(self, connection: ServerConnection, raw: object) -> bool:
        """Return whether a message may go on to viser.

        Raises
        ------
        ValueError
            If it is malformed: the connection is closed then, and the window comes again by itself.
        """
        if not isinstance(raw, bytes):
            raise ValueError("a text where messages are binary")
        try:
            message = msgspec.msgpack.decode(raw)
            kind = message["type"]
        except (msgspec.DecodeError, TypeError, KeyError, RecursionError) as error:
            raise ValueError("a message that cannot be read") from error
        if kind in _LOOKING:
            _check(message, kind)
            return True
        if kind not in _WORKING:
            return self._block(connection, f"the message {_shown(str(kind))} is not taken from a window")
        if not self.is_working(connection) and message.get("uuid") not in self.offers:
            return self._block(connection, "this window only reads; take over to work in it")
        if kind == "GuiUpdateMessage" and (
            not isinstance(message.get("updates"), dict) or set(message["updates"]) != {"value"}
        ):
            return self._block(connection, "an element was to be changed otherwise than by its value")
        if kind == "FileTransferStartUpload":
            return self._begins(connection, message)
        if kind == "FileTransferPart":
            return self._goes_on(connection, message)
        _check(message, kind)
        return True

    def _begins(self, connection: ServerConnection, message: Mapping[str, Any]) -> bool:
        size, parts, name = message.get("size_bytes"), message.get("part_count"), message.get("transfer_uuid")
        if not (isinstance(size, int) and isinstance(parts, int) and isinstance(name, str)):
            raise ValueError("an upload without size or name")
        if size < 0 or parts < 0 or parts > 1 + size:
            raise ValueError("an upload of no size")
        if size > limit("upload"):
            return self._block(
                connection, f"the file is too large to be taken in: {size} bytes; allowed: {limit('upload')} or fewer"
            )
        with self._lock:
            full = len(self._uploads) >= _UPLOADS or name in self._uploads
            if not full and parts:
                self._uploads[name] = (connection, _Upload(size, parts))
        return not full or self._block(connection, "too many files at once; wait for the others")

    def _goes_on(self, connection: ServerConnection, message: Mapping[str, Any]) -> bool:
        name, content = message.get("transfer_uuid"), message.get("content")
        if not isinstance(content, bytes) or not isinstance(name, str):
            raise ValueError("a part of a file without content")
        with self._lock:
            known = self._uploads.get(name)
            if known is None or known[0] is not connection:
                return False  # refused before, in words
            upload = known[1]
            upload.came += len(content)
            upload.parts -= 1
            if upload.came <= upload.size and upload.parts > 0:
                return True
            del self._uploads[name]
        if upload.came > upload.size:
            raise ValueError("more of a file than was announced")
        return True

    def _block(self, connection: ServerConnection, why: str) -> bool:
        self._tell(f"refused: {why}")
        self.blocked(connection, why)
        return False

    def connection_class(self) -> type[ServerConnection]:
        """Return the kind of connection whose every message passes the gate."""
        gate = self

        class Watched(ServerConnection):
            """A connection that drops what may not pass, and closes where a message is malformed."""

            async def recv(self, decode: bool | None = None) -> Any:
                while True:
                    raw = await super().recv(decode)
                    try:
                        if gate.passes(self, raw):
                            return raw
                    except ValueError as error:
                        gate._tell(f"refused: {error}")
                        await self.close(1002, f"{error}")

        return Watched


def _check(message: Mapping[str, Any], kind: str) -> None:
    """Refuse a message that its kind cannot be made of, as viser would stumble over it."""
    if not all(isinstance(name, str) for name in message):
        raise ValueError(f"a message {kind} with a name that is no text")
    try:
        viser._messages.Message.deserialize(msgspec.msgpack.encode(message))
    except Exception as error:  # whatever it is that its fields cannot be made of
        raise ValueError(f"a message {kind} that cannot be read") from error


def is_loopback(host: str) -> bool:
    """Return whether only this machine reaches a host."""
    if host == "localhost":
        return True
    with suppress(ValueError):
        return ipaddress.ip_address(host).is_loopback
    return False


def new_token() -> str:
    """Return a token that nobody guesses."""
    return secrets.token_urlsafe(24)


def listening_socket(host: str, port: int) -> socket.socket:
    """Return a socket that listens, or refuse.

    Raises
    ------
    InputError
        If the host is none of this machine's, or the port is taken; a free one is named.
    """
    try:
        family, _, _, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    except (OSError, UnicodeError) as error:
        raise InputError("this is no address of this machine", parameter="host", came=host) from error
    bound = socket.socket(family, socket.SOCK_STREAM)
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        bound.bind(place)
        bound.listen(100)
    except OSError as error:
        bound.close()
        if isinstance(error, PermissionError):
            raise InputError(
                "this port cannot be used by everyone", parameter="port", came=port, allowed="1024 to 65535, 0 for any"
            ) from error
        with socket.socket(family, socket.SOCK_STREAM) as other:
            try:
                other.bind((place[0], 0, *place[2:]))
            except OSError as second:
                raise InputError("this is no address of this machine", parameter="host", came=host) from second
            free = other.getsockname()[1]
        raise InputError(
            "another program listens on this port",
            parameter="port",
            came=port,
            cure=f"Give `port={free}`, which is free.",
        ) from error
    return bound


#: viser is started once at a time, because its function to listen is replaced meanwhile.
_starting: Final = threading.Lock()


def start_server(gate: Gate, bound: socket.socket, title: str) -> viser.ViserServer:
    """Start viser behind a gate, on a socket that listens already.

    Raises
    ------
    RuntimeError
        If this viser does not listen as it is relied on: then nothing is served.
    """
    served = []

    def gated(handler: Any, host: Any, port: Any, *, process_request: Any, **how: Any) -> Any:
        if process_request is None:
            raise RuntimeError("viser serves no pages")
        served.append(True)
        given = {
            **how,
            "process_request": gate.answer(process_request),
            "create_connection": gate.connection_class(),
            "max_size": _MESSAGE_SIZE,
            "logger": _quiet(),
            "server_header": None,
            "sock": bound,
        }
        return listen(handler, None, None, **given)

    with _starting:
        listen = websockets.asyncio.server.serve
        websockets.asyncio.server.serve = gated  # type: ignore[assignment,misc]
        try:
            with _without_words():
                server = viser.ViserServer(host=gate.access.host, port=gate.access.port, label=title, verbose=False)
        finally:
            websockets.asyncio.server.serve = listen  # type: ignore[misc]
    if not served or server.get_port() != bound.getsockname()[1]:
        server.stop()
        raise RuntimeError("viser does not listen as it is relied on")
    _forget_sharing(server)
    return server


def _forget_sharing(server: viser.ViserServer) -> None:
    """Let nothing ask viser's makers for a public address of this window."""
    server.request_share_url = lambda *_, **__: None  # type: ignore[method-assign]


def _without_words() -> Any:
    """Return a context in which viser does not print where it listens: the command says it, with the token's page."""
    from contextlib import redirect_stdout
    from io import StringIO

    return redirect_stdout(StringIO())


def _quiet() -> logging.Logger:
    """Return a log that keeps to itself what connections end with: the gate says what it refuses."""
    log = logging.getLogger("truearm.studio.connections")
    log.propagate = False
    if not log.handlers:
        log.addHandler(logging.NullHandler())
    return log


def _shown(text: str) -> str:
    return printable(shortened(text, 100))
